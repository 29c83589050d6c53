"""Engines run the hardware: all take a trace of pins and give a `Run`."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from tachometry.sim.signals.axes import Trace
from tachometry.sim.signals.run import Run
from tachometry.spec import CoreSpec, Port


class Interrupted(KeyboardInterrupt):
    """Ctrl-C in a simulation; `run` is the part simulated before, `n_clocks` long."""

    def __init__(self, run: Run) -> None:
        super().__init__()
        self.run = run


class Engine(Protocol):
    """Simulates the core."""

    name: str

    def run(
        self,
        spec: CoreSpec,
        trace: Trace,
        *,
        vcd: Path | None = None,
        window: tuple[int, int] | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> Run:
        """Simulate `trace.n_clocks` clocks after reset.

        - `vcd`: Where to write a waveform, and a GTKWave save file beside it with the suffix `.gtkw`.
        - `window`: First clock of the waveform, and the one after the last; None for all.
        - `progress`: Called now and then with the number of clocks done.

        It raises Interrupted at Ctrl-C, with what was simulated so far.
        """
        ...


def driven_pins(spec: CoreSpec, trace: Trace) -> list[Port]:
    """Return the inputs that a trace drives; ValueError if the trace lacks one."""
    missing = [port.name for port in spec.ports.pins if port.name not in trace.lines]
    if missing:
        raise ValueError(f"the trace must have the lines of the core, and lacks {', '.join(missing)}")
    return list(spec.ports.pins)
