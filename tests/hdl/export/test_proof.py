"""The exported text is the circuit of Amaranth's netlist, as Yosys writes it; a text that is not is refused."""

import re
import subprocess
from functools import cache
from pathlib import Path

import pytest
from support.compiled import YOSYS, lint, read_exported
from support.nightly import nightly, only

from tachometry.hdl.export.files import both_texts
from tachometry.sim.encoder.stress import stress_of
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.studies.lockstep import lockstep
from tachometry.sim.studies.pairs import AXES, WHEELS, configurations, core_of
from tachometry.sim.testbench.proof import differences
from tachometry.spec import METHODS, of_options
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.registers.buses import bus_of

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


# The loop is in tests/sim/engines/test_gate_loop.py.
@pytest.mark.parametrize("kind", only(["s", "axes"], [kind for kind in KINDS if kind != "loop"]))
def test_the_exported_text_is_right_in_cxxrtl(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """`tests/test_matrix.py` has the same in Verilator, and `tests/test_random_cores.py` in Icarus."""
    options, bus = KINDS[kind]
    read_exported(monkeypatch, bus_of(bus))
    words = options.replace(" probe=2", "").split()  # on a bus, a register arms the probe
    spec = of_options(dict(word.split("=", 1) for word in words))
    assert not isinstance(spec, LoopSpec)
    found = lockstep(spec, stress_of(spec, 1, 200), Cxxrtl())
    assert found.n_mismatches == 0, found.first
    assert len(found.actual.updates.clock) > 50


@nightly
@pytest.mark.parametrize("kind", [*METHODS, "axes"])
def test_every_pair_of_options(kind: str) -> None:
    cores = configurations(kind) if kind in METHODS else (*AXES, *WHEELS)
    assert {words: found for words in cores if (found := wrong(core_of(words)))} == {}


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
        (r"(table_\[3\] = \d+'h.*).;", r"\g<1>f;", "INIT"),
        (r"table_\[(?=\w+\];)", "table_[~", "Unproven"),
    ],
    ids=["compared", "added", "initial", "chosen", "reset", "loaded", "edge", "contents", "address"],
)
def test_a_mutant_is_refused(right: str, mutant: str, message: str) -> None:
    gold, text, names = texts("s with a table" if "table" in right else "s")
    changed = re.sub(right, mutant, text, count=1)
    assert changed != text
    found = differences(gold, changed, "core", names, YOSYS)
    assert found
    assert all(message in one for one in found), found
