"""The board that `monitor` is for: at a serial port, or simulated."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tachometry.boards.fpga.boards import BOARDS
from tachometry.cli.options.core import CoreTexts
from tachometry.spec import of_options
from tachometry.spec.language.files import MOST_JSON, read_text
from tachometry.spec.registers.buses import Bus, bus_of
from tachometry.spec.registers.demo import DemoMap, demo_manifest

if TYPE_CHECKING:
    from tachometry.boards.monitor.serial_port import SerialPort

SIMULATED = "sim:"
_BUS = "uart"


@dataclass(frozen=True)
class Target:
    """The board that is meant."""

    port: str
    title: str  # what the view is headed with
    registers: DemoMap
    bus: Bus
    module: str = "tachometer"

    @property
    def manifest(self) -> dict[str, Any]:
        """The entry of the manifest."""
        return demo_manifest(self.registers, self.bus, self.module)

    @property
    def is_simulated(self) -> bool:
        """Whether there is no hardware."""
        return self.port.startswith(SIMULATED)

    @property
    def timeout(self) -> float:
        """Seconds that an answer may take: a simulated board is as late as its computer is busy."""
        return 30.0 if self.is_simulated else 0.5

    @contextmanager
    def presence(self) -> Iterator[str]:
        """Yield the name of the serial port, while there is a board at it."""
        if not self.is_simulated:
            yield self.port
            return
        from tachometry.boards.simulated.board import SimulatedBoard
        from tachometry.sim.engines.board import BoardSimulation

        simulation = BoardSimulation(self.registers, self.bus)
        try:
            with SimulatedBoard(simulation, self.registers.spec.timing.clock_hz) as board:
                yield board.path
        finally:
            simulation.close()

    def label(self, name: str) -> str:
        """Return what messages call the port of this name."""
        return f"{self.port} at {name}" if self.is_simulated else name

    def open(self, name: str) -> SerialPort:
        """Open the port."""
        from tachometry.boards.monitor.serial_port import SerialPort

        return SerialPort(name, self.bus.baud)


def target_of(port: str, core: CoreTexts, manifest: Path | None) -> Target:
    """Return the board at a port: of `sim:NAME` one with this core, of a serial port that of a manifest.

    It raises ValueError if there is none, its core cannot be, or its manifest is not that of a demo on a UART.
    """
    if not port.startswith(SIMULATED):
        return _attached(port, core, manifest)
    if manifest is not None:
        raise ValueError("--manifest must not be given together with a simulated board, but options of the core")
    return _simulated(port, core)


def _simulated(port: str, core: CoreTexts) -> Target:
    board = port.removeprefix(SIMULATED)
    if board not in BOARDS:
        names = ", ".join(SIMULATED + name for name in BOARDS)
        raise ValueError(f"PORT must be a serial port or one of {names}, not {port!r}")
    bus, spec = bus_of(_BUS), core.at(BOARDS[board].clock_hz)
    assert bus is not None
    bus.bit_cycles(spec.timing.clock_hz)
    return Target(port, f"{board}, simulated: {spec.words.method}", DemoMap(spec), bus)


def _attached(port: str, core: CoreTexts, path: Path | None) -> Target:
    if path is None:
        raise ValueError("--manifest must be given with a serial port: the file NAME.json that tachometry build writes")
    if core.given:
        raise ValueError("options of the core must not be given with a serial port: --manifest has them")
    try:
        described = json.loads(read_text(path, MOST_JSON))
        options, registers = dict(described["options"]), described["registers"]
        bus, baud, module = described["bus"], described.get("baud"), described["module"]
        configuration = registers["configuration"]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(
            f"--manifest must be a file NAME.json that tachometry build writes, which {path} is not"
        ) from error
    if bus != _BUS:
        raise ValueError(f"--manifest must be that of a board with --bus {_BUS}, not {bus}")
    if "loop" in options:
        raise ValueError("--manifest must be that of a board without --loop, whose registers other programs read")
    try:
        demo = DemoMap(of_options(options).tachometer)
        line = bus_of(_BUS, baud)
        assert line is not None
        demo_manifest(demo, line, module)
    except (ValueError, TypeError, AttributeError) as error:
        raise ValueError(f"--manifest {path}: {error}") from error
    if configuration != demo.configuration:
        raise ValueError(
            f"--manifest {path} must be that of a demo which this version of tachometry makes: its configuration would "
            f"be 0x{demo.configuration:08x}, not {configuration!r}"
        )
    return Target(port, f"{port}: {demo.spec.words.heading}", demo, line, module)
