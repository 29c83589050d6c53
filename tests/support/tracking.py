"""Runs the program of the tracking method instruction by instruction, without gates; and motions for it."""

from collections import Counter

import numpy as np
from numpy.typing import NDArray
from reference.tracker import Tracker

from tachometry.sim.golden.front_end import Steps, decoded
from tachometry.sim.golden.methods.track import Windows
from tachometry.sim.golden.methods.track_recursion import Recursion, log2
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import TrackTachometer, of_texts
from tachometry.spec.formats.tracking import CHANCE_BITS, GAIN_STEPS, GAINS, LOG_BITS, PLACE_BITS, WIDTH
from tachometry.spec.formats.tracking_code import Program
from tachometry.spec.formats.tracking_instruction import Instruction, Jump, Left
from tachometry.spec.formats.tracking_schedule import to_next
from tachometry.spec.formats.tracking_units import Start


class OverflowOfWord(Exception):
    """A number has left its word."""


class Interpreter:
    """Executes the program of a spec tick by tick; the arithmetic of the unit is that of the golden model.

    - `words`: Words by name.
    - `met`: How often each instruction was executed.
    """

    def __init__(self, program: Program) -> None:
        self.program = program
        self.words = dict(program.words)
        self.met: Counter[int] = Counter()
        self._unit = Recursion(program.form, program.ahead)

    def tick(self, *row: int) -> tuple[int, ...]:
        """Take what `Windows.rows` yields."""
        number, times, places, last, moved, kind, down, end, length = row
        form = self.program.form
        t = form.time_bits
        if form.sampled:
            last, end = end, kind + 1 & 7
        inputs = {
            "number": number,
            "counts": number << PLACE_BITS,
            "places": places << (PLACE_BITS - 7),
            "times": times << t,
            "last": last << t,
            "moved": moved << form.moved_shift,
            "length": length << t,
        }
        chosen = {"o@last": kind, "o@up": end, "o@down": (end - 1) & 3}
        for j in range(3):
            chosen[f"o@m{j + 1}"] = (kind + j if down else kind - j) & 3 if number & 3 > j else -1
        unit, code = self._unit, self.program.code.instructions
        unit._chance = 1 << CHANCE_BITS - 1
        place, sum_, sign, by = self.program.code.labels["tick" if self.met else "reset"], 0, 1, 1
        shown = {"standstill": 0}
        unit_times, clock, results = self.program.times, 0, {0: 0}  # by the clock from which on they are read

        def name(word: str) -> str:
            return (f"o{chosen[word]}" if chosen[word] >= 0 else "zero") if word in chosen else word

        while True:
            one: Instruction = code[place]
            self.met[place] += 1
            place += 1
            if one.jump == Jump.END:
                return tuple(shown[name] for name in self.program.outputs)
            taken = {
                Jump.NEVER: False,
                Jump.ALWAYS: True,
                Jump.NEG: sum_ < 0,
                Jump.POS: sum_ >= 0,
                Jump.EMPTY: number == 0,
                Jump.ONE: number == 1,
            }[one.jump]
            selects = bool(one.store and one.jump)
            now, clock = clock, clock + (to_next(one) if taken else 1)
            if selects and not taken:
                continue
            place = self.program.code.labels[one.target] if taken and one.target else place
            terms = {"": 0, "~": results[max(at for at in results if at <= now)]} | {
                f"${word}": value for word, value in inputs.items()
            }
            terms |= {word: self.words[name(word)] for word in one.reads}
            first, operand = terms[one.first], terms[one.word]
            left = {Left.ZERO: first, Left.SUM: sum_, Left.LEAST: min(sum_, 0), Left.MOST: max(sum_, 0)}[one.left]
            minus = one.subtract != (one.by_sign and sign < 0)
            before, sum_ = sum_, left - operand if minus else left + operand
            if not -(1 << (WIDTH - 1)) <= sum_ < 1 << (WIDTH - 1):
                raise OverflowOfWord(f"{one} in {self.program.form}")
            if one.keep:
                sign = -1 if sum_ < 0 else 1
            if one.store:
                self.words[name(one.store)] = sum_
            if selects:
                sum_ = before
            if one.output:
                shown[one.output] = int(sum_ >= 0) if one.output == "standstill" else sum_
            ready = now + (unit_times.of(one.start) if unit_times.ports > 1 else 1)
            assert one.start in (Start.NONE, Start.BY, Start.CHANCE) or ready not in results
            if one.start == Start.BY:
                by = sum_
            elif one.start == Start.CHANCE:
                unit._chance = int(f"{sum_ & (1 << CHANCE_BITS) - 1:0{CHANCE_BITS}b}"[::-1], 2)
            elif one.start:
                results[ready] = self.result(one, sum_, by)

    def result(self, one: Instruction, operand: int, by: int) -> int:
        """Return what an operation of the unit makes of an operand; `by` is the factor."""
        form = self.program.form
        match one.start:
            case Start.LOG:
                return log2(operand)
            case Start.EXP:
                return self._unit._power(operand, 1)
            case Start.OVER:
                shift = max(by.bit_length() - (form.factor_bits - CHANCE_BITS), 0) if one.how == "by" else int(one.how)
                return self._unit._round(operand, shift)
            case Start.GAIN:
                at = ((~operand * GAIN_STEPS) >> LOG_BITS) - 2 * GAIN_STEPS
                return form.gains[int(one.how)][max(0, min(GAINS - 1, at))]
        return self._unit._product(operand, by, one.how)


def core(**options: str) -> TrackTachometer:
    """Return a core of these options; an underscore in a name stands for a dash."""
    spec = of_texts("track", {"ppr": "500"} | {name.replace("_", "-"): text for name, text in options.items()})
    assert isinstance(spec, TrackTachometer)
    return spec


MOTIONS = ("even", "even", "lost", "twins", "shifted", "rest", "dither", "burst", "random")


def motions(spec: TrackTachometer, rng: np.random.Generator, n_ticks: int) -> tuple[Steps, NDArray[np.int64]]:
    """Return counts of motions of all kinds, one after the other, and the last clock of every tick.

    Speeds are constant or change evenly, up to the greatest and beyond, on a disc with errors; counts are lost or
    added; there are rests, some longer than the maximum time, dither, bursts, and counts without any order.
    """
    form, times = spec.form, spec.times
    lengths = np.full(n_ticks, form.tick_cycles)
    if form.external:
        shortest = max(times.min_tick_cycles, form.longest_tick // 16)  # so few motions depend on the program's clocks
        lengths = rng.integers(shortest, form.longest_tick + 1, n_ticks)
    last = np.cumsum(lengths) - 1
    tick, most = form.tick_cycles, min(form.max_count / form.tick_cycles, 1 / 4)
    clocks, steps, now = [np.empty(0)], [np.empty(0)], 0
    forget = (form.constants["forget"] >> form.time_bits) + 2 * form.longest_tick
    while now < last[-1]:
        duration = tick * int(rng.choice([3, 20, 60, 600]))
        kind, way = rng.choice(MOTIONS), rng.choice([-1, 1])
        speed = most * 10 ** rng.uniform(-4, 0.05)
        if kind in ("even", "lost", "twins", "shifted"):
            slope = speed / duration * rng.choice([-0.9, 0, 0, 0, 0.5, 3])
            way_at = np.cumsum(speed + slope * np.arange(0, duration, 8)) * 8  # an integral is enough
            at = np.interp(np.arange(1, int(way_at[-1]) + 1), way_at, np.arange(0, duration, 8))
            at += rng.normal(0, rng.choice([0, 0.02, 0.2]), len(at)) / speed
            step = np.full(len(at), way)
            if kind == "shifted":  # all edges of the second half, by half a count
                at[len(at) // 2 :] += 1 / (2 * speed)
            elif kind == "lost":
                first = int(rng.integers(len(at) + 1))
                kept = np.r_[:first, min(first + int(rng.integers(1, 6)), len(at)) : len(at)]
                at, step = at[kept], step[kept]
            elif kind == "twins":  # one clock apart, in two ticks
                border = last[np.searchsorted(last, min(now + duration // 2, last[-1]))] - now
                at, step = np.append(at, border + np.arange(2)), np.append(step, [way, way])
        elif kind == "rest":
            at, step = np.empty(0), np.empty(0)
            if now > last[-1] // 4 and forget < last[-1] // 2:
                duration, forget = forget, 2 * int(last[-1])  # once
        elif kind == "burst":
            at = int(rng.integers(tick)) + np.arange(0.0, min(int(rng.integers(1, 3 * form.most_number)), tick))
            step = np.full(len(at), way)
        else:
            at = np.cumsum(rng.exponential(1 / speed, min(int(speed * duration) + 1, 1000)))
            step = np.resize([way, -way], len(at)) if kind == "dither" else rng.choice([-1, 1], len(at))
        clocks.append(now + at[at < duration])
        steps.append(step[at < duration])
        now += duration
    clock, which = np.unique(np.concatenate(clocks).astype(np.int64), return_index=True)
    kept = (clock >= 0) & (clock <= last[-1])
    none = np.empty(0, dtype=np.int64)
    return Steps(clock[kept], np.concatenate(steps)[which][kept].astype(np.int64), none, none, none), last


def windows(spec: TrackTachometer, seed: int, n_ticks: int) -> Windows:
    """Return what the ticks of such motions hold."""
    return Windows.of(*motions(spec, np.random.default_rng(seed), n_ticks), spec.form.most_number)


def in_float(spec: TrackTachometer, trace: PinTrace, updates: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the velocities in rad/s that the independent model shows for the updates in these clocks."""
    form, steps = spec.form, decoded(spec, trace)
    memory, forget, longest = (form.constants[name] >> form.time_bits for name in ("most_memory", "forget", "max_time"))
    model = Tracker(memory, forget, longest, spec.program.ahead)
    ends = updates - spec.latency.datapath
    counted = steps.step != 0
    clocks, ways = steps.clock[counted], steps.step[counted]
    places = np.searchsorted(clocks, np.append(-1, ends), side="right").tolist()
    counts = list(zip(clocks.tolist(), ways.tolist(), strict=True))
    shown = [
        model.tick(end, counts[first:until])
        for end, first, until in zip(ends.tolist(), places, places[1:], strict=False)
    ]
    return np.array(shown) * (2 * np.pi / spec.encoder.counts_per_rev * spec.timing.clock_hz)
