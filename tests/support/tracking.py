"""The program of the tracking method, executed in integers without bounds; and hostile counts for it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods.track import Windows
from tachometry.spec import TrackTachometer
from tachometry.spec.formats.tracking import LEVELS, STEP_BACK
from tachometry.spec.formats.tracking_code import NOT_TAKEN, TAKEN, Condition, Input, Instruction, Level, Op, Phase
from tachometry.spec.formats.tracking_program import TABLES, Program


@dataclass(frozen=True)
class Tick:
    """Holds the inputs that a tick brings to the program."""

    number: int = 0
    times: int = 0
    places: int = 0
    moved: int = 0
    length: int = 0
    beyond: bool = False
    quiet: bool = False

    @property
    def counted(self) -> bool:
        """There were counts."""
        return self.number > 0


class Executed(NamedTuple):
    """An instruction, the clocks of the program behind it, and what `ac` and `mq` are then; None: not defined."""

    instruction: Instruction
    clocks: int
    ac: int | None
    mq: int


# What finds 0 in ac.
CLEARING = (Op.LOAD, Op.LOAD_SIGNED, Op.MUL, Op.DIV, Op.INPUT)


class Interpreter:
    """Executes a program as `spec.formats.tracking_code` says, and asserts that all it computes fits its words.

    Parameters
    ----------
    program : Program
    """

    def __init__(self, program: Program) -> None:
        self.program = program
        self.memory = list(program.memory)
        self.ac = self.mq = self.x = self.level = 0
        self.flag = self.sign = False
        self.phase = Phase.REST
        self.widest = 0  # bits of the widest number so far

    def fitting(self, value: int, what: object) -> int:
        """Return the value, which fits a word."""
        width = (value if value >= 0 else ~value).bit_length() + 1
        self.widest = max(self.widest, width)
        assert width <= self.program.form.width, f"{what}: {value} has {width} bits, not {self.program.form.width}"
        return value

    def run(self, tick: Tick) -> list[Executed]:
        """Execute the whole program."""
        seen: list[Executed] = []
        place = clocks = 0
        code = self.program.instructions
        while not place or code[place - 1].op != Op.OUT:
            now = code[place]
            place += 1
            if now.op == Op.JUMP:
                taken = self._holds(Condition(now.steps), tick)
                if taken and code[place + 1].op in CLEARING:  # it was fetched
                    self.ac = None  # type: ignore[assignment]
                place = now.address if taken else place
                clocks += TAKEN if taken else NOT_TAKEN
            else:
                self.x = self.memory[now.address + (self.level if now.address >= TABLES else 0)]
                self._execute(now, tick)
                clocks += now.steps
            seen.append(Executed(now, clocks, self.ac, self.mq))
        return seen

    def _holds(self, condition: Condition, tick: Tick) -> bool:
        if condition == Condition.NEGATIVE:
            return self.ac < 0
        return {
            Condition.ALWAYS: True,
            Condition.FLAG: self.flag,
            Condition.COUNTED: tick.counted,
            Condition.BEYOND: tick.beyond,
            Condition.RESTS: self.phase == Phase.REST,
            Condition.BEGUN: self.phase == Phase.BEGUN,
            Condition.QUIET: tick.quiet,
        }[condition]

    def _input(self, which: int, tick: Tick) -> int:
        form = self.program.form
        if which in (Input.LENGTH, Input.LENGTH_SHIFTED):
            assert form.external
        value = {
            Input.TIMES: tick.times,
            Input.NUMBER: tick.number << form.mean_bits,
            Input.PLACES: tick.places << form.frac_bits >> 1,
            Input.MOVED: tick.moved << form.frac_bits,
            Input.LENGTH: tick.length,
            Input.LENGTH_SHIFTED: tick.length << form.gap_shift,
            Input.ZERO: 0,
        }[Input(which)]
        return self.fitting(value, Input(which))

    def _execute(self, now: Instruction, tick: Tick) -> None:
        x, op, steps = self.x, now.op, now.steps
        if op == Op.MUL:
            self._multiply(now, x)
        elif op == Op.DIV:
            self._divide(self.mq << (steps - self.program.form.width), x)
        elif op == Op.FRACTION:
            assert 0 <= self.ac < x, f"{now}: {self.ac} is not a fraction of {x}"
            assert not self.mq
            self._divide(self.ac << steps, x)
        elif op in (Op.STORE, Op.KEEP):
            self.memory[now.address] = self.ac
            self.sign = self.ac < 0 if op == Op.KEEP else self.sign
        elif op == Op.SIGN:
            self.sign = self.ac < 0
        elif op == Op.TO_MQ:
            self.mq = self.ac
        elif op in (Op.TEST, Op.TEST_AND, Op.TEST_OR):
            of_ac = self.ac >= 0
            self.flag = {Op.TEST: of_ac, Op.TEST_AND: self.flag and of_ac, Op.TEST_OR: self.flag or of_ac}[op]
        elif op == Op.LEVEL:
            back, following = max(self.level - STEP_BACK, 0), min(self.level + 1, LEVELS - 1)
            self.level = {Level.FIRST: 0, Level.BACK: back, Level.NEXT: following}[Level(now.address)]
        elif op == Op.PHASE:
            self.phase = Phase(now.address)
        elif op not in (Op.WAIT, Op.OUT):
            self.ac = self.fitting(self._sum(now, x, tick), now)

    def _sum(self, now: Instruction, x: int, tick: Tick) -> int:
        """Return what else is computed."""
        op, steps = now.op, now.steps
        if op in (Op.INPUT, Op.ADD_INPUT, Op.SUB_INPUT):
            value = self._input(now.address, tick)
            before = 0 if op == Op.INPUT else self.ac
            return before - value if op == Op.SUB_INPUT else before + value
        if op == Op.DOUBLE:
            assert 0 <= self.mq < 1 << (self.program.form.width - 1)
        if op in (Op.LOAD, Op.FROM_MQ):
            return x if op == Op.LOAD else self.mq
        if op == Op.LOAD_SIGNED:
            return -x if self.sign else x
        ac = self.ac  # the others read it
        return {
            Op.ADD: ac + x,
            Op.SUB: ac - x,
            Op.DOUBLE: ac << steps,
            Op.SHIFT: ac >> steps,
            Op.POSITIVE: max(ac, 0),
            Op.NEGATIVE: min(ac, 0),
        }[op]

    def _multiply(self, now: Instruction, x: int) -> None:
        steps = now.steps
        assert 0 <= self.mq < 1 << steps, f"{self.mq} has more than {steps} bits"
        for bits in range(1, steps):  # what the adder holds on the way
            self.fitting(x * (self.mq & ((1 << bits) - 1)) >> (bits - 1), f"on the way to a product, {now}")
        self.ac = self.fitting((x * self.mq + (1 << (steps - 1) >> 1)) >> (steps - 1), now)
        self.mq = 0

    def _divide(self, dividend: int, x: int) -> None:
        """The adder holds no more than ±x on the way; what it holds at the end is not defined."""
        assert x > 0
        assert dividend >= 0
        self.mq = self.fitting(dividend // x, "a quotient")
        self.ac = None  # type: ignore[assignment]


def hostile(spec: TrackTachometer, rng: np.random.Generator, n_ticks: int) -> tuple[Steps, NDArray[np.int64]]:
    """Return counts of random number, times and direction, and the last clock of every tick."""
    form = spec.form
    longest, shortest = (
        spec.times.longest_tick,
        spec.times.min_tick_cycles if form.external else spec.timing.tick_cycles,
    )
    most = form.max_count
    clocks: list[NDArray[np.int64]] = []
    steps: list[NDArray[np.int64]] = []
    last = np.empty(n_ticks, dtype=np.int64)
    now = silent = 0
    for i in range(n_ticks):
        length = int(rng.choice([shortest, longest, spec.timing.tick_cycles, int(rng.integers(shortest, longest + 1))]))
        if i % 40 == 0:  # how many counts a tick has for a while, which way, and when
            numbers = rng.choice([1, 2, most, most, most + 1, 3 * most, int(rng.integers(1, most + 2))], 3)
            ways = rng.choice(["+", "-", "random", "turn"])
            when = rng.choice(["first", "last", "random", "one clock apart"])
            rare = rng.choice([0, 0.1, 0.5, 0.9])
        number = 0 if silent or rng.random() < rare else min(int(rng.choice(numbers)), length)
        silent = max(silent - 1, 0)
        if rng.random() < 0.03:
            silent = int(rng.integers(1, spec.timing.max_ticks + 3))
        at = np.sort(rng.choice(length, number, replace=False))
        if when in ("first", "last"):
            at = np.arange(number) + (length - number if when == "last" else 0)
        elif when == "one clock apart":
            at = np.arange(number) + int(rng.integers(0, length - number + 1))
        step = rng.choice([-1, 1], number)
        if ways != "random":
            step = np.full(number, -1 if ways == "-" else 1)
            if ways == "turn":
                step[int(rng.integers(0, number + 1)) :] = -1
        clocks.append(now + at)
        steps.append(step)
        now += length
        last[i] = now - 1
    clock = np.concatenate(clocks).astype(np.int64)
    none = np.empty(0, dtype=np.int64)
    return Steps(clock, np.concatenate(steps).astype(np.int64), none, none, none), last


def ticks_of(spec: TrackTachometer, windows: Windows, core: Interpreter) -> Iterator[Tick]:
    """Yield these windows, as the front end of the program gives them; `core` runs each of them before the next."""
    most = spec.widths.max_count
    silent, before = spec.timing.max_ticks, Phase.REST
    for i, number in enumerate(windows.number):
        alone = silent > 0 or before != Phase.TRACKS or number > most
        before = core.phase  # it is known too late for the next tick
        yield Tick(
            number=min(number, 1) if alone else number,
            times=windows.last_time[i] if alone else windows.times[i],
            places=windows.last_place[i] if alone else windows.places[i],
            moved=max(-most, min(windows.moved[i], most)),
            length=windows.length[i],
            beyond=abs(windows.moved[i]) > most,
            quiet=silent + 1 >= spec.timing.max_ticks,
        )
        silent = 0 if number else silent + 1
