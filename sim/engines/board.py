"""The compiled engine runs a demo board: bytes go into its UART, bytes come out of it, and clocks pass."""

import ctypes
import threading
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from typing import Any

import numpy as np
from amaranth.lib import wiring

from tachometry.hdl.core.demo import Demo
from tachometry.sim.engines.compiled import Design, struct
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.spec import Port
from tachometry.spec.registers.buses import Bus
from tachometry.spec.registers.demo import DemoMap

_DRIVER = files(__package__).joinpath("board.h").read_text(encoding="utf-8")
_ROOM = 1 << 16  # bytes that a call can give back


@dataclass(frozen=True)
class _BoardDesign(Design):
    """Describes the demo, whose last input is the line to the core."""

    registers: DemoMap | None = None
    bus: Bus | None = None

    @cached_property
    def component(self) -> wiring.Component:
        assert self.registers is not None
        assert self.bus is not None
        return Demo(self.registers, self.bus)

    @property
    def outputs(self) -> list[Port]:
        return []

    @property
    def strobes(self) -> list[str]:
        return ["uart_tx"]

    def source(self, model: str) -> str:
        assert self.bus is not None
        head = f"#define BIT_CYCLES {self.bus.bit_cycles(self.spec.timing.clock_hz)}\n#define RX {len(self.pins) - 1}\n"
        return f"{head}#include <cstdint>\n{model}\n{_DRIVER}"


_FIELDS = ("clocks", "in", "n_in", "taken", "out", "n_out", "capacity", "lines", "broken")
_Transfer = struct(
    "_Transfer", **{name: ctypes.c_void_p if name in ("in", "out") else ctypes.c_int64 for name in _FIELDS}
)


class BoardSimulation:
    """Runs the demo on a UART, `bus`, from its reset on; OSError if it cannot be compiled."""

    def __init__(self, registers: DemoMap, bus: Bus) -> None:
        uart_rx = next(port for port in bus.ports(registers) if port.name == "uart_rx")
        pins = [port for port in registers.inputs if port.name not in ("clk", "rst")]
        design = _BoardDesign(registers.spec, [*pins, uart_rx], registers=registers, bus=bus)
        # The pins of an encoder are low; that which enables a drive has a pull-up.
        self._lines = sum(1 << place for place, pin in enumerate(pins) if pin.name == "enable")
        self._library = ctypes.CDLL(str(Cxxrtl().library(design)))
        self._library.board_new.restype = ctypes.c_void_p
        self._board: Any = ctypes.c_void_p(self._library.board_new())
        self._out = np.empty(_ROOM, dtype=np.uint8)
        self._busy = threading.Lock()  # an interrupted program may close it while a thread still runs it
        self.n_clocks = 0
        self.n_broken = 0

    def close(self) -> None:
        """Give the memory back; nothing happens in later runs."""
        with self._busy:
            if self._board is not None:
                self._library.board_delete(self._board)
                self._board = None

    def run(self, n_clocks: int, data: bytes = b"") -> tuple[bytes, bytes]:
        """Return the bytes that the core sends in these clocks, and those of `data` that have not begun to reach it."""
        given, found = np.frombuffer(data, dtype=np.uint8), []
        arrays = {"in": given.ctypes.data, "out": self._out.ctypes.data}
        transfer: Any = _Transfer(clocks=n_clocks, n_in=len(data), lines=self._lines, capacity=_ROOM, **arrays)
        with self._busy:
            while transfer.clocks and self._board is not None:
                transfer.n_out = 0
                self._library.board_run(self._board, ctypes.byref(transfer))
                found.append(self._out[: transfer.n_out].tobytes())
        self.n_clocks += n_clocks
        self.n_broken += transfer.broken
        return b"".join(found), data[transfer.taken :]
