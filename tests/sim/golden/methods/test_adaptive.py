"""k of an adaptive dt from window to window, by the table of docs/concepts/rairan.md."""

from fractions import Fraction

import pytest
from reference.rairan import next_k

from tachometry.sim.golden.methods.adaptive import next_shift
from tachometry.spec.methods.adaptive import AdaptiveDt


@pytest.mark.parametrize("falling", [False, True])
@pytest.mark.parametrize("max_shift", [1, 3, 4, 7])
@pytest.mark.parametrize("one_in", [4, 5, 9, 20, 100])
def test_the_next_k(one_in: int, max_shift: int, falling: bool) -> None:
    target = Fraction(1, one_in)
    rule = AdaptiveDt(target, max_shift)
    for k in range(falling, max_shift + 1):  # from k = 0 on nothing falls
        for n in range(1, 4 * rule.fewest):
            for high in (False, True):
                counts = (n, 1) if high and n > 1 else (1, 1 if high else n)
                wanted = next_k(k, falling, counts, target, max_shift)
                assert next_shift(rule, k, n, high=high, falling=falling) == wanted, (k, n, high)
