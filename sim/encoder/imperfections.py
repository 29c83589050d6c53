"""Imperfections stand between the edges of a disc and the lines of an encoder; `VirtualEncoder` explains each.

Everything is drawn from raw PCG64 words and evaluated with operations that IEEE 754 rounds exactly: equal inputs give
equal bits on every machine. Each imperfection has random numbers of its own, as many for each edge of the shaft,
whether that edge arrives or not: switching one on leaves the others as they were. So an edge has its number from the
start, by which `stream` finds what is drawn for it.

Lines are a change list: row r tells the instant and the levels A + 2 B from then on, row 0 the levels at rest.
"""

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.encoder.motion import FloatArray, cos2pi
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.units import TIME, read_nearest, short_time

Rows = NDArray[np.intp]
Levels = NDArray[np.uint8]

# Streams of random numbers, children of the seed.
NONUNIFORMITY, JITTER, ILLEGAL, LOST, BOUNCE, NOISE, WRONG_READS, FLIPS = range(8)

MAX_BOUNCES = 1000

_FAULTY = ("a", "b", "c", "z", "a_n", "b_n", "z_n")
_CHUNK = 1 << 16
_LN2 = 0.6931471805599453
_CLIP = 0.49  # of the gap to a neighbour: two edges that move towards each other still keep their order


@dataclass(frozen=True)
class Bounce:
    """Chatter of a contact: how often it falls back after an edge, and within what time."""

    count: int  # from 1 to `MAX_BOUNCES`
    time_s: float  # seconds, more than 0

    def __post_init__(self) -> None:
        if not 1 <= self.count <= MAX_BOUNCES:
            raise ParameterError("bounce count", f"must be from 1 to {MAX_BOUNCES}, not {self.count}")
        if not 0 < self.time_s < math.inf:
            raise ParameterError("bounce time", f"must be more than 0 s, not {short_time(self.time_s)}")

    @staticmethod
    def parse(text: str) -> "Bounce":
        """Read COUNT:TIME, such as 3:500us (s, ms, us or ns)."""
        match = re.fullmatch(r"\s*(\d{1,30}):([^:]+)", text, re.ASCII)
        if match is None:
            raise ParameterError("bounce", f"must be COUNT:TIME, such as 3:500us, not {text!r}")
        return Bounce(int(match[1]), read_nearest("bounce time", match[2], TIME))


@dataclass(frozen=True)
class LineFault:
    """A line is at fault from some time on."""

    line: str  # `a`, `b`, `c` of halls, `z`, or a complement: `a_n`, `b_n` or `z_n`
    time_s: float  # seconds

    def __post_init__(self) -> None:
        if self.line not in _FAULTY:
            raise ParameterError("line", f"must be a, b, c, z, a_n, b_n or z_n, not {self.line!r}")
        if not 0 <= self.time_s < math.inf:
            raise ParameterError("time", f"must be 0 s or more, not {short_time(self.time_s)}")

    @staticmethod
    def parse(what: str, text: str) -> "LineFault":
        """Read LINE:TIME, such as b:200ms (s, ms, us or ns)."""
        line, _, time = text.strip().partition(":")
        if line.lower() not in _FAULTY or not time:
            lines = "line a, b, c or z, or a complement as a_n"
            raise ParameterError(what, f"must be LINE:TIME, such as b:200ms, with {lines}, not {text!r}")
        if (begins := read_nearest(what, time, TIME, "s")) < 0:
            raise ParameterError(what, f"must begin at 0 s or later, not at {time}")
        return LineFault(line.lower(), begins)

    def applied(
        self, time: FloatArray, level: Levels, bit: np.uint8, kept: list[np.uint8] | None
    ) -> tuple[FloatArray, Levels]:
        """Return times and levels with the line of this bit high from then on, as an open input, or as it is then.

        `kept` holds what it is then for rows that begin later; None for an open input.
        """
        if begins := int(np.searchsorted(time, self.time_s, side="right")):
            time = np.insert(time, begins, self.time_s)
            level = np.insert(level, begins, level[begins - 1])
            if kept is not None:
                kept[:] = [level[begins] & bit]
        level[begins:] = level[begins:] & ~bit | (bit if kept is None else kept[0])
        changed = np.append(True, level[1:] != level[:-1])
        return time[changed], level[changed]


def stream(seed: int, which: int, first: int = 0) -> np.random.PCG64:
    """Return the random numbers of one imperfection, from number `first` on."""
    random = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(which,)))
    random.advance(first)
    return random


def displaced_edges(phase_error_deg: float, duty_error_deg: float) -> FloatArray:
    """Return offsets of the edges 0 to 3 of each period, in pitches of 90 electrical degrees.

    The centre of B's pulse moves by the phase error, the ends of both pulses by half the duty error, outwards.
    """
    half = duty_error_deg / 180
    b = phase_error_deg / 90
    return np.array([b + half, -half, b - half, half])  # B falls, A rises, B rises, A falls


def jittered(time: FloatArray, ends: tuple[float, float], deviation: float, random: np.random.PCG64) -> FloatArray:
    """Return edges shifted in time; they keep their order, and stay within what is before and after them, `ends`."""
    gap = np.diff(time, prepend=ends[0], append=ends[1])
    shift = np.clip(deviation * gaussian(random, len(time)), -_CLIP, _CLIP)
    return time + shift * np.minimum(gap[:-1], gap[1:])


def lose_pulses(level: Levels, probability: float, random: np.random.PCG64) -> tuple[Levels, Rows]:
    """Keep a line low where it would have risen and fallen again; also the rows in which lost pulses begin."""
    drawn = uniform(random, len(level) - 1) < probability
    seen, begun = level.copy(), [np.empty(0, dtype=np.intp)]
    for line in (np.uint8(1), np.uint8(2)):
        change = np.diff((level & line).astype(np.int8))
        rise = np.flatnonzero(change > 0)
        fall = np.flatnonzero(change < 0)[int(level[0] & line != 0) :]
        rise = rise[: len(fall)]  # the pulses that begin and end within the recording
        lost = drawn[rise]
        covered = np.zeros(len(level), dtype=np.int8)
        covered[rise[lost] + 1] = 1
        covered[fall[lost] + 1] = -1
        seen[np.cumsum(covered) > 0] &= ~line
        begun.append(rise[lost] + 1)
    return seen, np.concatenate(begun)


def late_edges(level: Levels, row: Rows, probability: float, random: np.random.PCG64) -> NDArray[np.bool_]:
    """Return which of the rows `row`, those that change a line, come at the instant of the next of them."""
    late = np.zeros(len(row), dtype=np.bool_)
    drawn = (uniform(random, len(level) - 1) < probability)[row[1:-1] - 1]
    drawn &= level[row[2:]] ^ level[row[:-2]] == 3  # the two edges are of different lines
    index = np.arange(len(drawn))
    last_undrawn = np.maximum.accumulate(np.where(drawn, -1, index))
    late[1:-1] = drawn & ((index - last_undrawn) & 1 == 1)  # of edges drawn in a row every other one: pairs
    return late


def chattering(
    time: FloatArray, level: Levels, row: Rows, duration: float, bounce: Bounce, random: np.random.PCG64
) -> tuple[FloatArray, Levels]:
    """Return times and levels of the rows `row`, with the chatter after each of them that changes one line."""
    n_changes = 2 * bounce.count
    moment = np.sort(uniform(random, (len(time) - 1) * n_changes).reshape(-1, n_changes)[row[1:] - 1], axis=1)
    time, level = time[row], level[row]
    before, after = level[:-1, None], level[1:, None]
    span = np.minimum(bounce.time_s, np.diff(time, append=duration)[1:, None] / 2)
    times = np.hstack([time[1:, None], time[1:, None] + moment * span])
    levels = np.hstack([after] + [before, after] * bounce.count)
    arrives = np.hstack([np.ones_like(after, dtype=np.bool_), np.repeat(before ^ after != 3, n_changes, axis=1)])
    return np.append(time[0], times[arrives]), np.append(level[0], levels[arrives])


def gated_index(
    time: FloatArray,
    level: Levels,
    slot_time: FloatArray,
    slot: NDArray[np.bool_],
    z: np.uint8 = np.uint8(4),  # noqa: B008
    gate: int | None = 0,
) -> tuple[FloatArray, Levels]:
    """Return times, and levels with the bit `z`: high while the shaft is in the slot of the index and the lines have
    the levels `gate`, None for any.
    """
    times = np.union1d(time, slot_time)
    level = level[np.searchsorted(time, times, side="right") - 1]
    slot = slot[np.searchsorted(slot_time, times, side="right") - 1]
    level = np.where(slot if gate is None else slot & (level == gate), level | z, level)
    changed = np.append(True, level[1:] != level[:-1])
    return times[changed], level[changed]


def pulsed(
    time: FloatArray,
    step: NDArray[np.int64],
    duration: float,
    *,
    directed: bool,
    both_edges: bool = False,
    nth: int = 0,
) -> tuple[FloatArray, Levels]:
    """Return times and levels of pulses, each of which lasts for half the time to the next one.

    - `time`, shape (n + 1,), seconds: The start, and the times of the steps.
    - `directed`: Pulses are on line A, and B is high for those forward, from the end of the pulse before; else they are
      on A for those forward and on B for those backward.
    - `both_edges`: Each edge of A is a step, with `directed`; the direction still changes between them.
    - `nth`: Steps before these.
    """
    begin, end = time[1:], (time[1:] + np.append(time[2:], duration)) / 2
    if directed:
        direction = np.append(np.where(step > 0, 2, 0), 2 * int(len(step) and step[-1] > 0))
        high = np.arange(nth + 1, nth + len(step) + 1) & 1 if both_edges else 1
        rise, fall, first = direction[:-1] | high, direction[1:] | high * both_edges, direction[0]
    else:
        rise, fall, first = np.where(step > 0, 1, 2), np.zeros_like(step), np.int64(0)
    times = np.append(time[0], np.stack([begin, end], axis=1).ravel())
    level = np.append(first, np.stack([rise, fall], axis=1).ravel())
    return times, level.astype(np.uint8)


def uniform(random: np.random.PCG64, n: int) -> FloatArray:
    """Return uniform in [0, 1), from the raw words, which numpy promises never to change."""
    return (random.random_raw(n) >> np.uint64(11)).astype(np.float64) * 2.0**-53


def gaussian(random: np.random.PCG64, n: int) -> FloatArray:
    """Return standard normal (Box and Muller); numpy's own differs between versions and C libraries."""
    normal = np.empty(n)
    for begin in range(0, n, _CHUNK):
        part = normal[begin : begin + _CHUNK]
        u, v = uniform(random, 2 * len(part)).reshape(-1, 2).T
        part[:] = np.sqrt(-2 * _log(1 - u)) * cos2pi(v)
    return normal


def _log(x: FloatArray) -> FloatArray:
    """Return natural logarithm, the same bits on every machine; |error| < 1e-15 max(1, |log x|)."""
    mantissa, exponent = np.frexp(x)
    low = mantissa < math.sqrt(0.5)
    mantissa, exponent = np.where(low, 2 * mantissa, mantissa), exponent - low
    s = np.asarray((mantissa - 1) / (mantissa + 1), dtype=np.float64)
    series = np.zeros_like(s)
    for n in range(19, 0, -2):
        series = series * (s * s) + 2 / n
    return s * series + exponent * _LN2
