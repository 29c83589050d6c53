"""Engines: what runs the hardware. All take a `PinTrace` and give a `Run`."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from tachometry.sim.recording import PinTrace
from tachometry.sim.results import Run
from tachometry.spec import TachometerSpec


class Engine(Protocol):
    """A simulator of the core."""

    name: str

    def run(
        self,
        spec: TachometerSpec,
        trace: PinTrace,
        *,
        vcd: Path | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> Run:
        """Simulate `trace.n_clocks` clocks after reset.

        Parameters
        ----------
        spec : TachometerSpec
        trace : PinTrace
        vcd : path or None
            Where to write a waveform, and a GTKWave save file beside it with the suffix `.gtkw`.
        progress : callable or None
            Called now and then with the number of clocks done.
        """
        ...
