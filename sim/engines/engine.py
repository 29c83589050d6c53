"""Engines run the hardware: all take a trace of pins and give a `Run`."""

from collections.abc import Callable
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Watch:
    """Describes what is seen of a simulation that runs."""

    vcd: Path | None = None  # where a waveform goes, and a GTKWave save file beside it with the suffix `.gtkw`
    window: tuple[int, int] | None = None  # first clock of the waveform, and the one after the last; None for all
    progress: Callable[[int], None] | None = None  # called now and then with the number of clocks done


NO_WATCH = Watch()


class Engine(Protocol):
    """Simulates the core."""

    name: str

    def run(self, spec: CoreSpec, trace: Trace, watch: Watch = NO_WATCH) -> Run:
        """Simulate `trace.n_clocks` clocks after reset; Interrupted at Ctrl-C, with the clocks simulated so far."""
        ...


def driven_pins(spec: CoreSpec, trace: Trace) -> list[Port]:
    """Return the inputs that a trace drives; ValueError if the trace lacks one."""
    missing = [port.name for port in spec.ports.pins if port.name not in trace.lines]
    if missing:
        raise ValueError(f"the trace must have the lines of the core, and lacks {', '.join(missing)}")
    return list(spec.ports.pins)
