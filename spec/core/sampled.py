"""Sampled positions: an absolute encoder that is read once a tick, in place of lines whose edges are counted."""

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import Port, pin

_AT_ONCE = 4  # LSB by which a read may differ in no time
_COUNT_BITS = 13  # of a turn in the counts of the tracking recursion: a finer LSB is a fraction of such a count
_LEAST_BITS, _MOST_BITS, _MOST_WIDTH = 4, 24, 40


def parse_bits(what: str, text: str) -> str:
    """Return the bits of turns and of a turn, `12+17`, or those of a turn alone, `17`."""
    match = re.fullmatch(r"(?:(\d{1,2})\+)?(\d{1,2})", text.replace(" ", ""), re.ASCII)
    turns, bits = (int(match[1] or 0), int(match[2])) if match else (0, 0)
    if not (_LEAST_BITS <= bits <= _MOST_BITS and turns + bits <= _MOST_WIDTH):
        limits = f"(B from {_LEAST_BITS} to {_MOST_BITS}, at most {_MOST_WIDTH} in all)"
        raise ParameterError(what, f"must be bits of turns and of a turn, as 12+17, or 17 {limits}, not {text!r}")
    return f"{turns}+{bits}" if turns else str(bits)


@dataclass(frozen=True)
class Reach:
    """How far a read may be from the last one that was taken: more is a jump, and is not taken.

    A register of `bits` holds it, with `frac_bits` of them below an LSB of the read: it is `first` in the clock after a
    read is taken, and rises by `step` in each clock, until its highest bit is set: no read is further away than half of
    all. A read is compared with the one that was taken in the clock after its strobe, with the one before it in the
    next, and is taken in the third: one that comes meanwhile is left out.
    """

    clocks: ClassVar[int] = 3

    width: int  # bits of a read
    first: int
    step: int
    frac_bits: int

    @classmethod
    def of(cls, width: int, counts_per_clock: Fraction, age_spread: int) -> "Reach":
        """Return it for this greatest speed; ages of reads differ by at most `age_spread` clocks."""
        bits = max(0, 10 - math.floor(math.log2(counts_per_clock)))
        step = math.ceil(counts_per_clock * (1 << bits))
        return cls(width, min((_AT_ONCE << bits) + step * (age_spread + cls.clocks), 1 << width - 1 + bits), step, bits)

    @property
    def bits(self) -> int:
        """Bits of the register."""
        return self.width + self.frac_bits


@dataclass(frozen=True)
class Remainder:
    """The remainder of a position by a number, found in a clock a bit, from the highest on.

    The number is an odd divisor times 2^shift: so many lowest bits of the remainder are those of the position.
    """

    divisor: int
    shift: int
    turns: int  # of the read, after which the remainder is the same again
    width: int  # bits of the read with these turns, less its zero

    @property
    def clocks(self) -> int:
        """Clocks that it takes."""
        return self.width - self.shift + 1


@dataclass(frozen=True)
class Sampled:
    """Facts of an encoder that is read. A count is an LSB of the read."""

    turn_bits: int  # M, of whole turns
    bits: int  # B, of a turn
    age: int | None  # clocks from the shaft's place to the strobe of the read; None: an input

    @classmethod
    def of(cls, bits: str, age: int | None) -> "Sampled":
        """Return the facts of checked options."""
        *turns, own = map(int, bits.split("+"))
        return cls(sum(turns), own, age)

    @property
    def width(self) -> int:
        """Bits of a read."""
        return self.turn_bits + self.bits

    @property
    def shift(self) -> int:
        """Bits of a read that are a fraction of a count of the tracking recursion."""
        return max(0, self.bits - _COUNT_BITS)

    @property
    def most_moved(self) -> int:
        """Most counts between two reads: half a turn."""
        return 1 << self.bits - 1

    @staticmethod
    def most_age(longest_tick: int) -> int:
        """Return the greatest age of a read in clocks, two ticks: an older one is not taken."""
        return 2 * longest_tick

    def ports(self, longest_tick: int) -> tuple[Port, ...]:
        """Return the inputs of a core, all synchronous to clk."""
        read = pin("sample", "Position that was read; valid with sample_valid.", self.width)
        valid = pin("sample_valid", "One clock for every read, at most one counts in a tick: the last.")
        text = "Clocks since the shaft was at this position, valid with sample_valid. A read older than two ticks is "
        age = pin("sample_age", f"{text}not taken.", self.most_age(longest_tick).bit_length())
        right = pin("sample_ok", "Low with sample_valid: the frame was wrong, and the read is not taken.")
        return (read, valid, *((age,) if self.age is None else ()), right)
