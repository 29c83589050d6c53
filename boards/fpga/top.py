"""A board gets a core between its pins."""

from typing import Any

from amaranth import Elaboratable, Module, Value
from amaranth.build import Attrs, Pins, Resource, Subsignal
from amaranth.lib import io, wiring
from amaranth.lib.wiring import In

from tachometry.boards.fpga.board import Board
from tachometry.boards.fpga.capture_pin import CapturePin
from tachometry.hdl.core.demo import Demo
from tachometry.spec import TachometerSpec
from tachometry.spec.control import LoopSpec
from tachometry.spec.language.provenance import entries
from tachometry.spec.registers.buses import Bus
from tachometry.spec.registers.demo import demo_manifest, demo_map

# The lines of the UART are on the board's own bridge to USB.
_UART = {"uart_rx": "rx", "uart_tx": "tx"}
_LEDS = "leds"
_SHARED = {"spi_miso": "spi_cs_n"}  # outputs that are only driven while an input is low


def component(spec: TachometerSpec | LoopSpec, bus: Bus) -> wiring.Component:
    """Return the component that is put on boards."""
    return Demo(demo_map(spec), bus)


def described(spec: TachometerSpec | LoopSpec, bus: Bus, board: Board, name: str) -> dict[str, Any]:
    """Return the manifest of what `component` makes for a board.

    It raises ParameterError if the gains of a loop are fixed; if `name` cannot be the name of a module; if the clock
    cannot make the bits of the bus.
    """
    found = {**entries(), **demo_manifest(demo_map(spec), bus, name)}
    ports = {port["name"] for port in found["ports"]}
    return found | {
        "board": {"name": board.name, "pins": {name: at for name, at in board.pins.items() if name in ports}}
    }


class BoardTop(Elaboratable):
    """Connects the ports of a component to the pins that the board has for them.

    Inputs have pull-ups. Outputs without a pin are left open, and inputs without one are 0. LEDs are lit by ones.
    """

    def __init__(self, core: wiring.Component, board: Board) -> None:
        self._core, self._board = core, board

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        m.submodules.tachometer = self._core
        platform.add_resources([self._resource()])
        header = platform.request("tachometer", dir="-")
        places = {name: getattr(header, name) for name in self._on_headers()}
        if "uart_rx" in self._core.signature.members:
            uart = platform.request("uart", dir="-")
            places |= {port: getattr(uart, line) for port, line in _UART.items()}
        buffers = {name: io.Buffer("i" if self._is_input(name) else "o", port) for name, port in places.items()}
        for name, buffer in buffers.items():
            m.submodules[f"pin_{name}"] = buffer
            port = getattr(self._core, name)
            if name == "capture":
                m.submodules.capture_pin = capture = CapturePin()
                m.d.comb += [capture.pin.eq(buffer.i), port.eq(capture.capture)]
            elif self._is_input(name):
                m.d.comb += port.eq(buffer.i)
            else:
                m.d.comb += buffer.o.eq(port)
                if name in _SHARED:
                    m.d.comb += buffer.oe.eq(~buffers[_SHARED[name]].i)
        if _LEDS in self._core.signature.members:
            lights = Value.cast(getattr(self._core, _LEDS))
            for number in range(min(self._board.leds, len(lights))):
                m.submodules[f"led_{number}"] = led = io.Buffer("o", platform.request("led", number, dir="-"))
                m.d.comb += led.o.eq(lights[number])
        return m

    def _on_headers(self) -> list[str]:
        ports = self._core.signature.members
        return [name for header in self._board.headers for name in header.pins if name in ports]

    def _is_input(self, name: str) -> bool:
        return bool(self._core.signature.members[name].flow == In)

    def _resource(self) -> Resource:
        """Return the pins that the component has, on the headers."""
        names = self._on_headers()
        subsignals = []
        for header in self._board.headers:
            for name, pin in header.pins.items():
                if name in names:
                    direction = "i" if self._is_input(name) else "o"
                    attributes = {**self._board.attributes, **(self._board.pull_up if direction == "i" else {})}
                    place = Pins(pin, dir=direction, conn=header.connector)
                    subsignals.append(Subsignal(name, place, Attrs(**attributes)))
        return Resource("tachometer", 0, *subsignals)
