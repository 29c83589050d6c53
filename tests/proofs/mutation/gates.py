"""And-gates, and what a solver knows of them."""

import random
from collections.abc import Collection, Mapping

from pysat.solvers import Solver

_CONFLICTS = 2000  # of the solver, for a question
GAMES = 1024  # that are played at once
ONES = (1 << GAMES) - 1
Place = tuple[str, int]  # port and bit
Levels = dict[Place, int]  # literals


class Gates:
    """And-gates with a number for each, of which none is there twice.

    A literal is twice the number of a gate or an input, and one more if it is inverted; 0 and 1 are constants.
    """

    def __init__(self) -> None:
        self._solver = Solver("glucose4")
        self._made: dict[tuple[int, int], int] = {}
        self._terms: list[tuple[int, int] | None] = [None]
        self._known = {0}
        self._solver.add_clause([-1])
        self._random = random.Random(1)

    def new(self) -> int:
        """Return an input."""
        self._terms.append(None)
        return 2 * len(self._terms) - 2

    def all_of(self, one: int, other: int) -> int:
        """Return whether both are 1."""
        if one > other:
            one, other = other, one
        if one < 2 or one == other:
            return other if one else 0
        if one ^ other == 1:
            return 0
        if (one, other) not in self._made:
            self._terms.append((one, other))
            self._made[one, other] = 2 * len(self._terms) - 2
        return self._made[one, other]

    def any_of(self, one: int, other: int) -> int:
        """Return whether one is 1."""
        return self.all_of(one ^ 1, other ^ 1) ^ 1

    def differ(self, one: int, other: int) -> int:
        """Return whether they differ."""
        return self.any_of(self.all_of(one, other ^ 1), self.all_of(one ^ 1, other))

    def unequal(self, some: list[int], others: list[int]) -> int:
        """Return whether any bits of two words differ."""
        found = 0
        for one, other in zip(some, others, strict=True):
            found = self.any_of(found, self.differ(one, other))
        return found

    def one_of(self, bits: list[int], words: Collection[int]) -> int:
        """Return whether bits, the lowest first, are one of some words."""
        if not words or not bits:
            return int(bool(words))
        *lower, bit = bits
        zeros = [word for word in words if not word >> len(lower) & 1]
        ones = [word for word in words if word >> len(lower) & 1]
        return self.any_of(self.all_of(bit, self.one_of(lower, ones)), self.all_of(bit ^ 1, self.one_of(lower, zeros)))

    def played(self, given: Mapping[int, int], last: int) -> list[int]:
        """Return of each literal up to the last one `GAMES` levels, a bit for each; of inputs that are not given they
        are random.
        """
        values = [0, ONES]
        for number, terms in enumerate(self._terms[1 : 1 + (last >> 1)], 1):
            if terms:
                value = values[terms[0]] & values[terms[1]]
            else:
                value = given[2 * number] if 2 * number in given else self._random.getrandbits(GAMES)
            values += [value, value ^ ONES]
        return values

    def _variable(self, literal: int) -> int:
        """Return a literal for the solver, which is told of the gates behind it."""
        told = [literal >> 1]
        while told:
            number = told.pop()
            terms = self._terms[number]
            if number in self._known:
                continue
            self._known.add(number)
            if terms:
                one, other = (self._signed(term) for term in terms)
                here = number + 1
                self._solver.append_formula([[-here, one], [-here, other], [here, -one, -other]])
                told += [term >> 1 for term in terms]
        return self._signed(literal)

    @staticmethod
    def _signed(literal: int) -> int:
        number = (literal >> 1) + 1
        return -number if literal & 1 else number

    def may_be(self, literal: int, given: list[int]) -> bool:
        """Tell whether a literal may be 1 while those given are; also if the solver does not know."""
        if literal < 2:
            return bool(literal)
        self._solver.conf_budget(_CONFLICTS)
        asked = [self._variable(one) for one in (literal, *given)]
        return self._solver.solve_limited(assumptions=asked) is not False

    def example(self) -> dict[int, int]:
        """Return inputs with which it was 1, in the first of games, and others that are much like these."""
        found = {}
        for number, variable in ((abs(one) - 1, one) for one in self._solver.get_model() or []):
            if number < len(self._terms) and self._terms[number] is None:
                off = self._random.getrandbits(GAMES) & self._random.getrandbits(GAMES) & ONES - 1
                found[2 * number] = (variable > 0) * ONES ^ off
        return found
