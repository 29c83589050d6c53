"""The program of the tracking datapath: what its one adder does from a tick to the update.

A word of the memory is x. `ac` is the accumulator, `mq` holds multipliers, dividends and quotients, `sign` the sign
that `KEEP` has found, `flag` a condition. Every path through the program takes the same number of clocks: `Choice` pads
the shorter of two.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction
from functools import cached_property

from tachometry.spec.formats.tracking import LEVELS, Tracking

MAX_STEPS = 127
STATES = 16  # words that change; the constants follow
TABLES = 64  # where tables begin that have a word for each level


class Op(IntEnum):
    """Operations of the datapath."""

    LOAD = 0  # ac = x
    ADD = 1  # ac = ac + x
    SUB = 2  # ac = ac − x
    LOAD_SIGNED = 3  # ac = −x if `sign`, else x
    STORE = 4  # x = ac
    KEEP = 5  # x = ac, sign = ac < 0
    SIGN = 23  # sign = ac < 0
    DOUBLE = 24  # ac = ac << steps, for mq without its leading bit
    MUL = 6  # ac = x·mq / 2^(steps − 1), rounded, with the low bits of mq
    DIV = 7  # mq = ⌊mq·2^(steps − W) / x⌋
    FRACTION = 8  # mq = ⌊ac·2^steps / x⌋, for ac < x and mq without leading bits
    SHIFT = 9  # ac = ac >> steps
    TO_MQ = 10  # mq = ac
    FROM_MQ = 11  # ac = mq
    INPUT = 12  # ac = an input
    ADD_INPUT = 25  # ac = ac + an input
    SUB_INPUT = 26  # ac = ac − an input
    POSITIVE = 13  # ac = max(ac, 0)
    NEGATIVE = 14  # ac = min(ac, 0)
    TEST = 15  # flag = ac ≥ 0
    TEST_AND = 16  # flag = flag and ac ≥ 0
    TEST_OR = 17  # flag = flag or ac ≥ 0
    JUMP = 18  # to the address, if a condition holds
    LEVEL = 19  # changes the level of λ
    PHASE = 20  # what the recursion has seen: nothing, a count, a speed
    OUT = 21  # an update: velocity in mq, acceleration in ac, p in x
    WAIT = 22


class Input(IntEnum):
    """What `INPUT` loads."""

    TIMES = 0  # Σ of the times from the counts of the tick to its end, clocks
    NUMBER = 1  # n, of these counts, shifted left by the bits of a mean
    PLACES = 2  # Σ of their places relative to the end of the tick, counts
    MOVED = 3  # counts of the tick, forward less backward
    LENGTH = 4  # clocks of the tick
    LENGTH_SHIFTED = 5  # the same, shifted left as `gap_shifted` is
    ZERO = 7


class Condition(IntEnum):
    """When `JUMP` jumps."""

    ALWAYS = 0
    NEGATIVE = 1  # ac < 0
    FLAG = 2
    COUNTED = 3  # the tick has counts
    BEYOND = 4  # more than the greatest speed has
    RESTS = 5  # phase is rest
    BEGUN = 6  # phase is one count
    QUIET = 7  # no count for the maximum time


class Level(IntEnum):
    """What `LEVEL` does."""

    FIRST = 0
    BACK = 1  # STEP_BACK levels, not beyond the first
    NEXT = 2  # not beyond the last


class Phase(IntEnum):
    """What the recursion knows."""

    REST = 0
    BEGUN = 1
    TRACKS = 2


@dataclass(frozen=True)
class Do:
    """An instruction: an operation, the name of a word or a number for its address field, and its clocks."""

    op: Op
    word: str | int = 0
    steps: int = 1


@dataclass(frozen=True)
class Choice:
    """Two ways, one of which is gone; both take the same time."""

    condition: Condition
    then: "Sequence[Step]"
    otherwise: "Sequence[Step]" = ()


Step = Do | Choice

_ZERO = Do(Op.INPUT, Input.ZERO)  # ac = 0


def _doubled(bits: int) -> list[Step]:
    """ac = ac << bits, for mq without its leading bit."""
    return [Do(Op.DOUBLE, steps=bits)] if bits else []


@dataclass(frozen=True)
class Instruction:
    """An instruction as the datapath reads it."""

    op: Op
    address: int
    steps: int


@dataclass(frozen=True)
class Program:
    """The program and the constants of a tracking recursion.

    Parameters
    ----------
    form : Tracking
    acceleration_factor : Fraction
        LSBs of the output in one of a.
    delay : int
        Clocks from an edge to the port, less those of the program: the velocity is that of the clock in which it is
        shown.
    """

    form: Tracking
    acceleration_factor: Fraction
    delay: int

    @property
    def lead(self) -> int:
        """Clocks by which the shown velocity is ahead of the tick."""
        return min(self.delay + self.clocks, (2 << self.form.unit_bits) - 1)

    @cached_property
    def acceleration_scale(self) -> tuple[int, int]:
        """What a is multiplied by for the output, and the right shift after it."""
        shift = self.form.width - 2
        while round(self.acceleration_factor * (1 << shift)) >> shift:
            shift -= 1
        return round(self.acceleration_factor * (1 << shift)), shift

    @property
    def velocity_shift(self) -> int:
        """Right shift of v·T for the output."""
        return self.form.unit_bits + self.form.frac_bits - self.form.velocity_bits

    @cached_property
    def constants(self) -> dict[str, int]:
        """Constants by name."""
        form, one = self.form, self.form.fixed(1)
        return {
            "length": form.tick_cycles,
            "length_shifted": form.tick_cycles << form.gap_shift,
            "several": 2 << form.mean_bits,
            "one": one,
            "three": 3 * one,
            "three_quarters": 3 * one >> 2,
            "lsb": 1,
            "most_v": form.max_velocity,
            "most_a": form.max_acceleration,
            "lost": form.fixed(form.max_error),
            "error": form.fixed(form.edge_error),
            "errors": form.fixed(2 * form.edge_error),
            "some_error": form.fixed(form.edge_error / 4),
            "mean_limit": form.mean_threshold,
            "late": form.late_limit,
            "rate0": form.rates[0],
            "agile_rate": form.agile_rate,
            "most_x0": form.most_x[0],
            "least_gap": form.least_gap,
            "coarse_v": form.max_velocity >> form.start_bits,
            "acceleration": self.acceleration_scale[0],
            "lead": self.lead,
        }

    @property
    def tables(self) -> dict[str, tuple[int, ...]]:
        """Constants that depend on the level."""
        if not self.form.growing:
            return {}
        return {"rate": self.form.rates, "most_x": self.form.most_x, "span": self.form.spans}

    def address(self, word: str | int) -> int:
        """The address of a word."""
        if isinstance(word, int):
            return word
        states = ("p v a h gap gap_shifted mean before age e d r e1 e2 t x".split()).index
        if word in self.constants:
            return STATES + list(self.constants).index(word)
        if word in self.tables:
            return TABLES + LEVELS * list(self.tables).index(word)
        return states(word)

    @property
    def memory(self) -> list[int]:
        """First contents of the memory, constants included."""
        words = [0] * STATES + list(self.constants.values())
        for table in self.tables.values():
            words += [0] * (TABLES - len(words)) + list(table)
        return words

    def _times(self, factor: str, word: str, bits: int) -> list[Step]:
        """ac = word·factor/2^bits."""
        return [Do(Op.LOAD, factor), Do(Op.TO_MQ), Do(Op.MUL, word, bits + 1)]

    @property
    def _length(self) -> list[Step]:
        """ac = mq = clocks of this tick."""
        return [Do(Op.INPUT, Input.LENGTH) if self.form.external else Do(Op.LOAD, "length"), Do(Op.TO_MQ)]

    @staticmethod
    def _within(most: str) -> list[Step]:
        """ac = ac, held within ±most."""
        return [
            *(Do(Op.KEEP, "t"), Do(Op.LOAD_SIGNED, "t"), Do(Op.SUB, most), Do(Op.NEGATIVE), Do(Op.ADD, most)),
            *(Do(Op.STORE, "t"), Do(Op.LOAD_SIGNED, "t")),
        ]

    @property
    def _predict(self) -> list[Step]:
        """p ← p + v·L + a·L²/2, v ← v + a·L; the gap grows by L."""
        k = self.form.unit_bits
        length = Do(Op.ADD_INPUT, Input.LENGTH_SHIFTED) if self.form.external else Do(Op.ADD, "length_shifted")
        return [
            *(Do(Op.LOAD, "gap_shifted"), length, Do(Op.STORE, "gap_shifted")),
            *(*self._length, Do(Op.ADD, "gap"), Do(Op.STORE, "gap")),
            *(Do(Op.MUL, "a", k + 1 + self.form.extra_bits), Do(Op.STORE, "h")),
            *(Do(Op.SHIFT, steps=1), Do(Op.ADD, "v"), Do(Op.STORE, "t"), *self._length),
            *(Do(Op.MUL, "t", k + 1), Do(Op.ADD, "p"), Do(Op.STORE, "p")),
            *(Do(Op.LOAD, "v"), Do(Op.ADD, "h"), Do(Op.STORE, "v")),
        ]

    @property
    def _anew(self) -> list[Step]:
        """What is known of the errors is forgotten."""
        stores = [Do(Op.STORE, word) for word in ("gap", "gap_shifted", "mean", "before", "age")]
        return [_ZERO, *stores, Do(Op.LEVEL, Level.FIRST)]

    @property
    def _rest(self) -> list[Step]:
        """The shaft stands, in the middle between two counts."""
        return [*self._anew, *(Do(Op.STORE, word) for word in "pva"), Do(Op.PHASE, Phase.REST)]

    @property
    def _beyond(self) -> list[Step]:
        """The greatest speed, in the direction of the counts."""
        return [
            *self._anew,
            *(Do(Op.STORE, "p"), Do(Op.STORE, "a")),
            *(Do(Op.INPUT, Input.MOVED), Do(Op.SIGN)),
            *(Do(Op.LOAD_SIGNED, "most_v"), Do(Op.STORE, "v")),
            Do(Op.PHASE, Phase.TRACKS),
        ]

    @property
    def _first(self) -> list[Step]:
        """The first count: p is its place, and its time is kept.

        In the tick behind an error that was too large, several may have been added up. There is no first one, then.
        """
        first: list[Step] = [
            *(*self._anew, Do(Op.STORE, "v"), Do(Op.STORE, "a")),
            *(Do(Op.INPUT, Input.PLACES), Do(Op.STORE, "p")),
            *(Do(Op.INPUT, Input.TIMES), Do(Op.STORE, "gap")),
            Do(Op.PHASE, Phase.BEGUN),
        ]
        several = [Do(Op.INPUT, Input.NUMBER), Do(Op.SUB, "several")]
        return [*several, Choice(Condition.NEGATIVE, first, self._rest)]

    @property
    def _second(self) -> list[Step]:
        """The second count: v is the distance over the time, and p its place, moved on by v."""
        form = self.form
        return [
            *(Do(Op.LOAD, "gap"), Do(Op.SUB_INPUT, Input.TIMES)),
            *(Do(Op.SUB, "least_gap"), Do(Op.POSITIVE), Do(Op.ADD, "least_gap"), Do(Op.STORE, "r")),
            *(Do(Op.INPUT, Input.PLACES), Do(Op.STORE, "x"), Do(Op.SUB, "p"), Do(Op.KEEP, "e")),
            *(Do(Op.LOAD_SIGNED, "e"), Do(Op.TO_MQ), Do(Op.DIV, "r", form.width + form.unit_bits - form.start_bits)),
            *(Do(Op.FROM_MQ), Do(Op.SUB, "coarse_v"), Do(Op.NEGATIVE), Do(Op.ADD, "coarse_v")),
            *_doubled(form.start_bits),
            *(Do(Op.STORE, "t"), Do(Op.LOAD_SIGNED, "t"), Do(Op.STORE, "v")),
            *(*self._moved_by_v, Do(Op.ADD, "x"), Do(Op.STORE, "p")),
            *(*self._anew, Do(Op.STORE, "a"), Do(Op.PHASE, Phase.TRACKS)),
        ]

    def _shifted(self, word: str, bits: int) -> list[Step]:
        """t = word << bits."""
        return [_ZERO, Do(Op.TO_MQ), Do(Op.LOAD, word), *_doubled(bits), Do(Op.STORE, "t")]

    @property
    def _moved_by_v(self) -> list[Step]:
        """ac = v·Στ."""
        shift = max(self.form.unit_bits, self.form.times_bits - 1)  # of a product in which all bits of Στ count
        finer = self._shifted("v", shift - self.form.unit_bits)
        return [*finer, Do(Op.INPUT, Input.TIMES), Do(Op.TO_MQ), Do(Op.MUL, "t", shift + 1)]

    @property
    def _error(self) -> list[Step]:
        """e: the mean distance of the counts of the tick from where they were expected."""
        return [
            *(Do(Op.INPUT, Input.NUMBER), Do(Op.STORE, "r")),
            *(*self._moved_by_v, Do(Op.ADD_INPUT, Input.PLACES), Do(Op.KEEP, "t"), _ZERO, Do(Op.TO_MQ)),
            *(Do(Op.LOAD_SIGNED, "t"), Do(Op.FRACTION, "r", self.form.mean_bits), Do(Op.FROM_MQ), Do(Op.STORE, "t")),
            *(Do(Op.LOAD_SIGNED, "t"), Do(Op.SUB, "p"), Do(Op.KEEP, "e")),
        ]

    @property
    def _is_agile(self) -> list[Step]:
        """flag = |e| > 2·E, or |e| > E and the error before, of the same sign, is greater than E/4."""
        if not self.form.agile:
            return [_ZERO, Do(Op.SUB, "lsb"), Do(Op.TEST)]
        return [
            *(Do(Op.LOAD_SIGNED, "e"), Do(Op.SUB, "error"), Do(Op.TEST)),
            *(Do(Op.LOAD_SIGNED, "before"), Do(Op.SUB, "some_error"), Do(Op.TEST_AND)),
            *(Do(Op.LOAD_SIGNED, "e"), Do(Op.SUB, "errors"), Do(Op.TEST_OR)),
            *(Do(Op.LOAD, "e"), Do(Op.STORE, "before")),
        ]

    def _reach(self, rate: str, most: str) -> list[Step]:
        """ac = x = min(λ·m·T_s, most)."""
        least = [Do(Op.SUB, most), Do(Op.NEGATIVE), Do(Op.ADD, most)]
        return [*self._times("gap", rate, self.form.gap_bits - 1), *least]

    @property
    def _remember(self) -> list[Step]:
        """The mean error, and from it the level of λ: `flag` is still whether the error is large."""
        f = self.form.frac_bits
        trouble: list[Step] = [Do(Op.LOAD, "mean"), Do(Op.SHIFT, steps=1), Do(Op.STORE, "mean"), _ZERO]
        return [
            *(
                *self._reach("rate", "most_x"),
                Do(Op.SHIFT, steps=2),
                Do(Op.STORE, "h"),
                Do(Op.LOAD, "e"),
                Do(Op.SUB, "mean"),
                Do(Op.STORE, "t"),
            ),
            *(*self._times("h", "t", f), Do(Op.ADD, "mean"), Do(Op.KEEP, "mean")),
            *(Do(Op.LOAD_SIGNED, "mean"), Do(Op.SUB, "one"), Do(Op.NEGATIVE), Do(Op.ADD, "one"), Do(Op.STORE, "t")),
            *(Do(Op.TO_MQ), Do(Op.MUL, "t", f + 1), Do(Op.STORE, "t")),
            *(*self._times("mean_limit", "h", self.form.mean_threshold_bits), Do(Op.STORE, "h")),
            *(Do(Op.LOAD, "age"), Do(Op.ADD, "gap"), Do(Op.STORE, "age")),
            Choice(
                Condition.FLAG,
                [_ZERO, Do(Op.STORE, "age"), Do(Op.LEVEL, Level.FIRST)],
                [
                    *(Do(Op.LOAD, "h"), Do(Op.SUB, "t")),
                    Choice(
                        Condition.NEGATIVE,
                        [*trouble, Do(Op.STORE, "age"), Do(Op.LEVEL, Level.BACK)],
                        [
                            *(Do(Op.LOAD, "age"), Do(Op.SUB, "span")),
                            Choice(
                                Condition.NEGATIVE,
                                [],
                                [_ZERO, Do(Op.STORE, "age"), Do(Op.LEVEL, Level.NEXT)],
                            ),
                        ],
                    ),
                ],
            ),
        ]

    @property
    def _gains(self) -> list[Step]:
        """d = 1 − e^−x = x/(1 + x/2 + x²/12) = 3x/((x + 3)²/4 + 3/4), and r = d·U/gap."""
        form = self.form
        usual = self._reach("rate", "most_x") if form.growing else self._reach("rate0", "most_x0")
        reach: list[Step] = usual
        if form.agile:
            reach = [Choice(Condition.FLAG, self._reach("agile_rate", "most_x0"), usual)]
        return [
            *(*reach, Do(Op.STORE, "x"), Do(Op.ADD, "three"), Do(Op.STORE, "t"), Do(Op.TO_MQ)),
            *(
                Do(Op.MUL, "t", form.frac_bits + 3),
                Do(Op.ADD, "three_quarters"),
                Do(Op.STORE, "t"),
                _ZERO,
                Do(Op.TO_MQ),
            ),
            *(Do(Op.LOAD, "x"), *[Do(Op.ADD, "x")] * 2, Do(Op.FRACTION, "t", form.gain_bits)),
            *(Do(Op.FROM_MQ), Do(Op.STORE, "d"), _ZERO, Do(Op.TO_MQ), Do(Op.LOAD, "d")),
            *(Do(Op.FRACTION, "gap_shifted", form.unit_bits + form.gap_shift), Do(Op.FROM_MQ), Do(Op.STORE, "r")),
        ]

    @property
    def _correct(self) -> list[Step]:
        """p, v and a, with the gains of the time since the counts before."""
        b = self.form.gain_bits
        return [
            *(*self._times("d", "e", b), Do(Op.STORE, "e1")),
            *(*self._times("d", "e1", b), Do(Op.STORE, "e2")),
            *(*self._times("d", "e2", b), *[Do(Op.ADD, "e1")] * 3, *[Do(Op.SUB, "e2")] * 3),
            *(Do(Op.ADD, "p"), Do(Op.STORE, "p")),
            # All bits of r have left mq.
            *(*self._times("r", "e1", b), Do(Op.STORE, "h"), *_doubled(self.form.extra_bits), Do(Op.STORE, "t")),
            *(*self._times("r", "t", b), Do(Op.ADD, "a"), Do(Op.STORE, "a")),
            *(*self._times("d", "h", b), Do(Op.STORE, "t"), Do(Op.SHIFT, steps=1), Do(Op.ADD, "t"), Do(Op.STORE, "t")),
            *(Do(Op.LOAD, "v"), *[Do(Op.ADD, "h")] * 3, Do(Op.SUB, "t"), Do(Op.STORE, "v")),
            *(_ZERO, Do(Op.STORE, "gap"), Do(Op.STORE, "gap_shifted")),
        ]

    @property
    def _counted(self) -> list[Step]:
        """A tick with counts."""
        moved: list[Step] = [Do(Op.LOAD, "p"), Do(Op.SUB_INPUT, Input.MOVED), Do(Op.STORE, "p")]
        tracks: list[Step] = [
            *(*self._error, Do(Op.LOAD_SIGNED, "e"), Do(Op.SUB, "lost")),
            Choice(
                Condition.NEGATIVE,
                [
                    *(*self._is_agile, *(self._remember if self.form.growing else [])),
                    *(*self._gains, *self._correct),
                ],
                self._rest,
            ),
        ]
        known: list[Step] = [*moved, Choice(Condition.BEGUN, self._second, tracks)]
        return [Choice(Condition.BEYOND, self._beyond, [Choice(Condition.RESTS, self._first, known)])]

    @property
    def _late(self) -> list[Step]:
        """No count: p stays near the position; if v leads beyond it, v falls, and a no longer adds to it."""
        form = self.form
        fall: list[Step] = [
            *(Do(Op.STORE, "t"), *self._length, Do(Op.MUL, "t", form.unit_bits + 1), Do(Op.STORE, "r")),
            *(Do(Op.ADD, "r"), Do(Op.ADD, "one"), Do(Op.STORE, "r")),
            *(Do(Op.LOAD, "t"), Do(Op.TO_MQ), Do(Op.DIV, "r", form.width + form.frac_bits)),
            *(Do(Op.FROM_MQ), Do(Op.STORE, "t"), Do(Op.LOAD_SIGNED, "t"), Do(Op.STORE, "v")),
            *(Do(Op.LOAD_SIGNED, "a"), Do(Op.NEGATIVE), Do(Op.STORE, "t"), Do(Op.LOAD_SIGNED, "t"), Do(Op.STORE, "a")),
        ]
        return [
            *(Do(Op.LOAD, "p"), Do(Op.SIGN), Do(Op.LOAD_SIGNED, "p"), Do(Op.SUB, "late")),
            Choice(
                Condition.NEGATIVE,
                [],
                [
                    *(Do(Op.LOAD_SIGNED, "late"), Do(Op.STORE, "p"), Do(Op.LOAD_SIGNED, "v")),
                    Choice(Condition.NEGATIVE, [], fall),
                ],
            ),
        ]

    @property
    def _show(self) -> list[Step]:
        """The outputs, rounded."""
        return [
            *(*self._times("lead", "a", self.form.unit_bits + self.form.extra_bits), Do(Op.ADD, "v")),
            *(*self._within("most_v"), Do(Op.STORE, "x")),
            *(*self._times("length", "x", self.velocity_shift), Do(Op.STORE, "t")),
            *(*self._times("acceleration", "a", self.acceleration_scale[1]), Do(Op.STORE, "x")),
            *(Do(Op.LOAD, "t"), Do(Op.TO_MQ), Do(Op.LOAD, "x"), Do(Op.OUT, "p")),
        ]

    @cached_property
    def steps(self) -> list[Step]:
        """The whole program."""
        silent: list[Step] = [Choice(Condition.QUIET, self._rest, self._late)]
        return [
            *self._predict,
            Choice(Condition.COUNTED, self._counted, silent),
            *(Do(Op.LOAD, "v"), *self._within("most_v"), Do(Op.STORE, "v")),
            *(Do(Op.LOAD, "a"), *self._within("most_a"), Do(Op.STORE, "a")),
            *self._show,
        ]

    @cached_property
    def instructions(self) -> tuple[Instruction, ...]:
        """The program as the datapath reads it; it ends with `OUT`."""
        return tuple(_assembled(self, self.steps, 0))

    @cached_property
    def clocks(self) -> int:
        """Clocks of the program, whatever it meets."""
        return _clocks(self.steps)


# A jump that is taken costs two clocks more: what was fetched behind it is not used.
NOT_TAKEN, TAKEN = 1, 3
_READS = (Op.LOAD, Op.ADD, Op.SUB, Op.LOAD_SIGNED, Op.MUL, Op.DIV, Op.FRACTION, Op.OUT)
_CHANGES = (Op.STORE, Op.KEEP, Op.LEVEL)


def _spaced(steps: Sequence[Step]) -> list[Step]:
    """The steps, with a wait where one would read a word before it is written, or while another one is.

    A word is read two steps before its use. So none is read two steps behind a change, nor what the last step changed.
    """
    spaced: list[Step] = []

    def changes(back: int) -> Do | None:
        step = spaced[-back] if len(spaced) >= back else None
        return step if isinstance(step, Do) and step.op in _CHANGES else None

    for step in steps:
        if isinstance(step, Choice):
            if changes(1):  # what is read behind the jump
                spaced.append(Do(Op.WAIT))
        elif step.op in _READS:
            last = changes(1)
            if last and (last.op == Op.LEVEL or last.word == step.word):
                spaced += [Do(Op.WAIT)] * 2
            elif changes(2):
                spaced.append(Do(Op.WAIT))
        spaced.append(step)
    return spaced


def _clocks(steps: Sequence[Step]) -> int:
    """Clocks of some steps."""
    return sum(
        step.steps if isinstance(step, Do) else NOT_TAKEN + sum(_ways(step)[0]) + TAKEN for step in _spaced(steps)
    )


def _ways(choice: Choice) -> tuple[tuple[int, int], tuple[int, int]]:
    """Clocks of `otherwise` and of `then`, each with those that have to be waited behind it."""
    otherwise, then = _clocks(choice.otherwise), _clocks(choice.then)
    # What follows may read what `then` has written last, so there are two waits between.
    both = max(NOT_TAKEN + otherwise + TAKEN, TAKEN + then + 2)
    return (otherwise, both - NOT_TAKEN - otherwise - TAKEN), (then, both - TAKEN - then)


def _assembled(program: Program, steps: Sequence[Step], begin: int) -> list[Instruction]:
    """Instructions of some steps, the first of which has address `begin`."""
    code: list[Instruction] = []

    def wait(clocks: int) -> None:
        while clocks:
            now = min(clocks, MAX_STEPS)
            code.append(Instruction(Op.WAIT, 0, now))
            clocks -= now

    for step in _spaced(steps):
        if isinstance(step, Do):
            code.append(Instruction(step.op, program.address(step.word), step.steps))
            continue
        (_, wait_otherwise), (_, wait_then) = _ways(step)
        jump = len(code)
        code.append(Instruction(Op.JUMP, 0, step.condition))
        code += _assembled(program, step.otherwise, begin + len(code))
        wait(wait_otherwise)
        over = len(code)
        code.append(Instruction(Op.JUMP, 0, Condition.ALWAYS))
        code[jump] = Instruction(Op.JUMP, begin + len(code), step.condition)
        code += _assembled(program, step.then, begin + len(code))
        wait(1)
        wait(wait_then - 1)
        code[over] = Instruction(Op.JUMP, begin + len(code), Condition.ALWAYS)
    return code
