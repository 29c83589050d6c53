import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.arithmetic.reciprocal import Reciprocal
from tachometry.spec.formats import reciprocal as spec


@pytest.mark.parametrize("max_m", [2, 3, 10, 64, 65, 500])
def test_every_reciprocal_a_clock_after_enable_and_held(max_m: int) -> None:
    described = spec.Reciprocal(max_m, max_numerator=28, frac_bits=8, halvings=1)
    scale = 1 << (described.frac_bits + described.guard_bits)
    rows = []
    for m in range(1, max_m + 1):
        rows += [{"m": m, "enable": 1}, {"m": 1, "enable": 0}, {}]
    seen = [row["q"] for row in clock_by_clock(Reciprocal(described), rows, ["q"])]
    for m in range(1, max_m + 1):
        assert seen[3 * m - 2] == seen[3 * m - 1] == scale // m, m
