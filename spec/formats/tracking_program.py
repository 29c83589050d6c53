"""The program of the tracking datapath: what its one adder does from a tick to the update.

Every path through it takes the same number of clocks.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from tachometry.spec.formats.tracking import LEVELS, Tracking
from tachometry.spec.formats.tracking_code import (
    Choice,
    Condition,
    Do,
    Input,
    Instruction,
    Level,
    Op,
    Phase,
    Step,
    assembled,
    clocks,
)

STATES = 16  # words that change; the constants follow
TABLES = 64  # where tables begin that have a word for each level

_ZERO = Do(Op.INPUT, Input.ZERO)  # ac = 0


def _doubled(bits: int) -> list[Step]:
    """Return ac = ac << bits, for mq without its leading bit."""
    return [Do(Op.DOUBLE, steps=bits)] if bits else []


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
        """The factor of a for the output, and the right shift after it."""
        shift = self.form.width - 2  # the factor is less than 1/12, as a is off by more than 1.5 of its LSB
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
        """Return the address of a word."""
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
        """Return ac = word·factor/2^bits."""
        return [Do(Op.LOAD, factor), Do(Op.TO_MQ), Do(Op.MUL, word, bits + 1)]

    @property
    def _length(self) -> list[Step]:
        """ac = mq = clocks of this tick."""
        return [Do(Op.INPUT, Input.LENGTH) if self.form.external else Do(Op.LOAD, "length"), Do(Op.TO_MQ)]

    @staticmethod
    def _within(most: str) -> list[Step]:
        """Return ac = ac, held within ±most."""
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
        """Instructions that forget what is known of the errors."""
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
        """Return t = word << bits."""
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
        """Return ac = x = min(λ·m·T_s, most)."""
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
        steps = form.unit_bits + form.gap_shift - form.ratio_range
        usual = self._reach("rate", "most_x") if form.growing else self._reach("rate0", "most_x0")
        reach: list[Step] = usual
        if form.agile:
            reach = [Choice(Condition.FLAG, self._reach("agile_rate", "most_x0"), usual)]
        return [
            *(*reach, Do(Op.STORE, "x"), Do(Op.ADD, "three"), Do(Op.STORE, "t"), Do(Op.TO_MQ)),
            *(Do(Op.MUL, "t", form.frac_bits + 3), Do(Op.ADD, "three_quarters"), Do(Op.STORE, "t")),
            *(_ZERO, Do(Op.TO_MQ), Do(Op.LOAD, "x"), *[Do(Op.ADD, "x")] * 2, Do(Op.FRACTION, "t", form.gain_bits)),
            *(Do(Op.FROM_MQ), Do(Op.STORE, "d"), _ZERO, Do(Op.TO_MQ), Do(Op.LOAD, "d")),
            *(Do(Op.FRACTION, "gap_shifted", steps), Do(Op.FROM_MQ), Do(Op.STORE, "r")),
        ]

    @property
    def _correct(self) -> list[Step]:
        """p, v and a, with the gains of the time since the counts before."""
        b, more = self.form.gain_bits, self.form.ratio_range
        # r has so many bits less than b behind the point, so what it is multiplied by is shifted by as many.
        times_r = self._times("r", "e1", b)
        if more:
            times_r = [Do(Op.LOAD, "e1"), *_doubled(more), Do(Op.STORE, "t"), *self._times("r", "t", b)]
        return [
            *(*self._times("d", "e", b), Do(Op.STORE, "e1")),
            *(*self._times("d", "e1", b), Do(Op.STORE, "e2")),
            *(*self._times("d", "e2", b), *[Do(Op.ADD, "e1")] * 3, *[Do(Op.SUB, "e2")] * 3),
            *(Do(Op.ADD, "p"), Do(Op.STORE, "p")),
            # All bits of r have left mq.
            *(*times_r, Do(Op.STORE, "h"), *_doubled(self.form.extra_bits + more), Do(Op.STORE, "t")),
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
            *(Do(Op.STORE, "t"), Do(Op.LOAD, "one"), Do(Op.TO_MQ), Do(Op.DIV, "gap", form.width + form.unit_bits)),
            *(Do(Op.FROM_MQ), Do(Op.SUB, "t"), Do(Op.NEGATIVE), Do(Op.ADD, "t"), Do(Op.STORE, "t")),
            *(Do(Op.LOAD_SIGNED, "t"), Do(Op.STORE, "v")),
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
        return tuple(assembled(self.steps, self.address))

    @cached_property
    def clocks(self) -> int:
        """Clocks of the program, whatever it meets."""
        return clocks(self.steps)
