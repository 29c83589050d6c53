"""Buses on which the registers of a core can be read: their ports."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from tachometry.spec.control import AnySpec
from tachometry.spec.language.field import WORD
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import Port
from tachometry.spec.registers.frames import QUIET_BITS, SPI_ADDRESS_WIDTH, SPI_SCK_CYCLES, UART_ADDRESS_WIDTH
from tachometry.spec.registers.loop import registers_of
from tachometry.spec.registers.manifest import described_port, manifest
from tachometry.spec.registers.map import RegisterMap


@dataclass(frozen=True)
class Bus:
    """How registers are accessed."""

    name: str
    help: str  # what it is, for --help
    # ports that it adds to the core; one of width 0 is an address, as wide as the registers need
    lines: tuple[Port, ...]
    words: bool = False  # the address is that of a word, not of a byte
    idle: Mapping[str, int] = field(default_factory=dict, hash=False)  # levels of inputs that rest not at 0
    asynchronous: tuple[str, ...] = ()  # inputs that are not of the clock domain
    baud: int = 0  # bits a second on a line without a clock; 0 if the bus has none
    address_bits: int = 0  # bits of the address of a word in its frames; 0 if it has no frames
    irq: bool = False  # the registers have an interrupt

    def bit_cycles(self, clock_hz: int) -> int:
        """Return clocks of a bit on a line without a clock.

        It raises ParameterError if no whole number of clocks is near enough, or a bit would be too short to be sampled.
        """
        cycles = max((2 * clock_hz + self.baud) // (2 * self.baud), _FEWEST_BIT_CYCLES)
        if abs(clock_hz - cycles * self.baud) * _BAUD_TOLERANCE > cycles * self.baud:
            text = f"must be within 2 % of {clock_hz} Hz over a whole number of at least {_FEWEST_BIT_CYCLES} clocks"
            raise ParameterError("baud", f"{text}, such as {clock_hz // cycles}, not {self.baud}")
        return cycles

    def ports(self, registers: RegisterMap) -> tuple[Port, ...]:
        """Return ports that it adds to a core with these registers.

        It raises ParameterError if its frames do not reach all of them.
        """
        words = 1 << self.address_bits
        if self.address_bits and len(registers.registers) >= words:
            rest = f"must not be {self.name} for {len(registers.registers)} registers: it reaches {words - 1} of them"
            raise ParameterError("bus", rest)
        width = registers.address_width - (WORD // 8 - 1).bit_length() * self.words
        return tuple(
            Port(port.name, port.direction, port.width or width, help=port.help) for port in (CAPTURE, *self.lines)
        )


def _into(name: str, width: int, help: str) -> Port:
    return Port(name, "input", width, help=help)


def _out(name: str, width: int, help: str) -> Port:
    return Port(name, "output", width, help=help)


_ADDRESS = 0
_FEWEST_BIT_CYCLES = 8
_BAUD_TOLERANCE = 50  # 1 / 2 %
DEFAULT_BAUD = 1_000_000
CAPTURE = _into("capture", 1, "While high, the registers take a snapshot in every clock. Synchronous to `clk`.")

BUSES = {
    bus.name: bus
    for bus in (
        Bus(
            "native",
            "a port without a protocol: an access a clock, answered in the clock after",
            (
                _into("reg_address", _ADDRESS, "Word of the access."),
                _into("reg_read", 1, "Read in this clock."),
                _into("reg_write", 1, "Write in this clock; not together with reg_read."),
                _into("reg_write_data", WORD, "What is written."),
                _out("reg_read_data", WORD, "What was read in the clock before; else 0."),
                _out("reg_error", 1, "In the clock before, there was no such register, or it could not be written."),
            ),
            words=True,
        ),
        Bus(
            "wishbone",
            "Wishbone B4, classic cycles, 32 bits",
            (
                _into("wb_adr_i", _ADDRESS, "Byte address; its two lowest bits are ignored."),
                _into("wb_dat_i", WORD, "Data to be written."),
                _out("wb_dat_o", WORD, "Data read, valid with wb_ack_o."),
                _into("wb_sel_i", WORD // 8, "Bytes to be written."),
                _into("wb_we_i", 1, "Write, not read."),
                _into("wb_cyc_i", 1, "A bus cycle is under way."),
                _into("wb_stb_i", 1, "An access is wanted."),
                _out("wb_ack_o", 1, "The access is done."),
                _out("wb_err_o", 1, "The access is done, and there is no such register, or it cannot be written."),
            ),
        ),
        Bus(
            "apb",
            "APB3 without wait states, 32 bits",
            (
                _into("s_apb_paddr", _ADDRESS, "Byte address; its two lowest bits are ignored."),
                _into("s_apb_psel", 1, "An access is wanted."),
                _into("s_apb_penable", 1, "The second clock of the access."),
                _into("s_apb_pwrite", 1, "Write, not read."),
                _into("s_apb_pwdata", WORD, "Data to be written."),
                _out("s_apb_pready", 1, "Always 1."),
                _out("s_apb_prdata", WORD, "Data read, valid in the second clock."),
                _out("s_apb_pslverr", 1, "In the second clock: there is no such register, or it cannot be written."),
            ),
        ),
        Bus(
            "axi-lite",
            "AXI4-Lite, 32 bits",
            (
                _into("s_axi_awaddr", _ADDRESS, "Byte address of a write; its two lowest bits are ignored."),
                _into("s_axi_awprot", 3, "Ignored."),
                _into("s_axi_awvalid", 1, "There is a write address."),
                _out("s_axi_awready", 1, "The write address is taken."),
                _into("s_axi_wdata", WORD, "Data to be written."),
                _into("s_axi_wstrb", WORD // 8, "Bytes to be written."),
                _into("s_axi_wvalid", 1, "There are data to be written."),
                _out("s_axi_wready", 1, "The data to be written are taken."),
                _out("s_axi_bresp", 2, "0: written; 2: there is no such register, or it cannot be written."),
                _out("s_axi_bvalid", 1, "There is the answer to a write."),
                _into("s_axi_bready", 1, "The answer to a write is taken."),
                _into("s_axi_araddr", _ADDRESS, "Byte address of a read; its two lowest bits are ignored."),
                _into("s_axi_arprot", 3, "Ignored."),
                _into("s_axi_arvalid", 1, "There is a read address."),
                _out("s_axi_arready", 1, "The read address is taken."),
                _out("s_axi_rdata", WORD, "Data read."),
                _out("s_axi_rresp", 2, "0: read; 2: there is no such register."),
                _out("s_axi_rvalid", 1, "There is the answer to a read."),
                _into("s_axi_rready", 1, "The answer to a read is taken."),
            ),
        ),
        Bus(
            "spi",
            f"SPI, mode 0, sck at most the clock over {SPI_SCK_CYCLES}",
            (
                _into("spi_sck", 1, f"SPI clock, asynchronous; at most that of the core over {SPI_SCK_CYCLES}."),
                _into("spi_mosi", 1, "Data to the core, asynchronous; sampled when spi_sck rises."),
                _into("spi_cs_n", 1, "Chip select, asynchronous, active low."),
                _out(
                    "spi_miso",
                    1,
                    "Data from the core; changes after spi_sck fell, 0 when not selected. Where others share the line, "
                    "drive its pin only while the pin of spi_cs_n is low.",
                ),
            ),
            idle={"spi_cs_n": 1},
            address_bits=SPI_ADDRESS_WIDTH,
            asynchronous=("spi_sck", "spi_mosi", "spi_cs_n"),
        ),
        Bus(
            "uart",
            "UART, 8 bits, no parity, 1 stop bit, with frames and a CRC, see --baud",
            (
                _into(
                    "uart_rx",
                    1,
                    f"Line to the core, asynchronous; high when idle. A frame begins after {QUIET_BITS} bits of idle.",
                ),
                _out("uart_tx", 1, "Line from the core; high when idle."),
            ),
            idle={"uart_rx": 1},
            asynchronous=("uart_rx",),
            baud=DEFAULT_BAUD,
            address_bits=UART_ADDRESS_WIDTH,
        ),
    )
}


def bus_of(name: str, baud: int | None = None, *, irq: bool = False) -> Bus | None:
    """Return the bus of a name, with these bits a second if they are given, and an interrupt; None for `none`.

    It raises ParameterError if there is none of this name, or it has no bits a second of its own; if they are none; if
    there is an interrupt without a bus.
    """
    if name != "none" and name not in BUSES:
        raise ParameterError("bus", f"must be one of none, {', '.join(BUSES)}, not {name!r}")
    bus = BUSES.get(name)
    if irq:
        if bus is None:
            raise ParameterError("irq", "must be given together with a bus, which clears its events")
        bus = replace(bus, irq=True)
    if baud is None:
        return bus
    if bus is None or not bus.baud:
        with_baud = ", ".join(other.name for other in BUSES.values() if other.baud)
        raise ParameterError("baud", f"must be given together with a bus that has it, {with_baud}, not {name}")
    if baud < 1:
        raise ParameterError("baud", f"must be at least 1, not {baud}")
    return replace(bus, baud=baud)


def ports_on(spec: AnySpec, bus: Bus | None) -> tuple[Port, ...]:
    """Return all ports of a core, with those of the bus on which its registers are."""
    if bus is None:
        return spec.ports
    registers = registers_on(spec, bus)
    return distinct((*registers.core_ports, *bus.ports(registers)), bus)


def distinct(ports: tuple[Port, ...], bus: Bus) -> tuple[Port, ...]:
    """Return ports of a core on a bus; ParameterError if two have one name."""
    if len({port.name for port in ports}) < len(ports):
        raise ParameterError("bus", f"must not be {bus.name}, whose pins have the names of the encoder's")
    return ports


def registers_on(spec: AnySpec, bus: Bus) -> RegisterMap:
    """Return all registers of a core on a bus; ParameterError if it can have none."""
    return replace(registers_of(spec), irq=bus.irq)


def manifest_on(registers: RegisterMap, bus: Bus, name: str = "tachometer") -> dict[str, Any]:
    """Return the manifest of a core on a bus.

    It raises ParameterError if `name` cannot be the name of a module; if the clock cannot make the bits of the bus.
    """
    ports = bus.ports(registers)
    if name in {port.name for port in ports}:
        raise ParameterError("name", f"must not be the name of a port: {name!r}")
    described = manifest(registers.core, name)
    described["ports"] = [described_port(port) for port in (*registers.core_ports, *ports)]
    described |= {"bus": bus.name, **({"irq": True} if registers.irq else {}), "registers": registers.described()}
    if bus.baud:
        described |= {"baud": bus.baud, "bit_cycles": bus.bit_cycles(registers.spec.timing.clock_hz)}
    return described
