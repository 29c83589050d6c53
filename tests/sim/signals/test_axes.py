"""Pins of many encoders."""

import numpy as np
import pytest

from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.signals.recording import Recording
from tachometry.spec import AxesSpec, STachometer, of_texts


def test_all_axes_together_have_as_many_ticks_as_one_may() -> None:
    alone = of_texts("s", {"ppr": "25", "clock": "20kHz", "tick": "2ms", "max-time": "8ms"})
    assert isinstance(alone, STachometer)
    low = np.zeros(1, dtype=np.uint8)
    spec = AxesSpec(tachometer=alone, axes=4)

    def placed(seconds: float) -> AxesTrace:
        return AxesTrace.placed([Recording(np.zeros(1), low, low, seconds)] * 4, spec)

    assert placed(5000).n_clocks == 100_000_000
    with pytest.raises(ValueError, match=r"^what is run must have at most 2500000 ticks of each of 4 axes, 5000s of "):
        placed(5000.002)
