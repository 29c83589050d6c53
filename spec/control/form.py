"""Formats and coefficients of the control loop, and how exact they are.

The law is that of Tsuji 2009, Sec. III and V-E. At an update of the velocity u, n control ticks of T_c after the one
before, with the mean Ī of the currents of these ticks and K_a = K_t/(J·G):

    y ← y + c_v(n)·(u − y),   z ← z + c_d(n)·(K_a·Ī + y − z),   c(n) = 1 − e^(−G·n·T_c)   (eq. (22), Fig. 11)

and at a control tick

    I = (J·(k_p·(θ_cmd − θ) + k_v·(ω_cmd − y) + a_cmd) + J·G·(z − y))/K_t, held within the limit.

So the disturbance is J·G·(z − y), and J·G·ω never has to be formed. Instead of z the hardware keeps w = z − y. y and w
are in 2^−f of an LSB of the velocity, the sum that becomes I in 2^−4 of an LSB of the current. Each product is
round(d·c / 2^p), d a word and c a coefficient of p bits; where a ratio is 1 or more, d is shifted left for it.

What is not exact:

- A product is rounded, by half a unit. In y and w that dies out by c(n) per update, so it adds up to ½·2^−f/c(1) LSB of
  the velocity for each of one product (y) or two (w). 2^f is at least 4/c(1): at most ⅛ LSB in y, and ¼ in w.
- I is a sum of four products, so it is off by at most 4·½·2^−4 = ⅛ LSB, and by ½ from its own rounding.
- A coefficient is rounded to p bits: its relative error is at most 2^−12, as the least of them is at least 2^11. (One
  just below 1 is cut to 1 − 2^−p.) This is as if J, K_t or a gain were off by so much.

What cannot overflow, whatever the inputs: y stays between the old y and u, so |y| ≤ V, the greatest velocity. z is
drawn towards y + K_a·Ī: |z| ≤ V + M, where c_d(n)·M is at least the greatest product with ΣI and one unit more, for
every n. So |w| ≤ 2V + M. The position error is held within a limit at which its product is greater than all others
together and the limit of the current: holding it changes no current.

Where gains are inputs, they are the upper bits of coefficients, from 0 on, and a word is shifted so far that a gain can
be 16 times that of its option. Sums are as wide as the greatest of all gains make them, so nothing overflows here,
either; y, z and their bounds have no gain in them. The position error is held within a limit at which its product,
with 1/16 of its option's gain, is as above. With a gain that is still less, or others that are greater, holding it can
change the current: then it is a limit of its own.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from enum import IntEnum
from fractions import Fraction
from functools import cached_property, lru_cache
from itertools import accumulate, repeat
from typing import Self

from tachometry.spec.language.units import ceil_log2, signed_width

GUARD_BITS = 4  # of the sum that becomes the current
POSITION_FRAC_BITS = 8  # of the commanded position
ACCELERATION_WIDTH = 20  # bits of the commanded acceleration
LEAST_COEFFICIENT = 11  # bits
MOST_GAIN_BITS = 24  # of a gain that is an input
GAIN_HEADROOM = 4  # such a gain can be 2^this times that of the option, or more


class Term(IntEnum):
    """Lists the products in the order in which they are formed, as the program of the controller.

    A row has the word that is multiplied, as it is or less y; whether its coefficient is of a table, by n, or a gain,
    which can be an input; and the sums that the product is added to or taken from.
    """

    FILTER = "held - y", "table", "y -w"  # c_v·(u − y)
    OBSERVER = "w", "table", "-w"  # c_d·w
    CURRENT = "current_sum", "table", "w"  # c_d·K_a/n·ΣI
    POSITION = "error", "gain", "total"
    VELOCITY = "velocity - y", "gain", "total"
    ACCELERATION = "acceleration", "gain", "total"
    DISTURBANCE = "w", "gain", "total"

    def __new__(cls, *row: str) -> Self:
        term = int.__new__(cls, len(cls.__members__))
        term._value_ = int(term)
        return term

    def __init__(self, word: str, coefficient: str, sums: str) -> None:
        self.word, self.less_y = word.removesuffix(" - y"), word.endswith(" - y")
        self.tabled, self.sums = coefficient == "table", sums.split()

    @classmethod
    def into(cls, *sums: str) -> list[Self]:
        """Return the products that go into one of these sums, with this sign."""
        return [term for term in cls if {*sums} & {*term.sums}]


GAINS = tuple(term for term in Term if not term.tabled)


_LONGEST = Fraction(177)  # e^−177 > 2^−256, which is far below what a coefficient shows


@dataclass(frozen=True)
class Coefficients:
    """Holds the coefficients of a term, in 2^(shift − p) of a unit of its result: one for each n from 1 on, or one."""

    values: tuple[int, ...]
    shift: int  # the word is shifted left by so many bits


@dataclass(frozen=True)
class ControlForm:
    """Holds the numbers that hardware and golden model share."""

    # velocity_width and velocity_limit: bits of the velocity, and V: its greatest magnitude, LSB
    velocity_width: int
    velocity_limit: int
    extra_bits: int  # f
    factor_bits: int  # p
    terms: dict[Term, Coefficients]  # the coefficients of each term; without `Term.FILTER` y is the velocity
    current_limit: int  # in LSB of the current
    # position_width, command_bits and acceleration_width: bits of the position, fraction bits of the commanded
    # velocity, bits of the commanded acceleration
    position_width: int
    command_bits: int
    acceleration_width: int
    synchronised: bool  # whether filter and observer work at updates of the velocity, not at control ticks
    position_bits: int = POSITION_FRAC_BITS  # fraction bits of the commanded position
    # bits of each of `GAINS`, which are inputs, as is the limit of the current, up to `current_limit`; 0: they are
    # fixed
    gain_bits: int = 0

    @property
    def gain_shift(self) -> int:
        """A coefficient is a gain shifted left so far."""
        return self.factor_bits - self.gain_bits

    @property
    def most_gain(self) -> int:
        """The greatest gain."""
        return (1 << self.gain_bits) - 1

    @property
    def reset_gains(self) -> dict[Term, int]:
        """Gains of the options."""
        return {term: self.terms[term].values[0] >> self.gain_shift for term in GAINS}

    @property
    def longest(self) -> int:
        """The greatest n: then the velocity that is held is taken as an update."""
        return len(self.terms[Term.CURRENT].values)

    def product(self, term: Term, word: int, n: int = 1) -> int:
        """Return round(word·c / 2^p) for the coefficient of n, with the term's shift."""
        one = self.terms[term]
        return (((word << one.shift) * one.values[n - 1]) + (1 << (self.factor_bits - 1))) >> self.factor_bits

    @cached_property
    def most_y(self) -> int:
        """Greatest |y|."""
        return self.velocity_limit << self.extra_bits

    @cached_property
    def most_lead(self) -> int:
        """M: z leads |y| by no more."""
        forgets, gains = self.terms[Term.OBSERVER].values, self.terms[Term.CURRENT]
        one = 1 << self.factor_bits
        return max(
            -(-((n + 1) * (self.current_limit << gains.shift) * gain + one) // forget)
            for n, (forget, gain) in enumerate(zip(forgets, gains.values, strict=True))
        )

    @cached_property
    def most_w(self) -> int:
        """Greatest |w|."""
        return 2 * self.most_y + self.most_lead

    @property
    def most_sum(self) -> int:
        """Greatest |ΣI|."""
        return self.longest * self.current_limit

    @property
    def command_width(self) -> int:
        """Bits of the commanded velocity."""
        return self.velocity_width + self.command_bits

    @property
    def most_command(self) -> int:
        """Greatest magnitude of the commanded velocity, in units of y."""
        return 1 << (self.velocity_width - 1 + self.extra_bits)

    @cached_property
    def _most_words(self) -> dict[Term, int]:
        """Greatest magnitude of what is multiplied, but of the position error, which is held for all others."""
        words = {
            "held": self.most_y,
            "w": self.most_w,
            "current_sum": self.most_sum,
            "velocity": self.most_command,
            "acceleration": 1 << (self.acceleration_width - 1),
        }
        return {term: words[term.word] + term.less_y * self.most_y for term in Term if term.word in words}

    def _most(self, term: Term, word: int) -> int:
        """Return the product of a word with the greatest coefficient that a term can have."""
        if not self.gain_bits:
            return self.product(term, word)
        one = replace(self.terms[term], values=(self.most_gain << self.gain_shift,))
        return replace(self, terms={term: one}).product(term, word)

    @cached_property
    def most_error(self) -> int:
        """The position error is held within ±this, in units of the commanded position: all bits are 1."""
        half = (1 << (self.position_width + self.position_bits - 1)) - 1
        if self.gain_bits:
            return min(self._most_error_of_gains, half)
        if not self.terms[Term.POSITION].values[0]:
            return 1
        enough = self._most_others + (self.current_limit << GUARD_BITS) + 1
        limit = 1
        while limit < half and self.product(Term.POSITION, limit) < enough:
            limit = 2 * limit + 1
        return min(limit, half)

    @property
    def _most_error_of_gains(self) -> int:
        """2^GAIN_HEADROOM times that of the options; where there is no gain of the position, of the usual one."""
        usual = 1 << max(self.factor_bits - GAIN_HEADROOM - 1, 0)
        position = self.terms[Term.POSITION]
        fixed = self.terms | {Term.POSITION: replace(position, values=(min(position.values[0] or usual, usual),))}
        return (replace(self, terms=fixed, gain_bits=0).most_error + 1 << GAIN_HEADROOM) - 1

    @cached_property
    def _most_others(self) -> int:
        """Greatest magnitude of the sum without the position."""
        return sum(self._most(term, self._most_words[term]) + 1 for term in GAINS if term != Term.POSITION)

    @cached_property
    def most_total(self) -> int:
        """Greatest magnitude of the sum that becomes the current."""
        return self._most_others + self._most(Term.POSITION, self.most_error + 1) + 1

    @cached_property
    def word_width(self) -> int:
        """Bits of a word that is multiplied, shifted."""
        most = self._most_words | {Term.POSITION: self.most_error + 1}
        return max(signed_width(most[term] << one.shift) for term, one in self.terms.items())

    @property
    def total_width(self) -> int:
        """Bits of the sum that becomes the current, and of the position error before it is held."""
        return max(signed_width(self.most_total), self.position_width + self.position_bits)


@lru_cache(64)
def ratios(rate: Fraction, seconds: Fraction, longest: int) -> tuple[Fraction, ...]:
    """Return c(n) for n from 1 to `longest`, eq. (22), to 60 digits."""
    exponent = min(rate * seconds, _LONGEST)
    with localcontext() as context:
        context.prec = 80
        one, least = ((-Decimal(e.numerator) / Decimal(e.denominator)).exp() for e in (exponent, _LONGEST))
        decays = accumulate(repeat(one, longest), lambda before, one: max(before * one, least))
        return tuple(1 - Fraction(decay) for decay in decays)


def extra_bits(*least: Fraction) -> int:
    """Return f: the least with 2^f ≥ 4/c(1), of each."""
    return max(2, *(ceil_log2(4 / one) for one in least))


def factor_bits(found: Sequence[Sequence[Fraction]]) -> int:
    """Return p: so many that the least coefficient that is not 0 has its bits."""
    least = min(min(each) / _one(each) for each in found if each[0])
    return LEAST_COEFFICIENT + max(1, ceil_log2(1 / least))


def _one(found: Sequence[Fraction]) -> int:
    """Return the power of two, at least 1, that is greater than all of them."""
    return 1 << math.floor(max(found)).bit_length()


def gain(found: Fraction, usual: Fraction, bits: int, gain_bits: int) -> Coefficients:
    """Return a ratio as a coefficient of so many bits that is a gain of fewer; its range is for the usual one."""
    one = _one([usual * (1 << GAIN_HEADROOM)])
    raw = min(round(found / one * (1 << gain_bits)), (1 << gain_bits) - 1)
    return Coefficients((raw << (bits - gain_bits),), one.bit_length() - 1)


def coefficients(found: Sequence[Fraction], bits: int) -> Coefficients:
    """Return ratios as coefficients of so many bits."""
    one = _one(found)
    most = (1 << bits) - 1
    return Coefficients(tuple(min(round(each / one * (1 << bits)), most) for each in found), one.bit_length() - 1)
