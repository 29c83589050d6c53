"""A method is one object: a new one, registered in the three tables, goes through every command."""

import csv
import json
from dataclasses import dataclass, replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from amaranth import Module
from support.command import run

from tachometry.hdl.methods import DATAPATHS
from tachometry.hdl.methods.m import MMethod
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods import MODELS
from tachometry.sim.golden.methods import m as golden_m
from tachometry.sim.signals.run import Table
from tachometry.sim.studies.pairs import configurations, factors
from tachometry.spec import METHODS, MTachometer, common_options
from tachometry.spec.language.option import option
from tachometry.spec.language.port import UPDATE, Port, held

CORE = "--ppr 24 --clock 100kHz --tick 1ms --max-time 20ms".split()
X = ["--method", "x", "--doubled"]
MOTION = ["--motion", "constant:600rpm:200ms"]


@dataclass(frozen=True, kw_only=True)
class XTachometer(MTachometer):
    """The M method by another name, with an option more, that has an output."""

    doubled: bool = option(False, "Everything is measured twice, which changes nothing.")

    method = "x"
    facts = replace(MTachometer.facts, title="X", summary="does what m does")

    @property
    def method_ports(self) -> tuple[Port, ...]:
        return (held(UPDATE, "odd", help="The native velocity is odd."),) if self.doubled else ()


class XModel(golden_m.Model):
    """Its golden model."""

    def updates(self, ticks: Table, steps: Steps | None, n_clocks: int) -> Table:
        updates = super().updates(ticks, steps, n_clocks)
        return updates.having(odd=updates.velocity & 1 == 1)


class XMethod(MMethod):
    """Its hardware."""

    def elaborate(self, platform: object) -> Module:
        m = super().elaborate(platform)
        if self._spec.doubled:  # type: ignore[attr-defined]
            m.d.comb += self.updates.p.odd.eq(self.updates.p.velocity[0])
        return m


class Wrong(XMethod):
    """Gives an output that is wrong."""

    def elaborate(self, platform: object) -> Module:
        m = super().elaborate(platform)
        m.d.comb += self.updates.p.odd.eq(1)
        return m


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(METHODS, "x", XTachometer)
    monkeypatch.setitem(MODELS, "x", XModel)
    monkeypatch.setitem(DATAPATHS, "x", XMethod)


def told(capsys: pytest.CaptureFixture[str]) -> str:
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out


@pytest.mark.parametrize("command", ["generate", "plan", "simulate", "replay", "compare", "sweep", "verify"])
def test_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("help", command) == 0
    text = " ".join(told(capsys).split())
    if command not in ("compare", "verify"):
        assert "--doubled / --no-doubled Everything is measured twice, which changes nothing." in text
        assert "[default: no-doubled]" in text
    if command not in ("compare", "verify", "sweep"):
        assert f"[auto|{'|'.join(METHODS)}]" in text
        assert "x does what m does" in text
    if command == "verify":
        assert f"They are {', '.join(METHODS)}." in text


def test_generate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("generate", *CORE, *X, "-o", tmp_path, "--testbench", "cocotb") == 0
    manifest = json.loads((tmp_path / "tachometer.json").read_text())
    assert manifest["method"] == "x"
    assert manifest["parameters"]["doubled"] is True
    assert {"name": "odd", "direction": "output", "width": 1, "signed": False} in manifest["ports"]
    vectors = json.loads((tmp_path / "tachometer_vectors.json").read_text())
    assert "odd" in vectors["strobes"]["velocity_valid"]["ports"]
    assert "module tachometer" in (tmp_path / "tachometer.v").read_text()


def test_simulate_and_replay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    engine = ["--engine", "pysim"]
    files = ["--save-capture", tmp_path / "x.sr", "--trace", tmp_path / "1.csv", "--vcd", tmp_path / "x.vcd"]
    assert run("simulate", *CORE, *X, *MOTION, *engine, *files, "--plot", tmp_path / "x.png") == 0
    assert "PASS: hardware and golden model agree" in told(capsys)
    assert run("replay", tmp_path / "x.sr", *CORE, *X, *engine, "--trace", tmp_path / "2.csv") == 0
    assert (tmp_path / "1.csv").read_text() == (tmp_path / "2.csv").read_text()
    with (tmp_path / "1.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert all(int(row["odd"]) == int(row["velocity_raw"]) % 2 for row in rows)
    assert " odd $end" in (tmp_path / "x.vcd").read_text()


def test_an_output_of_the_method_is_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(DATAPATHS, "x", Wrong)
    assert run("simulate", *CORE, *X, *MOTION, "--engine", "pysim") == 1
    assert "first mismatch in velocity_valid.odd[0]: expected 0, got 1" in told(capsys)


def test_plan_has_all_but_the_equations(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = ["--plot", tmp_path / "p.png", "--csv", tmp_path / "p.csv"]
    assert run("plan", *CORE, *X, *files) == 0
    lines = told(capsys).splitlines()
    assert lines[0].split()[:2] == ["method", "X,"]
    assert any(line.startswith("standstill") for line in lines)
    row = lines[next(k for k, line in enumerate(lines) if line.startswith("speed (")) + 1].split()
    assert row[2:] == ["-", "-", "-", "-", "tick"]
    assert run("plan", *CORE, "--methods", "all", *files) == 0
    heads = [line.split() for line in told(capsys).splitlines() if line.startswith("speed (")]
    assert all(line[-1] == "x" for line in heads[1:])
    assert len(heads) == 5


def test_compare(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("compare", *CORE, *MOTION) == 0
    lines = {line.split()[0]: line.split()[1:] for line in told(capsys).splitlines()[1:] if line}
    assert lines["x"] == lines["m"]
    assert run("compare", *CORE, *MOTION, "--methods", "x:doubled=yes:average=2,m:average=2") == 0
    rows = told(capsys).splitlines()[1:3]
    assert rows[0].split()[1:] == rows[1].split()[1:]


def test_sweep(scheduler: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    axes = ["--vary", "doubled=yes,no", "--methods", "s,x", "--results", tmp_path / "r.parquet"]
    assert run("sweep", *CORE, *MOTION, *axes, *scheduler) == 0
    rows = pq.read_table(tmp_path / "r.parquet").to_pylist()
    assert [(row["method"], row["doubled"]) for row in rows] == [("s", None), ("x", True), ("x", False)]


def test_verify(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tachometry.sim.studies.verify.configurations", lambda method: configurations(method)[:1])
    monkeypatch.setattr("tachometry.sim.studies.verify._SLOW_LEAST", 2000)  # clocks
    options = ["--methods", "x", "--engines", "pysim", "--jobs", "1", "-o", tmp_path]
    assert run("verify", *options) == 0
    assert "PASS: pysim and golden models agree" in told(capsys)


def test_pairs_have_the_option() -> None:
    assert factors("x")["doubled"] == ("", "yes")
    assert "average" not in {about.name for about in common_options()}
    words = [" ".join(core) for core in configurations("x")]
    for other in ("--average 8", "--bounds", "--external-tick", "--tick 1clk "):
        assert any("--doubled" in core and other in core for core in words), other
