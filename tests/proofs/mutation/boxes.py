"""Registers, bridges and the demo with its emulator and telemetry are mutated beside the methods.

The tests of these boxes hold them against their golden models; here it is counted which mutants what is played there
tells from the right one. The accesses do not wait for answers where these come after a number of clocks that is known.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from amaranth.lib import wiring
from numpy.typing import NDArray
from proofs.mutation.axes import AXES, EXTRAS
from proofs.mutation.cases import Case, Pins
from proofs.mutation.commands import COMMANDS
from proofs.mutation.loops import LOOPS
from proofs.mutation.stimulus import Stimulus, noise_lines, stimulus
from support.serial import SpiHost, UartHost

from tachometry.hdl.core.bus_tachometer import BusTachometer
from tachometry.hdl.core.demo import Demo
from tachometry.spec import Port, of_texts
from tachometry.spec.registers import frames
from tachometry.spec.registers.buses import BUSES, Bus, ports_on
from tachometry.spec.registers.demo import DemoMap
from tachometry.spec.registers.map import RegisterMap

Lines = dict[str, NDArray[np.uint64]]

_SPEC = of_texts(
    "s",
    {
        "ppr": "4",
        "clock": "80kHz",
        "tick": "100us",
        "max-time": "800us",
        "position-width": "8",
        "filter": "2",
        "index": "1",
    }
    | {"age": "yes", "velocity-width": "12", "frac-bits": "4"},
)
_BIT_CYCLES = 8  # of a UART
_LONGER = 10  # times as many clocks for a demo: what its settings do is slow
_SERIAL = {"spi_sck", "spi_mosi", "spi_cs_n", "uart_rx"}


@dataclass(frozen=True)
class Box(Case):
    """A core on a bus, or the demo.

    - `lines`: Levels of the lines of the bus.
    - `sources`: Where the lines of the HDL are that are mutated.
    """

    bus: str = "native"
    demo: bool = False
    lines: Callable[[np.random.Generator, RegisterMap, int], Lines] | None = None
    sources: str = "hdl/bus/*"

    @property
    def selection(self) -> str:  # type: ignore[override]
        """Cells of these sources."""
        return f"a:src=*{self.sources} t:* %i"

    group = "registers"

    @property
    def on(self) -> Bus:
        """The bus; a UART has 8 clocks in a bit."""
        return replace(BUSES[self.bus], baud=self.spec.timing.clock_hz // _BIT_CYCLES if BUSES[self.bus].baud else 0)

    @property
    def registers(self) -> RegisterMap:
        """Of the core."""
        return DemoMap(self.spec) if self.demo else RegisterMap(self.spec)

    @property
    def component(self) -> wiring.Component:
        """The hardware."""
        bus, registers = self.on, self.registers
        return Demo(registers, bus) if isinstance(registers, DemoMap) else BusTachometer(registers, bus)

    @property
    def pins(self) -> Pins:
        """Ports; the outputs are those of the bus and of the demo."""
        lines = self.on.ports(self.registers)
        inputs = [port for port in ports_on(self.spec, None) if port.direction == "input" and port.name != "clk"]
        inputs += [port for port in lines if port.direction == "input" and not (self.demo and port.name == "capture")]
        outputs = [port for port in lines if port.direction == "output"]
        if self.demo:
            more = {"emulated_a": 1, "emulated_b": 1, "emulated_z": 1, "leds": 4}
            outputs += [Port(name, "output", width) for name, width in more.items()]
        return Pins(tuple(replace(port, signed=False) for port in inputs), tuple(outputs))

    def play(self, n_clocks: int) -> Stimulus:
        """Return the encoder turns, with resets in the middle, and the bus is used all the time."""
        rng = np.random.default_rng(1)
        n_clocks *= _LONGER if self.demo else 1
        of_core = stimulus(self.spec, n_clocks).pins[:n_clocks, 0]
        assert self.lines is not None
        levels = self.lines(rng, self.registers, n_clocks)
        if self.demo:  # settings would not live long
            of_core = of_core & ~np.uint64(1) | (rng.random(n_clocks) < 2e-5).astype(np.uint64)
            of_core[0] |= np.uint64(1)
        ports = {port.name: of_core >> np.uint64(place) for place, port in enumerate(self.pins.inputs)}
        return Stimulus(self.pins.words(n_clocks, ports | levels), [], [])


def _held(rng: np.random.Generator, width: int, begins: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Return a random word that changes where something begins."""
    words = rng.integers(0, 1 << width, len(begins), dtype=np.uint64)
    return words[np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))]


def _address(rng: np.random.Generator, registers: RegisterMap, begins: NDArray[np.bool_], low: int) -> Lines:
    """Return addresses, among them often those that matter most, and data of which some are small."""
    width = registers.address_width - 2
    address = _held(rng, width, begins)
    often = np.array([registers[name].offset // 4 for name in ("VELOCITY", "CONTROL", "COUNTERS")], dtype=np.uint64)
    chosen = _held(rng, 2, begins)
    address = np.where(chosen < len(often), often[np.minimum(chosen, 2)], address)
    return {"address": address << np.uint64(low) | (_held(rng, low, begins) if low else np.uint64(0))}


def _bits(condition: NDArray[np.bool_]) -> NDArray[np.uint64]:
    return condition.astype(np.uint64)


def _rare(rng: np.random.Generator, n_clocks: int, rates: Sequence[float] = (0.02, 0.2, 0.5)) -> NDArray[np.bool_]:
    """Return random clocks, at rates that change."""
    rate = np.repeat(rng.choice(rates, -(-n_clocks // 2000)), 2000)[:n_clocks]
    return rng.random(n_clocks) < rate


def _captures(rng: np.random.Generator, n_clocks: int) -> Lines:
    return {"capture": _bits(_rare(rng, n_clocks, (0, 0.01, 0.5)))}


def _native(rng: np.random.Generator, registers: RegisterMap, n_clocks: int) -> Lines:
    access = _rare(rng, n_clocks) | (rng.random(n_clocks) < 0.2)
    every = np.ones(n_clocks, dtype=bool)
    writes = rng.random(n_clocks) < 0.1
    address = _address(rng, registers, every, 0)["address"]
    # In the second half only the counters are read, so that they reach their ends.
    counting = np.arange(n_clocks) > n_clocks // 2
    captures = _captures(rng, n_clocks)["capture"]
    return {
        "reg_address": np.where(counting, np.uint64(registers["COUNTERS"].offset // 4), address),
        "reg_read": _bits(access & ~writes | counting),
        "reg_write": _bits(access & writes & ~counting),
        "reg_write_data": _held(rng, 32, every),
        "capture": np.where(counting, np.uint64(0), captures),
    }


def _two_clocks(rng: np.random.Generator, n_clocks: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the first clock of accesses of two clocks, and the second."""
    first = _rare(rng, n_clocks)
    for clock in np.flatnonzero(first).tolist():
        if first[max(clock - 1, 0)] and clock:
            first[clock] = False
    second = np.append(False, first[:-1])
    return first, second


def _wishbone(rng: np.random.Generator, registers: RegisterMap, n_clocks: int) -> Lines:
    first, second = _two_clocks(rng, n_clocks)
    second &= rng.random(n_clocks) < 0.9  # the master may give up
    return {
        "wb_adr_i": _address(rng, registers, first, 2)["address"],
        "wb_dat_i": _held(rng, 32, first),
        "wb_sel_i": _held(rng, 4, first) | _held(rng, 1, first),
        "wb_we_i": _held(rng, 1, first) & _held(rng, 1, first),
        "wb_cyc_i": _bits(first | second | (rng.random(n_clocks) < 0.2)),
        "wb_stb_i": _bits(first | second | (rng.random(n_clocks) < 0.2)),
        **_captures(rng, n_clocks),
    }


def _apb(rng: np.random.Generator, registers: RegisterMap, n_clocks: int) -> Lines:
    first, second = _two_clocks(rng, n_clocks)
    return {
        "s_apb_paddr": _address(rng, registers, first, 2)["address"],
        "s_apb_psel": _bits(first | second),
        "s_apb_penable": _bits(second),
        "s_apb_pwrite": _held(rng, 1, first) & _held(rng, 1, first),
        "s_apb_pwdata": _held(rng, 32, first),
        **_captures(rng, n_clocks),
    }


def _axi_lite(rng: np.random.Generator, registers: RegisterMap, n_clocks: int) -> Lines:
    valid = ("s_axi_awvalid", "s_axi_wvalid", "s_axi_bready", "s_axi_arvalid", "s_axi_rready")
    lines = dict(zip(valid, noise_lines(rng, n_clocks, len(valid)).astype(np.uint64), strict=True))
    every = np.ones(n_clocks, dtype=bool)
    return {
        **lines,
        "s_axi_awaddr": _address(rng, registers, every, 2)["address"],
        "s_axi_awprot": _held(rng, 3, every),
        "s_axi_wdata": _held(rng, 32, every),
        "s_axi_wstrb": _held(rng, 4, every),
        "s_axi_araddr": _address(rng, registers, every, 2)["address"],
        "s_axi_arprot": _held(rng, 3, every),
        **_captures(rng, n_clocks),
    }


def _control(registers: RegisterMap) -> tuple[int, int, int, int]:
    control, velocity, n_words = (
        *(registers[name].offset // 4 for name in ("CONTROL", "VELOCITY")),
        len(registers.registers),
    )
    return control, velocity, n_words, n_words - velocity


def _spi(rng: np.random.Generator, registers: RegisterMap, n_clocks: int) -> Lines:
    host = SpiHost(rng, 10, registers.address_width - 2)
    while host.time < n_clocks:
        host.random_frame(*_control(registers))
    return {name: line.astype(np.uint64) for name, line in host.lines(n_clocks).items()} | _captures(rng, n_clocks)


def _uart(rng: np.random.Generator, registers: RegisterMap, n_clocks: int) -> Lines:
    host = UartHost(rng, 10, registers.address_width - 2, _BIT_CYCLES)
    while host.time < n_clocks:
        host.random_exchange(*_control(registers))
        if rng.random() < 0.3:
            host.random_damage(*_control(registers))
    return {name: line.astype(np.uint64) for name, line in host.lines(n_clocks).items()} | _captures(rng, n_clocks)


def _settings(rng: np.random.Generator, registers: RegisterMap, n_clocks: int) -> Lines:
    """Return settings of all kinds, reads of all registers, and telemetry now and then."""
    writable = [register for register in registers if register.writable]
    line = np.ones(n_clocks, dtype=np.uint64)
    at = (frames.QUIET_BITS + 4) * _BIT_CYCLES
    while at < n_clocks:
        if rng.random() < 0.75:
            register = writable[int(rng.integers(len(writable)))]
            data = int(rng.integers(1 << 32)) >> int(rng.integers(32))
            if register.name == "TELEMETRY":
                data = int(rng.choice([0, 90, 600, 700, 2100, 4200]))
            elif register.name == "SPEED":
                data = (int(rng.integers(-1 << 31, 1 << 31)) >> int(rng.integers(1, 12))) % (1 << 32)
            elif register.name == "DEMO":
                data = int(rng.choice([0, 1, 1, 1, 2, 3, 4, 5]))
            request, answer = frames.write_request(register.offset // 4, data, int(rng.integers(16))), 4
        else:
            first = int(rng.integers(len(registers.registers) + 1))
            n_words = int(rng.integers(1, 6))
            request, answer = frames.read_request(first, n_words, int(rng.integers(16))), 4 + 4 * n_words
        bits = [bit for byte in request for bit in (0, *(byte >> k & 1 for k in range(8)), 1)]
        levels = np.repeat(bits, _BIT_CYCLES)[: n_clocks - at]
        line[at : at + len(levels)] = levels
        at += (len(bits) + 10 * answer + frames.QUIET_BITS + int(rng.integers(10, 100))) * _BIT_CYCLES
    return {"uart_rx": line}


BOXES: list[Case] = [
    Box("registers, native", replace(_SPEC, filter_clocks=0), 120, bus="native", lines=_native),
    Box("wishbone", _SPEC, 40, bus="wishbone", lines=_wishbone, sources="hdl/bus/wishbone.py*"),
    Box("apb", _SPEC, 40, bus="apb", lines=_apb, sources="hdl/bus/apb.py*"),
    Box("axi-lite", _SPEC, 60, bus="axi-lite", lines=_axi_lite, sources="hdl/bus/axi_lite.py*"),
    Box("spi", _SPEC, 80, bus="spi", lines=_spi, sources="hdl/bus/spi.py*"),
    Box("uart", _SPEC, 80, bus="uart", lines=_uart, sources="hdl/bus/uart.py*"),
    Box("emulator", _SPEC, 100, bus="uart", demo=True, lines=_settings, sources="hdl/core/*"),
    Box("modulo", replace(_SPEC, position_modulo="24"), 40, lines=_native, sources="hdl/core/register_core.py*"),
    Box("telemetry", _SPEC, 60, bus="uart", demo=True, lines=_settings, sources="hdl/bus/telemetry.py*"),
    *AXES,
    *EXTRAS,
    *LOOPS,
    *COMMANDS,
]
