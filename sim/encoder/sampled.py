"""Encoders that are read: their reads of a shaft, and reads that visit what every core must survive."""

import math
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tachometry.sim.encoder import imperfections
from tachometry.sim.encoder.absolute import Answers, answer, frames
from tachometry.sim.encoder.imperfections import FLIPS, NOISE, WRONG_READS
from tachometry.sim.encoder.motion import Motion, sin2pi
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.sim.signals.recording import MAX_EDGES, PinTrace, Recording
from tachometry.spec import TachometerSpec
from tachometry.spec.core.reads import Reads
from tachometry.spec.core.sampled import Sampled
from tachometry.spec.language.option import ParameterError

Ints = NDArray[np.int64]


@dataclass(eq=False)
class ReadEncoding(Encoding):
    """Reads of a shaft, and the truth about it: its position is that of the latest read."""

    # shape (n,): when each read ends, in seconds, and its position, without wrapping
    read_time: NDArray[np.float64] = field(kw_only=True)
    read: Ints = field(kw_only=True)

    def true_position(self, t: ArrayLike, decoding: int = 4) -> Ints:
        found: Ints = np.append(0, self.read)[np.searchsorted(self.read_time, t, side="right")]
        return found


@dataclass(frozen=True)
class SampledEncoder(VirtualEncoder):
    """An absolute encoder that is read once in each nominal tick of a core, shortly before it ends."""

    core: TachometerSpec | None = None

    def record(self, motion: Motion) -> ReadEncoding:
        assert self.core is not None
        sampled = self.core.encoder.sampled
        assert sampled is not None
        timing, cycles = self.core.timing, self.core.timing.tick_cycles
        n_ticks = math.floor(motion.duration * timing.clock_hz / cycles)
        if n_ticks > MAX_EDGES:
            raise ParameterError("motion", f"must last for at most {MAX_EDGES} ticks, not {n_ticks}")
        age = cycles // 4 if sampled.age is None else sampled.age
        clock = np.arange(1, n_ticks + 1) * cycles - 2 - cycles // 8
        if (reads := self.core.reads) is not None:
            start, age = np.array(self.core.read_starts(n_ticks * cycles)), reads.oldest
            clock = start + reads.longest
        clock = clock[clock >= max(age, 1)] if reads is None else clock
        time = clock / timing.clock_hz
        shaft = Encoding(self, motion, Recording.of_level(np.zeros(1), np.zeros(1, np.uint8), 1.0))
        angle = shaft.true_angle(np.maximum(clock - age, 0) / timing.clock_hz)
        turn = angle / (2 * math.pi) * float(Fraction(self.ratio or 1))
        place = self._disturbed(-turn if self.reverse else turn, len(clock), 1 << sampled.bits)
        wrong = imperfections.uniform(self._stream(WRONG_READS), len(clock)) < self.frame_errors
        if reads is not None:
            sent = Answers(place & (1 << sampled.width) - 1, reads.delay)
            begin = np.where(wrong, imperfections.uniform(self._stream(FLIPS), len(clock)), -1)
            at, level = answer(reads, start, replace(sent, flip=np.floor(begin * frames(reads, sent).shape[1])))
            at = at[at < n_ticks * cycles]
            none = np.zeros(len(at), dtype=np.uint8)
            more = {reads.line: level[: len(at)]}
        else:
            lines = read_lines(sampled, place, np.full(len(clock), age), (~wrong).astype(np.int64))
            at = np.append(0, np.stack([clock, clock + 1], axis=1).ravel())
            none = np.zeros(len(at), dtype=np.uint8)
            more = {name: np.append(0, values) for name, values in lines.items()}
        recording = Recording(at / timing.clock_hz, none, none, motion.duration, more=more)
        read = (-place if self.reverse else place)[~wrong]
        read = read - (read[:1] & -1 << sampled.width).sum() - (self.core.encoder.zero or 0)
        return ReadEncoding(self, motion, recording, read_time=time[~wrong], read=read)

    def flow(self, motion: Motion) -> tuple[Recording, Encoding]:
        truth = self.record(motion)
        return truth.recording, truth

    def _disturbed(self, turn: NDArray[np.float64], n: int, counts: int) -> Ints:
        """Return what the encoder reads at these places."""
        place = turn * counts
        if self.interpolation is not None:
            lsb, periods = self.interpolation
            place = place + lsb * sin2pi(turn * periods)
        if self.noise:
            place = place + self.noise * imperfections.gaussian(self._stream(NOISE), n)
        return np.floor(place).astype(np.int64)


def encoder_of(spec: TachometerSpec, **values: Any) -> VirtualEncoder:
    """Return the encoder that a core is made for, see `VirtualEncoder.of_core`."""
    if spec.encoder.sampled is None:
        return VirtualEncoder.of_core(spec, **values)
    return SampledEncoder.of(spec.encoder, core=spec, **values)


def read_lines(sampled: Sampled, sample: Ints, age: Ints, right: Ints) -> dict[str, Ints]:
    """Return the lines of a core from one read to the next, each level twice: with the strobe, and without."""
    lines = {"sample": sample & (1 << sampled.width) - 1, "sample_ok": right}
    found = {name: np.repeat(values, 2) for name, values in (lines | {"sample_age": age}).items()}
    if sampled.age is not None:
        del found["sample_age"]
    return found | {"sample_valid": np.tile([1, 0], len(sample))}


def stress_reads(spec: TachometerSpec, seed: int, n_edges: int) -> PinTrace:
    """Return reads of a shaft that creeps, turns, reverses, jumps and rests, some late, wrong or missing."""
    sampled, cycles = spec.encoder.sampled, spec.timing.tick_cycles
    assert sampled is not None
    rng = np.random.default_rng(seed)
    n_ticks = 6 * n_edges
    if spec.reads is not None:
        return _stress_answers(spec, spec.reads, rng, n_ticks)
    place = _restless(spec, rng, n_ticks)
    near = rng.choice([0, 0, 0, 1, cycles // 2], n_ticks)  # in the last clock of a tick, in others, and twice in one
    clock = np.cumsum(cycles + rng.choice([0, 0, 0, 0, 1, -1, cycles, -cycles // 2], n_ticks)) - 1 - near
    gone = (rng.random(n_ticks) < 0.02) | (np.repeat(rng.random(n_ticks // 20 + 1) < 0.05, 20)[:n_ticks])
    longest = spec.timing.max_ticks * cycles
    clock[n_ticks // 2 :] += longest + 3 * cycles  # all is forgotten
    clock = np.maximum.accumulate(np.maximum(clock, 1)) + 2 * np.arange(n_ticks)
    clock, place = clock[~gone], place[~gone]
    most = sampled.most_age(spec.tick.longest)
    late = np.clip(rng.integers(-3, 3, len(clock)) + most, 0, (1 << most.bit_length()) - 1)
    age = np.where(rng.random(len(clock)) < 0.03, late, rng.integers(0, max(cycles // 3, 1), len(clock)))
    right = (rng.random(len(clock)) > 0.02).astype(np.int64)
    lines = read_lines(sampled, place, age, right)
    at = np.stack([clock, clock + 1], axis=1).ravel()
    zero = {name: np.append(0, values) for name, values in lines.items()}
    none = np.zeros(len(at) + 1, dtype=np.uint8)
    return PinTrace.of_lines(np.append(0, at), int(at[-1]) + longest + 20 * cycles, {"a": none, "b": none} | zero)


def _restless(spec: TachometerSpec, rng: np.random.Generator, n_ticks: int) -> Ints:
    """Return the place of a shaft in each tick."""
    sampled = spec.encoder.sampled
    assert sampled is not None
    speeds = np.array([0, 0.3, 3, 100, sampled.most_moved / 3, 1.2 * spec.tick.max_count])
    speed = np.repeat(rng.choice(speeds, n_ticks // 30 + 1) * rng.choice([-1, 1], n_ticks // 30 + 1), 30)[:n_ticks]
    place = np.cumsum(speed + rng.normal(0, 1 + np.abs(speed) / 100)) + rng.integers(0, 1 << sampled.width)
    place += np.where(rng.random(n_ticks) < 0.01, rng.integers(-1 << 15, 1 << 15, n_ticks), 0)
    return np.floor(place).astype(np.int64)


def _stress_answers(spec: TachometerSpec, reads: Reads, rng: np.random.Generator, n_ticks: int) -> PinTrace:
    """Return the answers of an encoder, some late, wrong or missing, for longer than the maximum time as well."""
    n_clocks = n_ticks * spec.timing.tick_cycles
    sent = Answers(_restless(spec, rng, n_ticks) & (1 << reads.width) - 1, reads.delay, rng.integers(0, 3, n_ticks))
    gone = (rng.random(n_ticks) < 0.02) | (np.abs(np.arange(n_ticks) - n_ticks // 2) < spec.timing.max_ticks)
    wrong = np.where(rng.random(n_ticks) < 0.02, rng.integers(0, frames(reads, sent).shape[1], n_ticks), -1)
    sent = replace(sent, flip=wrong, error=rng.random(n_ticks) < 0.02, warning=rng.random(n_ticks) < 0.3, silent=gone)
    at, level = answer(reads, np.array(spec.read_starts(n_clocks)), sent)
    none = np.zeros(len(at), dtype=np.uint8)
    return PinTrace.of_lines(at, n_clocks, {"a": none, "b": none, reads.line: level})
