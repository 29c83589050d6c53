"""A board has a clock, pins, and tools that build and load it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any

from tachometry.boards.fpga.flow import Flow

# Lines of an encoder that the core reads are on the pins of others.
_READ = {
    **{"encoder_data": "a", "encoder_clock": "b", "rs485_rx": "a", "rs485_tx": "b", "rs485_de": "z"},
    **{f"emulated_{line}": "emulated_a" for line in ("encoder_data", "rs485_rx", "spi_miso")},
}


def pins(text: str) -> dict[str, str]:
    """Return pins by the ports that are on them, of words such as `a:25`."""
    found = {port: pin for port, pin in (word.split(":") for word in text.split())}
    return found | {port: found[other] for port, other in _READ.items() if other in found}


def platform(name: str, **options: str) -> Callable[[], Any]:
    """Return what makes the platform `module:Class` of amaranth-boards, which is of the extra `boards`."""
    return lambda: resolve_name(f"amaranth_boards.{name}")(**options)


@dataclass(frozen=True)
class Header:
    """Is a connector of a board."""

    label: str  # what people call it
    pins: Mapping[str, str]  # its pins by the ports that are on them
    # its name and number in amaranth-boards; None: the pins are those of the FPGA
    connector: tuple[str, int] | None = None


@dataclass(frozen=True)
class Board:
    """Describes a board on which a core can run."""

    name: str  # on the command line
    title: str  # the board and its FPGA, for people
    clock_hz: int  # frequency of its oscillator, at which the core runs: there is no PLL
    platform: Callable[[], Any]  # makes the platform of amaranth-boards, which is imported only then
    headers: tuple[Header, ...]
    attributes: Mapping[str, object]  # of every pin of a header: its voltage
    pull_up: Mapping[str, object]  # also of inputs
    leds: int  # LEDs that are used, at most
    flow: Flow | None  # what makes a bitstream; None: the vendor's tools, from an archive
    loader: tuple[str, ...]  # what openFPGALoader must be told of the board
    edges: int = 8192  # words that `EdgeRecorder` has in its memories
    bitstream: str = ""  # suffix of the bitstream that the vendor's tools make

    @property
    def suffix(self) -> str:
        """Of a file with which the board can be programmed."""
        return self.bitstream if self.flow is None else self.flow.suffix

    @property
    def pins(self) -> dict[str, str]:
        """Where ports are, for people, such as `PMOD1A 1`."""
        return {port: f"{header.label} {pin}" for header in self.headers for port, pin in header.pins.items()}
