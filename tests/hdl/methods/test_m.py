"""The M method's datapath, with injected ticks."""

from fractions import Fraction

import numpy as np
import pytest
from reference.sequences import rounded
from support.nightly import only
from support.simulate import Resettable, clock_by_clock

from tachometry.hdl.methods import m as m_method
from tachometry.spec import Encoder, MTachometer, Timing

OUTPUTS = ["velocity_valid", "velocity", "interval", "forced"]


def check(average: int, *, tick_cycles: int = 3, frac_bits: int = 4, n: int = 300) -> None:
    """Numbers of all sizes, then none, then some again, a tick as often as it may come."""
    spec = MTachometer(
        encoder=Encoder(25), timing=Timing(1_000_000, tick_cycles, 10), frac_bits=frac_bits, average=average
    )
    rng = np.random.default_rng(average)
    limit = spec.tick.max_count
    m_e = [limit] * (average + 3) + [-limit] * (average + 3) + [0] * (average + 5) + [1]
    m_e += rng.integers(-limit, limit + 1, n).tolist()
    rows: list[dict[str, int]] = []
    for number in m_e:
        rows += [{"tick": 1, "pulse_count": number}, *[{"tick": 0}] * (tick_cycles - 1)]
    seen = clock_by_clock(m_method.MMethod(spec), rows + [{"tick": 0}] * spec.latency.datapath, OUTPUTS)
    got = [(clock, *list(row.values())[1:]) for clock, row in enumerate(seen) if row["velocity_valid"]]
    wanted = []
    for tick in range(len(m_e)):
        window = m_e[max(tick - average + 1, 0) : tick + 1]
        velocity = rounded(Fraction(sum(window), average), frac_bits)
        wanted.append((tick * tick_cycles + spec.latency.datapath, velocity, average, 0))
    assert got == wanted


# None, the least, one that is no power of two, and one with ties.
@pytest.mark.parametrize("average", only([1, 2, 5, 32], [1, 2, 3, 4, 5, 8, 16, 31, 32, 48]))
@pytest.mark.parametrize("tick_cycles", [1, 3])
def test_mean_of_the_last_ticks(average: int, tick_cycles: int) -> None:
    """With 4 fraction bits a mean over 32 or 48 has ties."""
    check(average, tick_cycles=tick_cycles)


def test_step_by_step_where_there_is_time() -> None:
    assert MTachometer(encoder=Encoder(25), timing=Timing(1_000_000, 40, 10), average=3).latency.serial
    check(3, tick_cycles=40, frac_bits=16, n=20)


def test_reset_forgets() -> None:
    """Counts before a reset are forgotten, though the memory keeps them."""
    rows = [{"rst": clock == 20, "tick": clock != 20, "m_e": 7 if clock < 20 else 1} for clock in range(40)]
    sums = clock_by_clock(Resettable(m_method.MovingSum(5, count_width=4, sum_width=7)), rows, ["total"])
    seen = [row["total"] for row in sums]
    assert seen[:7] == [7, 14, 21, 28, 35, 35, 35]
    assert seen[21:28] == [1, 2, 3, 4, 5, 5, 5]
