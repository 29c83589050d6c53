"""Real bitstreams, with the tools of the extra `boards`. `make bitstreams` runs this, `make test` does not.

What is missing fails here, and skips nothing.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from amaranth.build import Clock
from support import gate_level
from support.command import run

from tachometry.boards.fpga import build as builder
from tachometry.boards.fpga.boards import BOARDS
from tachometry.boards.fpga.timing import TimingError
from tachometry.boards.fpga.top import component
from tachometry.spec import of_texts
from tachometry.spec.registers import frames
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.demo import DemoMap
from tachometry.spec.registers.map import IDENTIFICATION

OPEN = [name for name, board in BOARDS.items() if board.flow is not None]
OF_EVERY_FAMILY = ["tang-nano-9k", "icebreaker", "ulx3s-25f"]
CORE = ["--ppr", "500", "--max-speed", "1000rad/s", "--filter", "4"]


@pytest.mark.parametrize("name", OPEN)
def test_a_bitstream_of_every_board(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("build", name, *CORE, "-o", tmp_path) == 0, capsys.readouterr().err
    described = json.loads((tmp_path / "tachometer.json").read_text())["board"]
    assert (tmp_path / described["bitstream"]).stat().st_size > 50_000


@pytest.mark.parametrize("method", ["m", "t", "mt", "rairan"])
@pytest.mark.parametrize("name", OF_EVERY_FAMILY)
def test_every_method_meets_the_timing(
    name: str, method: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("build", name, *CORE, "--method", method, "-o", tmp_path) == 0, capsys.readouterr().err


@pytest.mark.parametrize("bus", ["uart", "spi"])
@pytest.mark.parametrize("name", OF_EVERY_FAMILY)
def test_equal_options_give_equal_bitstreams(name: str, bus: str, tmp_path: Path) -> None:
    """With all pins that there are."""
    words = [*CORE, "--index", "--external-tick", "--bus", bus]
    for folder in ("first", "second"):
        assert run("build", name, *words, "-o", tmp_path / folder) == 0
    first, second = (
        {file.name: file.read_bytes() for file in (tmp_path / one).iterdir()} for one in ("first", "second")
    )
    assert first == second


@pytest.mark.parametrize("name", OF_EVERY_FAMILY)
def test_a_clock_that_is_too_fast_fails(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A design is held against four hundred megahertz: no tool and no log says that it is good for that."""
    monkeypatch.setattr(builder, "SEEDS", range(1, 3))
    board, bus = BOARDS[name], bus_of("uart")
    assert bus is not None

    def faster() -> Any:
        platform = board.platform()
        platform.lookup(platform.default_clk).clock = Clock(400e6)
        return platform

    spec = of_texts("s", {"ppr": "500", "clock": str(board.clock_hz)})
    with pytest.raises(TimingError, match=r"^timing is not met: \S+ is good for [0-9.]+ MHz, not 400 MHz"):
        builder.build(component(spec, bus), replace(board, clock_hz=400_000_000, platform=faster), lambda what: None)


EDGE, REST = 43, 300  # clocks between two edges, and those in which the FPGA comes out of reset


def stimulus(request: bytes, begin: int, end: int) -> list[tuple[int, int, int]]:
    """Return a shaft that turns forward, and a request to the core."""
    bit_cycles = 12
    bits = "".join(f"0{f'{byte:08b}'[::-1]}1" for byte in request)
    line = "1" * begin + "".join(bit * bit_cycles for bit in bits)
    line += "1" * (end - len(line))
    turns = ((0, 0), (1, 0), (1, 1), (0, 1))
    shaft = (turns[max(clock - REST, 0) // EDGE % 4] for clock in range(end))
    return [(a, b, int(rx)) for (a, b), rx in zip(shaft, line, strict=True)]


def test_the_netlist_of_the_icebreaker_says_the_same(tmp_path: Path) -> None:
    """Every clock of its UART is that of the core as it was written, and what it says is right."""
    spec = of_texts("s", {"ppr": "500", "clock": "12MHz", "max-speed": "1000rad/s", "filter": "4"})
    registers = DemoMap(spec)
    n_words = len(registers.registers)
    request = frames.read_request(0, n_words, 5)
    levels = stimulus(request, 6000, 6000 + 120 * (len(request) + frames.answer_length(request) + 2))
    gate_level.make(spec, tmp_path)
    gates, written = (gate_level.sent(form, levels, tmp_path) for form in (gate_level.GATES, gate_level.WRITTEN))
    assert gates[REST:] == written[REST:]
    answer = frames.decode_answer(request, gate_level.characters(gates[REST:], 12))
    words = {register.name: answer.words[register.offset // 4] for register in registers}
    assert words["IDENTIFICATION"] == IDENTIFICATION
    assert words["CONFIGURATION"] == registers.configuration
    # One count in the ticks over which it was measured is what the method cannot tell.
    velocity = words["VELOCITY"] * 2.0**-spec.velocity.frac_bits
    assert velocity == pytest.approx(spec.timing.tick_cycles / EDGE, abs=1 / words["INTERVAL"])

    # An edge less is seen, so the comparison could fail.
    other = [*levels[:REST], *levels[REST + EDGE :], *levels[-EDGE:]]
    assert gate_level.sent(gate_level.GATES, other, tmp_path)[REST:] != written[REST:]
