"""The units of the tracking machine: the operations they begin, and how many clocks these take."""

from dataclasses import dataclass
from enum import IntEnum

from tachometry.spec.formats.tracking import CHANCE_BITS, POWER_BITS, RESULT_BITS, WIDTH, Tracking


class Start(IntEnum):
    """Lists what an instruction begins with the sum."""

    NONE = 0
    LOG = 1
    EXP = 2
    OVER = 3
    GAIN = 4
    BY = 5
    TIMES = 6
    CHANCE = 7


STAGES = 3  # clocks from when an instruction is fetched until it is executed, which are lost when a jump is taken
APART = 3  # instructions from one that stores a word to the first that reads it


@dataclass(frozen=True)
class Times:
    """Clocks from the begin of an operation of the unit until its result can be used."""

    # log, exp, over, gain, by and times: at most; 0: nothing waits for it
    log: int
    exp: int
    over: int
    gain: int
    by: int
    times: int
    ports: int = 1

    @property
    def fetch_clocks(self) -> int:
        """Clocks to fetch the first instruction, to read its word, and to hold the result; with two ports twice."""
        return STAGES + 1 + self.ports

    def of(self, start: Start) -> int:
        """Return those of what begins; 0: nothing."""
        return (0, self.log, self.exp, self.over, self.gain, self.by, self.times, 0)[start]


BLOCK = Times(log=4, exp=5, over=3, gain=3, by=0, times=6, ports=2)


@dataclass(frozen=True)
class Serial:
    """Says how the serial unit works: what is added on top of its register goes right by 2 or by 8 places a clock."""

    form: Tracking

    extra = 4  # places that a product goes beyond those that are asked for, as it stays below 2^36

    @property
    def digits(self) -> int:
        """Digits of a factor, of two bits; it may be doubled, and the last digit takes what the others owe."""
        return (self.form.factor_bits + 2) // 2 + 1

    @property
    def low(self) -> int:
        """Bits of the register below those that are added to."""
        return 2 * self.digits + self.extra

    @property
    def least_pairs(self) -> int:
        """Pairs of places from where a number is added to where it is the result."""
        return (self.low - 2 - CHANCE_BITS) // 2

    @property
    def log_end(self) -> int:
        """Place where the leading one of a number ends whose logarithm is meant, or one above."""
        return self.form.factor_bits + self.form.factor_bits % 2

    @property
    def read_pairs(self) -> int:
        """Pairs of places that what was read goes, a logarithm or that of a gain."""
        return self.least_pairs + self.table_place // 2

    @property
    def table_place(self) -> int:
        """Place of the last bit of what was read among those that are added; it is even."""
        return max(0, self._power_place - self.low + 1)

    @property
    def _power_place(self) -> int:
        return CHANCE_BITS + RESULT_BITS - POWER_BITS  # of the last bit of 2^36

    @property
    def power_places(self) -> int:
        """Places that 2^0 goes."""
        return RESULT_BITS + self.low - 2 + self.table_place - self._power_place

    def pairs(self, start: Start, shift: int) -> int:
        """Return the pairs of places that an operation goes at least, of 2^0 or by a factor without places."""
        if start == Start.EXP:
            return (self.power_places + 1) // 2
        if start == Start.LOG:
            return (self.low - 2 - self.log_end) // 2
        return (shift + 1) // 2 + (self.extra // 2 if start == Start.TIMES else self.least_pairs)

    @property
    def times(self) -> Times:
        """Clocks of its operations."""
        named = max(self.form.shifts.values()) + self.extra
        power = max(self._steps((self.power_places - whole + 1) // 2) for whole in range(-16, RESULT_BITS))
        over = max(self._steps(self.least_pairs + (places + 1) // 2) for places in range(CHANCE_BITS + 2))
        product = max(map(self._steps, range((named + 1) // 2 + 1)))
        log, factor = (
            max(self._seeks(leading, pairs, end) for leading in range(WIDTH - 1))
            for pairs, end in ((self.pairs(Start.LOG, 0), self.log_end), (self.least_pairs, self.form.factor_bits - 1))
        )
        read = self._steps(self.read_pairs)
        times = 5 + self.digits + product
        return Times(log=8 + log + read, exp=5 + power, over=5 + over, gain=5 + read, by=5 + factor, times=times)

    @staticmethod
    def _steps(pairs: int) -> int:
        return pairs // 4 + pairs % 4

    def _seeks(self, leading: int, least: int, end: int) -> int:
        """Return the steps until a leading one is at a place, or one above, some pairs of places further at least."""
        place, pairs, steps, far, near = self.low - 2 + leading, -least, 0, False, False
        while pairs < 0 or near:
            by_8, far = pairs <= -4 or far, place >= end + 16
            place, pairs, steps = place - (8 if by_8 else 2), pairs + (4 if by_8 else 1), steps + 1
            near = place >= end + 2
        return steps
