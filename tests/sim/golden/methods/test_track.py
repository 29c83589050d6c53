"""The golden tracking method where it once did not settle."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tachometry.sim import golden
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.spec import of_texts


def places(start: str, gap: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return clocks and positions of counts, at last with `gap` clocks in between."""
    clock = np.round(np.arange(1, 1500) * gap).astype(np.int64)
    forward = np.arange(1, 1500)
    if start == "reversal":
        return np.append(clock, clock[-1] + clock), np.append(forward, 1499 - forward)
    slow = 2 * clock[:500]
    return np.append(slow, slow[-1] + clock), np.append(forward[:500], 500 + forward - 1)


@pytest.mark.parametrize("start", ["reversal", "doubled speed"])
@pytest.mark.parametrize("options", [{}, {"agile": "no"}, {"growing-memory": "no"}, {"edge-error": "0.2"}], ids=str)
def test_a_constant_speed_is_settled_upon(start: str, options: dict[str, str]) -> None:
    """A tick without a count at nearly a count per tick must not throw the velocity away."""
    spec = of_texts("track", {"ppr": "500", "max-speed": "1000rad/s"} | options)
    for counts_per_tick in (0.5, 0.75, 0.9, 0.95, 1.05):
        clock, position = places(start, spec.timing.tick_cycles / counts_per_tick)
        level = quadrature(np.append(0, position))
        trace = PinTrace(np.append(0, clock), level & np.uint8(1), level >> np.uint8(1), int(clock[-1]) + 10)
        velocity = golden.run(spec, trace).updates.velocity[-300:] / 2.0**spec.widths.frac_bits
        assert np.abs(velocity) == pytest.approx(np.full(300, counts_per_tick), rel=2e-3), counts_per_tick
