"""The virtual encoder: what the lines of an incremental encoder do while its shaft moves, and what is true meanwhile.

The truth is computed from the shaft's angle, never from the lines, so that it can judge whatever reads the lines.
"""

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, cached_property
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tachometry.sim.encoder import imperfections
from tachometry.sim.encoder.crossings import Disc, IntArray, find_crossings, passages
from tachometry.sim.encoder.imperfections import BOUNCE, ILLEGAL, JITTER, LOST, NONUNIFORMITY
from tachometry.sim.encoder.motion import FloatArray, Motion, VibratingShaft, sin2pi
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.sim.signals.flow import Flow, Part
from tachometry.sim.signals.memory import EDGE, check_memory
from tachometry.sim.signals.recording import MAX_EDGES, Recording, packed, quadrature
from tachometry.spec import Encoder, TachometerSpec
from tachometry.spec.core.sensors import KINDS, READ, SENSORS
from tachometry.spec.core.tooth_wheel import parts_of
from tachometry.spec.language.option import ParameterError

MAX_PULSES_PER_REV = 1 << 26
MAX_UNEVEN_PULSES = 1 << 20  # of a disc whose edges are all displaced: each takes memory
# Edges in a period of the disc, where these are not those of quadrature; and sensors that may have a fault.
_EDGES = {"step-dir": 1, "up-down": 1, "hall": 6} | dict.fromkeys(READ, 1)
_WITH_EDGES = ("quadrature", "pulses", "step-dir", "up-down", "hall")
_FAULTS_OF = {
    "phase_error_deg": ("quadrature",),
    "illegal": ("quadrature",),
    "broken": ("quadrature", "hall"),
    "stuck": ("quadrature", "hall"),
    "duty_error_deg": ("quadrature", "pulses"),
    "bounce": ("quadrature", "pulses", "hall"),
    "lost": ("quadrature", "pulses"),
    **dict.fromkeys(("jitter", "nonuniformity", "eccentricity", "index_skew_s"), _WITH_EDGES),
    **dict.fromkeys(("noise", "interpolation", "frame_errors"), tuple(READ)),
}


@cache
def _halls() -> NDArray[np.uint8]:
    """Return the levels of hall sensors in a cycle; the page without NumPy imports this, and never asks."""
    halls: NDArray[np.uint8] = packed(
        [np.array(line, dtype=np.uint8) for line in zip(*SENSORS["hall"].cycle, strict=True)]
    )
    return halls


class _Lines(NamedTuple):
    """Holds the lines that some edges make. What is before the first of them and after the last is not known."""

    times: FloatArray  # shape (r,): of the recording
    level: NDArray[np.uint8]  # shape (r,)
    at: FloatArray  # shape (n,): when the quarters begin
    row: IntArray  # those quarters that the lines show
    clean: IntArray  # those before which no pulse has begun that may be lost
    late: IntArray  # those that come with the next
    lost: IntArray  # those in which a lost pulse begins

    def certain(self, away: float) -> tuple[int, int]:
        """Return the quarter up to which later edges change nothing, and one that must be held for those after it.

        An index is up to `away` seconds away from its edges.
        """
        sure = self.row[self.row <= self.clean[-1]][:-1]
        sure = np.append(0, sure[self.at[sure] + away <= self.at[-2]])
        held = np.intersect1d(self.clean, sure[:-2])
        return int(sure[-1]), int(np.append(0, held[self.at[held] + away <= self.at[sure[-1]]])[-1])


@dataclass(frozen=True)
class VirtualEncoder(EncoderOptions):
    """An incremental encoder with the faults of real ones, see `EncoderOptions`.

    Forward is A before B: the quarters k mod 4 = 0, 1, 2, 3 show (A, B) = 00, 10, 11, 01. Edge k, between the quarters
    k - 1 and k, lies at (k + offset[k mod 4 pulses_per_rev]) pitches of 2 pi / (4 pulses_per_rev) rad.

    - `start_angle_rad`, rad: Added to the angle of the motion. At 0, a motion from angle 0 begins exactly on edge 0,
      which has been passed.
    - `index`: Whether there is an index line Z: high once a turn, in the first period from shaft angle 0, and gated as
      usual: only while A and B are as in `index_state`.
    - `index_state`: Place of the index in its period: in quadrature 0, where A and B are low, to 3; usually 2, where
      cores take it.
    - `sensor`: What it is instead of an incremental encoder with lines A and B, see `tachometry.spec.core.sensors`. Of
      pulses there is line A alone. Halls change six times in each of `pulses_per_rev` periods. Of steps and of pulses
      up and down there are as many in a turn; each lasts for half the time to the next one, and the direction changes
      as it ends. Of these a pitch is a step, and neither they nor halls have faults of quadrature.
    - `reverse`: It is mounted the other way round, so its lines are those of a shaft that turns backward.
    - `invert`: Lines that are low where others are high, with commas between.
    - `teeth`: Of pulses, the pattern of the wheel, see `Encoder`: the gap of a part comes last in it.
    - `both_edges`: Of steps: each edge of A is one, and there are two in each of `pulses_per_rev` periods.
    - `ratio`: Turns of the disc for one of the shaft, see `Encoder`.
    - `complemented`: Lines whose complements are there as well, named `a_n` for `a`.

    It raises ValueError if a parameter is out of range.
    """

    pulses_per_rev: int
    start_angle_rad: float = 0.0
    index: bool = False
    sensor: str = "quadrature"
    index_state: int = 2
    reverse: bool = False
    invert: str | None = None
    teeth: str | None = None
    both_edges: bool = False
    ratio: str | None = None
    complemented: tuple[str, ...] = ()

    @classmethod
    def of(cls, encoder: Encoder, **values: Any) -> "VirtualEncoder":
        """Return the encoder that a core is made for, with these values of its other parameters."""
        own = {name: getattr(encoder, name) for name in ("sensor", "reverse", "invert", "teeth", "ratio")}
        own["both_edges"] = encoder.sensor == "step-dir" and encoder.decoding == 2
        if encoder.teeth:  # its pattern is the index
            values["index"] = False
        return cls(encoder.pulses_per_rev, **own, **values)

    @classmethod
    def of_core(cls, spec: TachometerSpec, **values: Any) -> "VirtualEncoder":
        """Return the encoder of `of`, with the lines of the index and complements that the core has."""
        front = spec.front_end
        lines = dict(index=spec.index is not None, index_state=front.index_place, complemented=front.complemented)
        return cls.of(spec.encoder, **lines, **values)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= self.pulses_per_rev <= MAX_PULSES_PER_REV:
            raise ParameterError("pulses_per_rev", f"must be from 1 to {MAX_PULSES_PER_REV}, not {self.pulses_per_rev}")
        for name in ("nonuniformity", "eccentricity"):
            if getattr(self, name) and self.pulses_per_rev > MAX_UNEVEN_PULSES:
                rest = f"must be 0 with more than {MAX_UNEVEN_PULSES} pulses per revolution, not {getattr(self, name)}"
                raise ParameterError(name, rest)
        for name, sensors in _FAULTS_OF.items():
            if getattr(self, name) and self.sensor not in sensors:
                raise ParameterError(name, f"must not be given with --sensor {self.sensor}")
        for name, fault in (("broken", self.broken), ("stuck", self.stuck)):
            lines = KINDS[self.sensor].lines
            if fault is None or fault.line in (*lines, "z", *(f"{line}_n" for line in self.complemented)):
                continue
            if fault.line.endswith("_n"):
                made = (
                    "--differential and --index, which make" if fault.line == "z_n" else "--differential, which makes"
                )
                raise ParameterError(name, f"must not be of {fault.line} without {made} that line")
            raise ParameterError(name, f"must be of line {', '.join(lines)} or z, not {fault.line}")
        if not math.isfinite(self.start_angle_rad):
            raise ValueError(f"start_angle_rad must be finite, not {self.start_angle_rad}")

    @property
    def edges_per_rev(self) -> int:
        """Edges of the disc in a turn."""
        return _EDGES.get(self.sensor, 4) * self.pulses_per_rev << self.both_edges

    @cached_property
    def disc(self) -> Disc:
        """The edges of the disc."""
        n_edges = self.edges_per_rev
        offset = np.zeros(1)
        if self.nonuniformity > 0:
            random = self._stream(NONUNIFORMITY)
            offset = self.nonuniformity * (2 * imperfections.uniform(random, n_edges) - 1)
        if self.eccentricity > 0:
            offset = offset + self.eccentricity * sin2pi(np.arange(n_edges) / n_edges)
        if self.phase_error_deg or self.duty_error_deg:
            displaced = imperfections.displaced_edges(self.phase_error_deg, self.duty_error_deg)
            offset = offset + np.tile(displaced, max(len(offset) // 4, 1))
        return Disc(2 * math.pi / n_edges / float(Fraction(self.ratio or 1)), offset)

    def record(self, motion: Motion) -> "Encoding":
        """Let the shaft move; ValueError if that could be more than `MAX_EDGES` edges, with those before the start."""
        flow, truth = self.flow(motion)
        assert isinstance(flow, Flow)
        return replace(truth, recording=flow.whole())

    def flow(self, motion: Motion) -> "tuple[Flow | Recording, Encoding]":
        """Let the shaft move; return the recording of `record`, in parts but for encoders that are read, and the truth
        about it. Its faults are counted as the parts come.
        """
        truth = Encoding(self, motion, Recording.of_level(np.zeros(1), np.zeros(1, np.uint8), motion.duration))
        return Flow(self._wires, self._parts(truth), lambda _: self._check(motion), motion.duration), truth

    def _parts(self, truth: "Encoding") -> Generator[Part, None, None]:
        """Yield the recording of a motion: what is certain of the lines each time, from edges that are held."""
        shaft, duration, stuck = self.shaft(truth.motion), truth.motion.duration, list[np.uint8]()
        time, quarter = np.zeros(1), self.disc.quarter(shaft.angle(np.zeros(1)))
        nth, done, begin = 0, 0, 0.0  # numbers of the first edge that is held, and of that at time `begin`
        share = 2 * self.bounce.count if self.bounce else 1
        for edges, quarters in chain(passages(shaft, self.disc, share), [(time[:0], quarter[:0])]):
            time, quarter = np.append(time, edges), np.append(quarter, quarters)
            lines = self._lines(time, quarter, nth, duration)
            upto, first = lines.certain(abs(self.index_skew_s)) if len(edges) else (len(time), 0)
            if (end := float(lines.at[upto]) if len(edges) else math.inf) > begin:
                times, level = self._at_fault(lines.times, lines.level, duration, stuck)
                rows = slice(*np.searchsorted(times, (begin, end)))
                yield Part(times[rows], level[rows], min(end, duration))
                truth.n_illegal, truth.n_lost = (
                    before + each * int(np.count_nonzero((faults >= done - nth) & (faults < upto)))
                    for before, faults, each in ((truth.n_illegal, lines.late, 1), (truth.n_lost, lines.lost, 2))
                )
                done, begin = nth + upto, end
            time, quarter, nth = time[first:], quarter[first:], nth + first

    def shaft(self, motion: Motion) -> VibratingShaft:
        """Return the shaft in motion."""
        return VibratingShaft(motion, self.vibration, self.start_angle_rad)

    def _check(self, motion: Motion) -> None:
        """Check that a motion has not too many edges to be held."""
        n_edges = self.shaft(motion).reach / self.disc.pitch_rad * (1 + 2 * self.bounce.count if self.bounce else 1)
        if not n_edges <= MAX_EDGES:
            raise ParameterError(
                "motion",
                f"must be of at most {MAX_EDGES} encoder edges, start angle {'and bounce ' * bool(self.bounce)}"
                f"included, not {n_edges:.3g}",
            )
        check_memory(n_edges * EDGE, "--motion", "shorten it, or turn more slowly")

    @property
    def _wires(self) -> tuple[str, ...]:
        """Names of all lines."""
        lines = ("a", "b", "c") if self.sensor == "hall" else ("a", "b")
        return (*lines, *("z",) * self.index, *(f"{line}_n" for line in self.complemented))

    def _lines(self, time: FloatArray, quarter: IntArray, nth: int, duration: float) -> _Lines:
        """Return what lines make of quarters that begin at some times, the first with edge `nth`."""
        at, turned = time, -quarter if self.reverse else quarter
        if self.jitter:
            random = self._stream(JITTER, 2 * nth)
            at = np.append(time[0], imperfections.jittered(time[1:], (time[0], duration), self.jitter, random))
        row = clean = np.arange(len(at))
        late = lost = row[:0]
        if self.sensor in ("step-dir", "up-down"):
            directed = self.sensor == "step-dir"
            times, level = imperfections.pulsed(
                at, np.diff(turned), duration, directed=directed, both_edges=self.both_edges, nth=nth
            )
            return _Lines(*self._indexed(times, level, at, turned, duration), at, row, clean, late, lost)
        level = _halls()[turned % 6] if self.sensor == "hall" else quadrature(turned)
        if self.sensor == "pulses":
            level = self.patterned(level & np.uint8(1), turned)
        if self.lost:
            clean = np.append(0, np.flatnonzero(level[1:] == 0) + 1)
            level, lost = imperfections.lose_pulses(level, self.lost, self._stream(LOST, nth))
        row = np.flatnonzero(np.append(True, level[1:] != level[:-1]))
        if self.illegal:
            is_late = imperfections.late_edges(level, row, self.illegal, self._stream(ILLEGAL, nth))
            row, late = row[~is_late], row[is_late]
        if self.bounce:
            random = self._stream(BOUNCE, 2 * self.bounce.count * nth)
            times, level = imperfections.chattering(at, level, row, duration, self.bounce, random)
        else:
            times, level = at[row], level[row]
        return _Lines(*self._indexed(times, level, at, turned, duration), at, row, clean, late, lost)

    def patterned(self, level: NDArray[np.uint8], quarter: IntArray) -> NDArray[np.uint8]:
        """Return the levels of the wheel from those of a full one: some teeth are not there, or the last is two."""
        if self.teeth is None:
            return level
        slot = quarter // 4 % self.pulses_per_rev
        twice = self.teeth.endswith("+1") & (slot == self.pulses_per_rev - 1)
        return np.where(twice, quarter & 1, level * _there(self.teeth)[slot]).astype(np.uint8)

    def _indexed(
        self, times: FloatArray, level: NDArray[np.uint8], at: FloatArray, quarter: IntArray, duration: float
    ) -> tuple[FloatArray, NDArray[np.uint8]]:
        """Return all wires of the lines, with the index if there is one; their `quarter` begin at times `at`."""
        lines = self._wires
        if self.index:
            begin = self.index_state - (self.index_width - 1) // 2
            slot = (quarter - begin) % self.edges_per_rev < self.index_width
            gated = self.sensor == "quadrature" and self.index_width == 1 and not self.index_skew_s
            gate = int(quadrature(np.array(self.index_state))) if gated else None
            at = np.append(at[0], np.clip(at[1:] + self.index_skew_s, at[0], duration))
            times, level = imperfections.gated_index(times, level, at, slot, np.uint8(1 << lines.index("z")), gate)
        inverted = self.invert.split(",") if self.invert else ()
        level = level ^ np.uint8(sum(1 << place for place, line in enumerate(lines) if line in inverted))
        for line in self.complemented:
            own, other = (np.uint8(lines.index(name)) for name in (line, f"{line}_n"))
            level |= (~level >> own & np.uint8(1)) << other
        return times, level

    def _at_fault(
        self, times: FloatArray, level: NDArray[np.uint8], duration: float, stuck: list[np.uint8]
    ) -> tuple[FloatArray, NDArray[np.uint8]]:
        """Return what wires with line faults do; `stuck` is as of `LineFault.applied`."""
        lines = self._wires
        for fault, kept in ((self.broken, None), (self.stuck, stuck)):
            if fault is not None and fault.time_s < duration:
                bit = np.uint8(1 << lines.index(fault.line)) if fault.line in lines else np.uint8(0)
                times, level = fault.applied(times, level, bit, kept)
        return times, level

    def _stream(self, which: int, first: int = 0) -> np.random.PCG64:
        return imperfections.stream(self.seed, which, first)


def _there(pattern: str) -> NDArray[np.bool_]:
    """Return which teeth of a full wheel this one has."""
    return np.concatenate([np.arange(teeth) < teeth - missing for teeth, missing in parts_of(pattern)])


def _placed(pattern: str, there: NDArray[np.bool_], seen: IntArray) -> NDArray[np.bool_]:
    """Return at which teeth the gaps are known: after one gap, or after rows of teeth that fill a turn.

    - `there`, `seen`: Whether a tooth of the full wheel is there, and how many were up to it.
    """
    ends = np.flatnonzero(there[1:] & ~there[:-1] & (seen[:-1] >= 2)) + 1  # two teeth have shown their distance
    gaps = len(parts_of(pattern))
    up_to = np.append(0, seen[ends - 1])
    turns = up_to[gaps:] - up_to[:-gaps] == np.count_nonzero(_there(pattern))
    known = ends if gaps == 1 else ends[gaps - 1 :][turns]
    return np.arange(len(there)) > (known[0] if len(known) else len(there))


@dataclass(eq=False)
class Encoding:
    """Holds the recording that an encoder made of a motion, and the truth about it.

    - `n_illegal`: Number of instants at which both lines change.
    - `n_lost`: Number of edges that are missing, two for each pulse.
    """

    encoder: VirtualEncoder
    motion: Motion
    recording: Recording
    n_illegal: int = 0
    n_lost: int = 0

    def true_position(self, t: ArrayLike, decoding: int = 4) -> NDArray[np.int64]:
        """Return counts since time 0 that an ideal decoder of the disc would have at times `t` in seconds.

        Decoding 4 counts every edge, 2 both edges of A, 1 the edges of A while B is low. Vibration and what is of the
        disc (nonuniformity, eccentricity, phase and duty error) are in it; jitter, bounce, lost pulses and illegal
        transitions, which are faults of the lines, are not.
        """
        sign = -1 if self.encoder.reverse else 1
        if self.encoder.sensor == "pulses":
            counted = [np.searchsorted(times, t, side="right") for times in self._pulses(decoding)]
            return sign * np.sum([np.zeros(np.shape(t), dtype=np.int64), *counted], axis=0)
        if self.encoder.sensor == "quadrature" and decoding not in (1, 2, 4):
            raise ParameterError("decoding", f"must be 1, 2 or 4, not {decoding}")
        lead, shift = {2: (1, 1), 1: (3, 2)}.get(decoding, (0, 0))
        if self.encoder.sensor != "quadrature":
            lead = shift = 0
        now, start = (sign * self.encoder.disc.quarter(self._shaft.angle(time)) for time in (t, 0.0))
        return sign * (((now + lead) >> shift) - ((start + lead) >> shift))

    def _pulses(self, decoding: int) -> Iterator[FloatArray]:
        """Yield times at which line A alone counts, on an ideal line; of a wheel with gaps all at once."""
        pattern, disc = self.encoder.teeth, self.encoder.disc
        before = disc.quarter(self._shaft.angle(np.zeros(1)))
        for time, quarter in [find_crossings(self._shaft, disc)] if pattern else passages(self._shaft, disc):
            quarter = np.append(before, quarter)
            before, turned = quarter[-1:], -quarter if self.encoder.reverse else quarter
            change = np.diff((quadrature(turned) & 1).astype(np.int8))
            rises = change != 0 if decoding == 2 else change > 0
            counted = time[rises]
            if pattern is not None:
                level = self.encoder.patterned(quadrature(turned) & np.uint8(1), turned).astype(np.int8)
                extra = time[~rises & (np.diff(level) > 0)]
                there = level[1:][rises] > 0
                seen = np.cumsum(there)
                early = extra[np.searchsorted(counted, extra) < 4]  # an extra tooth counts until four have been seen
                counted = np.sort(np.append(counted[there | _placed(pattern, there, seen)], early))
            yield counted

    def true_speed(self, t: ArrayLike) -> FloatArray:
        """Return speed of the shaft in rad/s, vibration included, at times `t` in seconds; of pulses, which do not tell
        the direction, its magnitude.
        """
        speed = self._shaft.speed(t)
        if self.encoder.sensor == "pulses":
            return -np.abs(speed) if self.encoder.reverse else np.abs(speed)
        return speed

    def true_angle(self, t: ArrayLike) -> FloatArray:
        """Return angle of the shaft in rad, vibration included, at times `t` in seconds."""
        return self._shaft.angle(t)

    @property
    def _shaft(self) -> VibratingShaft:
        return self.encoder.shaft(self.motion)
