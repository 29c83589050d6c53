"""Ports are on the pins that boards have for them, and vendors' tools get projects."""

import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator, Mapping
from io import BytesIO
from types import SimpleNamespace
from typing import Any

import pytest
from amaranth import Module
from amaranth.lib import io, wiring
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator
from support.nightly import only, only_rows
from support.simulate import clock_by_clock

from tachometry.boards.fpga.board import Board
from tachometry.boards.fpga.boards import BOARDS
from tachometry.boards.fpga.build import build, prepared
from tachometry.boards.fpga.capture_pin import CapturePin
from tachometry.boards.fpga.top import BoardTop, component
from tachometry.spec import of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.registers.buses import BUSES, bus_of

EVERYTHING = {"ppr": "9", "index": "yes", "external-tick": "yes", "max-speed": "1000rad/s"}
OF_EVERY_KIND = [name for name in BOARDS if not name.startswith("ulx3s") or name == "ulx3s-85f"]
LIT_BY_ZERO = {"tang-nano-9k", "icebreaker"}


def core(board: Board, bus: str, *, loop: bool = False, **texts: str) -> Any:
    on = bus_of(bus)
    assert on is not None
    spec = of_texts("s", {**EVERYTHING, **texts, "clock": str(board.clock_hz)})
    return component(LoopSpec(tachometer=spec, gains="inputs") if loop else spec, on)


class Platform:
    """Stands for one of amaranth-boards: pins are signals; LEDs are lit by 0."""

    def __init__(self) -> None:
        self.pins: dict[str, io.SimulationPort] = {}

    def add_resources(self, resources: list[Any]) -> None:
        (self.resource,) = resources

    def request(self, name: str, number: int = 0, *, dir: str) -> Any:
        assert dir == "-"
        if name == "led":
            return self._pin(f"led{number}", "o", invert=True)
        if name == "uart":
            return SimpleNamespace(rx=self._pin("rx", "i"), tx=self._pin("tx", "o"))
        return SimpleNamespace(**{part.name: self._pin(part.name, part.ios[0].dir) for part in self.resource.ios})

    def _pin(self, name: str, direction: str, *, invert: bool = False) -> io.SimulationPort:
        self.pins[name] = io.SimulationPort(direction, 1, name=name, invert=invert)
        return self.pins[name]


class Loop(wiring.Component):  # type: ignore[misc]
    """Has ports as a core on a board has, each output the inverse of an input, or a number."""

    def __init__(self) -> None:
        inputs = ("a", "b", "z", "tick_in", "capture", "uart_rx", "spi_cs_n")
        outputs = ("emulated_a", "emulated_b", "emulated_z", "uart_tx", "spi_miso", "captured", "velocity_valid")
        super().__init__(
            {**dict.fromkeys(inputs, In(1)), **dict.fromkeys(outputs, Out(1)), "leds": Out(4), "velocity": Out(20)}
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.d.comb += [
            self.emulated_a.eq(~self.a),
            self.emulated_b.eq(~self.b),
            self.emulated_z.eq(~self.z),
            self.uart_tx.eq(~self.uart_rx),
            self.spi_miso.eq(self.tick_in),
            self.leds.eq(5),
        ]
        m.d.sync += self.captured.eq(self.captured ^ self.capture)
        return m


def captures(levels: str) -> str:
    """Return what a capture pin says of levels, clock by clock."""
    seen = clock_by_clock(CapturePin(), [{"pin": int(level)} for level in levels], ["capture"])
    return "".join(str(row["capture"]) for row in seen)


def test_ports_are_on_their_pins() -> None:
    board, platform, loop = BOARDS["icebreaker"], Platform(), Loop()
    m = Module()
    m.submodules.top = BoardTop(loop, board).elaborate(platform)

    async def bench(ctx: Any) -> None:
        pins = platform.pins
        assert pins.keys() == {part.name for part in platform.resource.ios} | {"rx", "tx", "led0", "led1"}
        for one in (0, 1):
            for source, sink in [("a", "emulated_a"), ("b", "emulated_b"), ("z", "emulated_z"), ("rx", "tx")]:
                ctx.set(pins[source].i, one)
                assert ctx.get(pins[sink].o) == 1 - one, source
            ctx.set(pins["tick_in"].i, one)
            ctx.set(pins["spi_cs_n"].i, one)
            assert (ctx.get(pins["spi_miso"].o), ctx.get(pins["spi_miso"].oe)) == (one, 1 - one)
        assert [ctx.get(pins[f"led{number}"].o) for number in range(board.leds)] == [0, 1]
        await ctx.tick().repeat(4)
        ctx.set(pins["capture"].i, 1)
        await ctx.tick().repeat(8)
        assert ctx.get(loop.captured) == 1

    simulator = Simulator(m)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()


def test_a_rise_of_the_pin_captures_once() -> None:
    assert "1" not in captures("1" * 12)  # nothing is connected
    assert "1" not in captures("0" * 12)
    assert captures("000000111111") == "000000001000"
    assert captures("111110100011") == "000000001000"[:9] + "000"
    assert captures("0000001011100000") == "0000000010100000"


def lines_of(files: Mapping[str, Any]) -> Iterator[str]:
    for name, content in files.items():
        if name.endswith((".pcf", ".lpf", ".cst", ".xdc", ".qsf")):
            yield from (content if isinstance(content, str) else content.decode()).splitlines()


PULL_UP = {
    "tang-nano-9k": 'IO_PORT "{}" PULL_MODE=UP;',
    "arty-a7-35": 'set_property PULLUP "TRUE" [get_ports "{}"]',
    "de10-nano": 'set_instance_assignment -to "{}" -name weak_pull_up_resistor "on"',
    **{name: 'IOBUF PORT "{}" IO_TYPE=LVCMOS33 PULLMODE=UP;' for name in BOARDS if name.startswith("ulx3s")},
}


# Each board once, and both buses; the loop comes with the UART.
@pytest.mark.parametrize(
    ("name", "bus"),
    only_rows(
        [("icebreaker", "uart"), *((name, "spi") for name in OF_EVERY_KIND)],
        [(name, bus) for name in OF_EVERY_KIND for bus in ("uart", "spi")],
    ),
)
def test_every_board_has_pins_for_every_port(name: str, bus: str) -> None:
    """Of a core with a control loop where the bus is a UART."""
    board = BOARDS[name]
    design = core(board, bus, loop=bus == "uart")
    wanted = {"a", "b", "z", "tick_in", "capture", "emulated_a", "emulated_b", "emulated_z"}
    wanted |= {line.name for line in BUSES[bus].lines} if bus == "spi" else {"current_pdm", "enable"}
    assert wanted == board.pins.keys() & design.signature.members.keys()
    plan = prepared(design, board)
    lines = [*lines_of(plan.files)]
    inputs = wanted - {"spi_miso", "emulated_a", "emulated_b", "emulated_z", "current_pdm"}
    for port in wanted:
        signal = f"tachometer_0__{port}__io"
        assert any(signal in line for line in lines), port
        if name in PULL_UP:
            assert (PULL_UP[name].format(signal) in lines) == (port in inputs), port
    if name == "icebreaker":
        assert plan.files["top.il"].count("parameter \\PULLUP 1\n") == len(inputs) + 2 * (bus == "uart")
        assert "synth_ice40 -device u -dsp -top top" in plan.files["top.ys"]
    assert any("uart_0__tx__io" in line for line in lines) == (bus == "uart")
    assert not any("/site-packages/" in str(content) for content in plan.files.values())


# Lines of encoders that are read, that of the encoder first, and the ports whose pins they have.
READ = {
    "sensor=spi chip=amt22": ("spi_miso spi_sck spi_cs_n spi_mosi", "spi_miso spi_sck spi_cs_n spi_mosi"),
    "sensor=ssi": ("encoder_data encoder_clock", "a b"),
    "sensor=tformat": ("rs485_rx rs485_tx rs485_de", "a b z"),
}


@pytest.mark.parametrize("encoder", only([*READ][:1], READ))
def test_the_lines_of_an_encoder_that_is_read_have_pins(encoder: str) -> None:
    board, on = BOARDS["ulx3s-12f"], bus_of("uart")
    assert on is not None
    texts = {"bits": "12", "clock": str(board.clock_hz), "tick": "1ms", **dict(re.findall(r"(\w+)=(\w+)", encoder))}
    files = prepared(component(of_texts("m", texts), on), board).files
    lines = [*lines_of(files)]
    ports, others = (words.split() for words in READ[encoder])
    assert f"connect \\{ports[1]} 1'" not in files["top.il"]  # always of one level
    for port, other in zip((*ports, f"emulated_{ports[0]}"), (*others, "emulated_a"), strict=True):
        assert board.pins[port] == board.pins[other]
        assert any(f"tachometer_0__{port}__io" in line for line in lines)


@pytest.mark.parametrize("name", BOARDS)
def test_pins_are_no_others(name: str) -> None:
    """No pin of a header is used twice, or is one of the UART, the clock or an LED."""
    board = BOARDS[name]
    platform = board.platform()
    platform.add_resources([BoardTop(Loop(), board)._resource()])
    places: list[str] = []
    for resource, number in [("tachometer", 0), ("uart", 0), (platform.default_clk, 0)]:
        part = platform.lookup(resource, number)
        for pins in [part.ios[0]] if len(part.ios) == 1 else [one.ios[0] for one in part.ios]:
            if hasattr(pins, "map_names"):
                places += pins.map_names(platform._conn_pins, part)
    for number in range(board.leds):
        led = platform.lookup("led", number).ios[0]
        assert led.invert == (name in LIT_BY_ZERO)
        places += led.map_names(platform._conn_pins, led)
    assert len(set(places)) == len(places) >= 12


@pytest.mark.parametrize("name", BOARDS)
def test_clocks_are_those_of_the_oscillators(name: str) -> None:
    board = BOARDS[name]
    platform = board.platform()
    assert platform.default_clk_frequency == board.clock_hz


@pytest.mark.parametrize(
    ("name", "files", "lines"),
    [
        (
            "arty-a7-35",
            {"build_top.sh", "build_top.bat", "top.tcl", "top.xdc", "top.v"},
            ["create_clock -name clk100_0__io -period 10.0", "xc7a35ticsg324-1L"],
        ),
        (
            "de10-nano",
            {"build_top.sh", "build_top.bat", "top.qsf", "top.sdc", "top.v"},
            ['create_clock -name "clk50_0__io" -period 20.0', "DEVICE 5CSEBA6U23I7"],
        ),
    ],
)
def test_projects_are_whole_and_always_the_same(name: str, files: set[str], lines: list[str]) -> None:
    board = BOARDS[name]
    said: list[str] = []
    # A small design is enough: a whole core is in the test of the pins.
    first, second = (build(Loop(), board, said.append) for _ in range(2))
    assert first.content == second.content
    assert (first.suffix, first.cells, first.fmax, first.seed) == (".zip", {}, None, None)
    assert first.tools.keys() == {"amaranth", "amaranth-boards"}
    with zipfile.ZipFile(BytesIO(first.content)) as archive:
        texts = {file: archive.read(file).decode() for file in archive.namelist()}
    assert files <= texts.keys()
    for line in lines:
        assert any(line in text for text in texts.values()), line
    assert said == ["elaborating"] * 2


_DIGEST = """
import hashlib, sys
from tachometry.boards.fpga.boards import BOARDS
from tachometry.boards.fpga.build import prepared
from tachometry.boards.fpga.top import component
from tachometry.spec import of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.registers.buses import bus_of
board = BOARDS["icebreaker"]
spec = of_texts("s", {"ppr": "9", "index": "yes", "age": "yes", "bounds": "yes", "clock": str(board.clock_hz)})
print(hashlib.sha256(prepared(component(spec, bus_of("uart")), board).files["top.il"].encode()).hexdigest())
"""


def test_the_order_of_sets_makes_no_difference() -> None:
    """Which Python chooses anew in every process, if nothing is said."""
    said = set()
    for seed in ("1", "2"):
        command = [sys.executable, "-c", _DIGEST]
        done = subprocess.run(command, env=os.environ | {"PYTHONHASHSEED": seed}, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        said.add(done.stdout)
    assert len(said) == 1
