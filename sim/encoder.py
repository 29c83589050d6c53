"""The virtual encoder: what the lines of an incremental encoder do while its shaft moves, and what is true meanwhile.

The truth is computed from the shaft's angle, never from the lines, so that it can judge whatever reads the lines.
Everything is drawn from raw PCG64 words and evaluated with operations that IEEE 754 rounds exactly: equal inputs give
equal bits on every machine.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tachometry.sim.crossings import Disc, find_crossings
from tachometry.sim.motion import FloatArray, Motion, Vibration, cos2pi
from tachometry.sim.recording import Recording

MAX_EDGES = 200_000_000
MAX_PULSES_PER_REV = 1 << 26

_CHUNK = 1 << 16
_LN2 = 0.6931471805599453
_CLIP = 0.49  # of the gap to a neighbour: two edges that move towards each other still keep their order

# Streams of random numbers, children of the seed: switching one disturbance on leaves the others as they were.
_NONUNIFORMITY, _JITTER, _ILLEGAL = range(3)


@dataclass(frozen=True)
class _VibratingShaft:
    motion: Motion
    vibration: Vibration | None
    start_angle_rad: float

    @property
    def breakpoints(self) -> FloatArray:
        return self.motion.breakpoints

    @property
    def max_frequency(self) -> FloatArray:
        return np.maximum(self.motion.sine_frequency, self.vibration.frequency_hz if self.vibration else 0.0)

    @property
    def reach(self) -> float:
        """Start angle and way travelled to and fro together, rad, or a little more."""
        vibrated = 4 * self.vibration.amplitude_rad * self.vibration.frequency_hz if self.vibration else 0.0
        start = abs(self.motion.start_angle[0] + self.start_angle_rad)
        return float(start + self.motion.max_travel + vibrated * self.motion.duration)

    def angle(self, t: ArrayLike) -> FloatArray:
        angle = self.motion.angle(t) + self.start_angle_rad
        return angle + self.vibration.angle(t) if self.vibration else angle

    def speed(self, t: ArrayLike) -> FloatArray:
        speed = self.motion.speed(t)
        return speed + self.vibration.speed(t) if self.vibration else speed

    def acceleration(self, t: ArrayLike) -> FloatArray:
        acceleration = self.motion.acceleration(t)
        return acceleration + self.vibration.acceleration(t) if self.vibration else acceleration


@dataclass(frozen=True)
class VirtualEncoder:
    """An incremental encoder with the faults of real ones.

    Forward is A before B: the quarters k mod 4 = 0, 1, 2, 3 show (A, B) = 00, 10, 11, 01. Edge k, between the quarters
    k - 1 and k, lies at (k + offset[k mod 4 pulses_per_rev]) pitches of 2 pi / (4 pulses_per_rev) rad.

    Parameters
    ----------
    pulses_per_rev : int
        Lines of the disc: pulses of A per revolution.
    vibration : Vibration or None
        Of the shaft; it is part of the truth.
    jitter : float, from 0 to less than 0.5
        Standard deviation of the Gaussian shift in time of each edge, as a fraction of its gap to the nearer of its
        neighbours (edges, start and end of the recording). Shifts are clipped at 0.49 gaps: edges keep their order.
    nonuniformity : float, from 0 to less than 0.5
        The disc's offsets are uniform between plus and minus this many pitches.
    illegal : float, from 0 to 1
        Probability that an edge is late and comes at the instant of the next one, so that both lines change at once.
        An edge is not late if the one before it is, or if the next one is of the same line, as after a reversal.
    start_angle_rad : float, rad
        Added to the angle of the motion. At 0, a motion from angle 0 begins exactly on edge 0, which has been passed.
    seed : int, at least 0
        Of all random numbers. Nonuniformity, jitter and illegal transitions have streams of their own.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    pulses_per_rev: int
    vibration: Vibration | None = None
    jitter: float = 0.0
    nonuniformity: float = 0.0
    illegal: float = 0.0
    start_angle_rad: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.pulses_per_rev <= MAX_PULSES_PER_REV:
            raise ValueError(f"pulses_per_rev must be from 1 to {MAX_PULSES_PER_REV}, not {self.pulses_per_rev}")
        for name, value in (("jitter", self.jitter), ("nonuniformity", self.nonuniformity)):
            if not 0 <= value < 0.5:
                raise ValueError(f"{name} must be from 0 to less than 0.5, not {value}")
        if not 0 <= self.illegal <= 1:
            raise ValueError(f"illegal must be from 0 to 1, not {self.illegal}")
        if not math.isfinite(self.start_angle_rad):
            raise ValueError(f"start_angle_rad must be finite, not {self.start_angle_rad}")
        if self.seed < 0:
            raise ValueError(f"seed must be at least 0, not {self.seed}")

    @cached_property
    def disc(self) -> Disc:
        """The edges of the disc."""
        n_edges = 4 * self.pulses_per_rev
        offset = np.zeros(1)
        if self.nonuniformity > 0:
            offset = self.nonuniformity * (2 * _uniform(self._stream(_NONUNIFORMITY), n_edges) - 1)
        return Disc(2 * math.pi / n_edges, offset)

    def record(self, motion: Motion) -> "Encoding":
        """Let the shaft move.

        Raises
        ------
        ValueError
            If that could be more than `MAX_EDGES` edges, those from angle 0 to the start included.
        """
        shaft = _VibratingShaft(motion, self.vibration, self.start_angle_rad)
        n_edges = shaft.reach / self.disc.pitch_rad
        if not n_edges <= MAX_EDGES:
            raise ValueError(
                f"motion must be of at most {MAX_EDGES} encoder edges, start angle included, not {n_edges:.3g}"
            )
        time, quarter = find_crossings(shaft, self.disc)
        time = np.append(0.0, self._jittered(time, motion.duration))
        quarter = np.append(self.disc.quarter(shaft.angle(np.zeros(1))), quarter) & 3
        seen = ~self._late(quarter)
        time, quarter = time[seen], quarter[seen]
        a = (quarter == 1) | (quarter == 2)
        b = quarter >= 2
        recording = Recording(time, a.astype(np.uint8), b.astype(np.uint8), motion.duration)
        return Encoding(self, motion, recording, int(np.count_nonzero(~seen)))

    def _jittered(self, time: FloatArray, duration: float) -> FloatArray:
        if self.jitter == 0:
            return time
        gap = np.diff(time, prepend=0.0, append=duration)
        shift = np.clip(self.jitter * _gaussian(self._stream(_JITTER), len(time)), -_CLIP, _CLIP)
        return time + shift * np.minimum(gap[:-1], gap[1:])

    def _late(self, quarter: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Rows of a recording (row 0: the levels at rest) that come at the instant of the next row."""
        late = np.zeros(len(quarter), dtype=np.bool_)
        if self.illegal == 0:
            return late
        drawn = _uniform(self._stream(_ILLEGAL), len(quarter) - 1)[:-1] < self.illegal
        drawn &= (quarter[2:] - quarter[:-2]) & 3 == 2  # the two edges are of different lines
        index = np.arange(len(drawn))
        last_undrawn = np.maximum.accumulate(np.where(drawn, -1, index))
        late[1:-1] = drawn & ((index - last_undrawn) & 1 == 1)  # of edges drawn in a row every other one: pairs
        return late

    def _stream(self, which: int) -> np.random.PCG64:
        return np.random.PCG64(np.random.SeedSequence(self.seed).spawn(3)[which])


@dataclass(frozen=True, eq=False)
class Encoding:
    """What an encoder recorded of a motion, and the truth about it.

    Parameters
    ----------
    encoder : VirtualEncoder
    motion : Motion
    recording : Recording
        The lines, in seconds.
    n_illegal : int
        Number of instants at which both lines change.
    """

    encoder: VirtualEncoder
    motion: Motion
    recording: Recording
    n_illegal: int

    def true_position(self, t: ArrayLike, decoding: int = 4) -> NDArray[np.int64]:
        """Counts since time 0 that an ideal decoder of the disc would have at times `t` in seconds.

        Decoding 4 counts every edge, 2 both edges of A, 1 the edges of A while B is low. Vibration and nonuniformity
        are in it; jitter and illegal transitions, which are faults of the lines, are not.
        """
        if decoding not in (1, 2, 4):
            raise ValueError(f"decoding must be 1, 2 or 4, not {decoding}")
        lead, shift = {4: (0, 0), 2: (1, 1), 1: (3, 2)}[decoding]
        now, start = (self.encoder.disc.quarter(self._shaft.angle(time)) for time in (t, 0.0))
        return ((now + lead) >> shift) - ((start + lead) >> shift)

    def true_speed(self, t: ArrayLike) -> FloatArray:
        """Speed of the shaft in rad/s, vibration included, at times `t` in seconds."""
        return self._shaft.speed(t)

    def motion_speed(self, t: ArrayLike) -> FloatArray:
        """Speed of the motion in rad/s, without vibration, at times `t` in seconds."""
        return self.motion.speed(t)

    @property
    def _shaft(self) -> _VibratingShaft:
        return _VibratingShaft(self.motion, self.encoder.vibration, self.encoder.start_angle_rad)


def _uniform(stream: np.random.PCG64, n: int) -> FloatArray:
    """Uniform in [0, 1), from the raw words, which numpy promises never to change."""
    return (stream.random_raw(n) >> np.uint64(11)).astype(np.float64) * 2.0**-53


def _gaussian(stream: np.random.PCG64, n: int) -> FloatArray:
    """Standard normal (Box and Muller); numpy's own differs between versions and C libraries."""
    normal = np.empty(n)
    for begin in range(0, n, _CHUNK):
        part = normal[begin : begin + _CHUNK]
        u, v = _uniform(stream, 2 * len(part)).reshape(-1, 2).T
        part[:] = np.sqrt(-2 * _log(1 - u)) * cos2pi(v)
    return normal


def _log(x: FloatArray) -> FloatArray:
    """Natural logarithm, the same bits on every machine; |error| < 1e-15 max(1, |log x|)."""
    mantissa, exponent = np.frexp(x)
    low = mantissa < math.sqrt(0.5)
    mantissa, exponent = np.where(low, 2 * mantissa, mantissa), exponent - low
    s = np.asarray((mantissa - 1) / (mantissa + 1), dtype=np.float64)
    series = np.zeros_like(s)
    for n in range(19, 0, -2):
        series = series * (s * s) + 2 / n
    return s * series + exponent * _LN2
