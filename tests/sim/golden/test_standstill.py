"""When a shaft is said to rest: no count in more ticks than the maximum time has."""

import numpy as np
import pytest

from tachometry.sim.golden.standstill import with_stalled
from tachometry.sim.signals.run import Table
from tachometry.spec import of_texts

SPEC = of_texts("s", {"ppr": "8", "clock": "1MHz", "tick": "10clk", "max-time": "40clk"})  # four ticks


@pytest.mark.parametrize(
    ("numbers", "lengths", "stalled"),
    [
        # The tick before the first one counts as empty.
        ("000000", "111111", "000111"),
        ("100000", "111111", "000001"),
        ("010000-0", "11111111", "00000000"),
        ("0100000-0", "111111111", "000000100"),
        # Of a tick that is longer than nominal, so much more.
        ("0000", "1111", "0001"),
        ("0100", "1423", "0001"),
        ("0100", "1222", "0000"),
    ],
)
def test_rest(numbers: str, lengths: str, stalled: str) -> None:
    m_e = np.array([{"0": 0, "1": 1, "-": -1}[number] for number in numbers])
    ticks = Table(np.arange(len(m_e)), {"pulse_count": m_e})
    found = with_stalled(SPEC, ticks, np.array([int(length) for length in lengths])).stalled
    assert "".join(str(int(one)) for one in found) == stalled
