"""The exported text is the circuit of Amaranth's netlist, as Yosys writes it; a text that is not is refused."""

import re
import subprocess
from pathlib import Path

import pytest
from support.compiled import YOSYS, lint, read_exported
from support.nightly import nightly, only, only_rows
from support.script import load
from support.verilog import LintingVerilator, run_in_icarus

from tachometry.hdl.export.files import both_texts
from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress_of
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.signals.axes import Trace
from tachometry.sim.signals.run import compare
from tachometry.sim.studies.lockstep import lockstep
from tachometry.sim.studies.pairs import AXES, WHEELS, configurations, core_of
from tachometry.sim.testbench.proof import differences
from tachometry.spec import METHODS, CoreSpec, of_options
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.core.disc import Disc
from tachometry.spec.registers.buses import bus_of

LINT = "".join(f"/* verilator lint_off {one} */\n" for one in ("DECLFILENAME", "PROCASSINIT", "UNUSEDSIGNAL"))
BENCH = load("verilog")
KINDS = BENCH.DATA["kinds"]  # options of `generate`, and the bus


def wrong(spec: AnySpec) -> list[str]:
    gold, written = both_texts(spec, "core", None)
    return differences(gold, written.text, "core", written.names, YOSYS)


@pytest.mark.parametrize("kind", only(["s", "mt", "hall", "wishbone"], KINDS))
def test_the_exported_text_is_the_circuit(kind: str, tmp_path: Path) -> None:
    _, _, (gold, text), names = BENCH.core(kind)
    (tmp_path / "core.v").write_text(LINT + text)
    lint(["core.v"], "core", tmp_path)
    icarus = ["iverilog", "-g2001", "-Wall", "-o", "core.vvp", "core.v"]
    done = subprocess.run(icarus, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout + done.stderr == ""
    assert differences(gold, text, "core", names, YOSYS) == []


def stressed(kind: str) -> tuple[CoreSpec, Trace]:
    """Return the core of a kind, which no register sets up, and 200 edges of a shaft under stress."""
    words = KINDS[kind][0].replace(" probe=2", "").split()  # on a bus, a register arms the probe
    spec = of_options(dict(word.split("=", 1) for word in words))
    assert not isinstance(spec, LoopSpec)
    return spec, stress_of(spec, 1, 200)


# The loop is in tests/sim/engines/test_gate_loop.py.
CORES = [kind for kind in KINDS if kind != "loop"]


@pytest.mark.parametrize("kind", only(["s", "axes"], CORES))
def test_the_exported_text_is_right_in_cxxrtl(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    read_exported(monkeypatch, bus_of(KINDS[kind][1]))
    found = lockstep(*stressed(kind), Cxxrtl())
    assert found.n_mismatches == 0, found.first
    assert len(found.actual.updates.clock) > 50


@nightly  # `tests/test_matrix.py` plays other cores in Verilator, and `tests/test_random_cores.py` in Icarus
@pytest.mark.parametrize("kind", CORES)
def test_the_exported_text_is_right_in_other_simulators(kind: str, tmp_path: Path) -> None:
    spec, trace = stressed(kind)
    found = lockstep(spec, trace, LintingVerilator(tmp_path, few=True))
    assert found.n_mismatches == 0, found.first
    early = trace.until(200_000)  # a clock takes Icarus some 10 us
    count, first = compare(golden.run(spec, early), run_in_icarus(spec, tmp_path, early))
    assert count == 0, first


@nightly
@pytest.mark.parametrize("kind", [*METHODS, "axes"])
def test_every_pair_of_options(kind: str) -> None:
    cores = configurations(kind) if kind in METHODS else (*AXES, *WHEELS)
    assert {words: found for words in cores if (found := wrong(core_of(words)))} == {}


@nightly
@pytest.mark.parametrize("options", BENCH.DATA["alone"])
def test_options_that_no_pair_has(options: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("far.json").write_text(Disc(100, (0.25, -0.125) * 50, 4, 2, 0.01, 0.05, (60.0, 150.0), 40.0, False).text)
    assert wrong(of_options(dict(option.split("=", 1) for option in options.split()))) == []


MUTANTS = [
    ("m_s == 9'd499", "m_s == 9'd498", "Unproven"),
    (r"open_sum \+ ", "open_sum - ", "Unproven"),
    (r"(reg +\[8:0\] +m_s) = 9'd1", r"\1 = 9'd0", "initial value"),
    (r"update \? pulse_count : opening", "update ? opening : pulse_count", "Unproven"),
    (r"m_s <= 9'd1;(?=\s+longest <= 1'b0)", "m_s <= 9'd2;", "Unproven"),
    (r"lower <= 33'h200000", "lower <= 33'h200001", "Unproven"),
    ("posedge clk", "negedge clk", "clock"),
    (r"(table_\[3\] = \d+'h.*).;", r"\g<1>f;", "INIT"),
    (r"table_\[(?=\w+\];)", "table_[~", "Unproven"),
]


# One of each message; the others are gates that the same proof refuses.
@pytest.mark.parametrize(
    ("right", "mutant", "message"),
    only_rows([MUTANTS[k] for k in (0, 2, 6, 7)], MUTANTS),
    ids=["compared", "added", "initial", "chosen", "reset", "loaded", "edge", "contents", "address"],
)
def test_a_mutant_is_refused(right: str, mutant: str, message: str) -> None:
    _, _, (gold, text), names = BENCH.core("s with a table" if "table" in right else "s")
    changed = re.sub(right, mutant, text, count=1)
    assert changed != text
    found = differences(gold, changed, "core", names, YOSYS)
    assert found
    assert all(message in one for one in found), found
