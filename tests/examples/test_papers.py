"""The papers' figures: what they must show, and that docs/measured/figures.md says what they say."""

import csv
import functools
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
import pytest
from papers import FIGURES, LOOPS, tsuji_loops
from papers.__main__ import main
from papers.lab import Lab
from papers.rairan_equations import Row, table1_rows
from papers.result import Result
from support import docs
from support.nightly import only

from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.golden.methods import m as m_method
from tachometry.sim.golden.quotient import round_quotient
from tachometry.sim.signals.run import Run
from tachometry.sim.theory.performance import Performance
from tachometry.spec import MTachometer, STachometer, TachometerSpec

DOCS = docs.page("measured/figures.md")

# What the papers say and the figures do not bear out, by the beginning of the claim.
DISAGREE = {
    ("rairan2", "the time between updates"),
    ("rairan5", "the actual speed on the ramps"),
    ("rairan5", "the bounds also apply"),
    ("rairan7", "relative errors always"),
    ("rairan7", "ω_m3 consistently"),
}


# Of what only a part is run here; the page has what `make figures` gives.
# Of the three that run a control loop one is enough, as they differ in what is drawn.
QUICK = [name for name in FIGURES if name not in LOOPS[:-1]]


@functools.cache
def computed(name: str) -> Result:
    """Return a figure without its hardware, which tests/test_matrix.py holds against the golden models."""
    return FIGURES[name](Lab(hdl=False, whole=False))


@pytest.mark.parametrize("name", only(QUICK, FIGURES))
def test_figure_agrees_with_what_its_paper_says(name: str) -> None:
    result = computed(name)
    assert result.claims
    for claim in result.claims:
        expected = not any(name == figure and claim.paper.startswith(text) for figure, text in DISAGREE)
        assert claim.agrees == expected, f"{claim.paper}: {claim.found}"


def wrong_equation(right: Any, factor: float) -> Any:
    """Return what computes another number: resolutions and times as well, if there are several."""

    def wrong(*values: Any) -> Any:
        found = right(*values)
        if isinstance(found, Performance):
            return replace(found, time=factor * found.time, resolution=factor * found.resolution)
        return factor * found

    return wrong


def wrong_table(factor: float) -> Any:
    """Return table 1 with dt twice as long and updates by the other event, or with the floor of the counts."""

    def wrong(pulses: Iterable[int], dt: int, duration: int) -> list[Row]:
        if factor > 1:
            rows = table1_rows(pulses, 2 * dt, duration)
            return [replace(row, new_n_ep1=row.pulse, new_n_dt1=row.end) for row in rows]
        return [replace(row, n_ep1=max(row.n_ep1 - 1, 1)) for row in table1_rows(pulses, dt, duration)]

    return wrong


class WrongLab(Lab):
    """Golden models that count each edge twice, and whose velocity and measurement time jump."""

    def golden(self, spec: TachometerSpec, encoding: Encoding) -> Run:
        run = super().golden(spec, encoding)
        ticks, updates = run.ticks, run.updates
        jumping = np.where(np.arange(len(updates)) % 5 < 2, 2 * updates.velocity, updates.velocity // 3)
        tables = {
            "tick": ticks.having(pulse_count=2 * ticks.pulse_count),
            "velocity_valid": updates.having(velocity=jumping, interval=updates.interval + 1),
        }
        return replace(run, tables=run.tables | tables)


class Remembering(Lab):
    """A lab that turns and measures once, however often it is asked to."""

    def __init__(self) -> None:
        super().__init__(hdl=False)
        self._turned: dict[Any, Encoding] = {}
        self._measured: dict[Any, Run] = {}

    def turn(self, spec: TachometerSpec, motion: Any, **options: Any) -> Encoding:
        key = (spec.encoder, motion, *sorted(options.items()))
        if key not in self._turned:
            self._turned[key] = super().turn(spec, motion, **options)
        return self._turned[key]

    def golden(self, spec: TachometerSpec, encoding: Encoding) -> Run:
        key = (spec, id(encoding))
        if key not in self._measured:
            self._measured[key] = super().golden(spec, encoding)
        return self._measured[key]


@pytest.mark.parametrize("name", [name for name in FIGURES if name not in LOOPS])
def test_every_claim_can_be_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """By an equation that gives three times as much, or a third, by a wrong Table 1 or by wrong golden models."""
    compute = FIGURES[name]
    module = import_module(compute.__module__)
    left = {claim.paper for claim in computed(name).claims if claim.agrees}

    def refute(lab: Lab) -> None:
        with suppress(ValueError):  # no other equation takes what the wrong one gives
            left.intersection_update({claim.paper for claim in compute(lab).claims if claim.agrees})

    if left:
        refute(WrongLab(hdl=False))
    lab = Remembering()
    for what, right in list(vars(module).items()):
        if isinstance(right, FunctionType) and right.__module__.startswith(("tachometry.sim.theory", "papers.rairan")):
            for factor in (3, 1 / 3):
                if left:
                    wrong = wrong_table(factor) if right is table1_rows else wrong_equation(right, factor)
                    monkeypatch.setattr(module, what, wrong)
                    refute(lab)
                    monkeypatch.undo()
    assert not left


# The last has claims of both kinds; each is computed again for every wrong part.
@pytest.mark.parametrize("name", only(LOOPS[-1:], LOOPS))
def test_every_claim_of_a_loop_can_be_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """By M and S in each other's place, by an observer that is synchronised where it should not be, by other gains."""
    left = {claim.paper for claim in computed(name).claims}
    core, setting = tsuji_loops._core, tsuji_loops._setting

    def other_core(method: type[TachometerSpec], **options: Any) -> TachometerSpec:
        others = {MTachometer: STachometer, STachometer: MTachometer}
        return core(others.get(method, method), **{key: options[key] for key in ("decoding", "tick")})

    def other_observer(*args: Any, synchronised: bool, **options: Any) -> Any:
        return setting(*args, synchronised=not synchronised, **options)

    def other_gains(*args: Any, kv: float, rate: float, **options: Any) -> Any:
        return setting(*args, kv=600 / kv, rate=1000 / rate, **options)

    wrongs = {"_setting": (other_observer, other_gains), "_core": (other_core,)}
    for what, all_wrong in wrongs.items():
        for wrong in all_wrong:
            if left:
                monkeypatch.setattr(tsuji_loops, what, wrong)
                found = FIGURES[name](Lab(hdl=False, whole=False))
                left &= {claim.paper for claim in found.claims if claim.agrees}
                monkeypatch.undo()
    assert not left


@pytest.mark.parametrize("name", only(QUICK, FIGURES))
def test_docs_have_every_claim_with_the_number_that_is_computed(name: str) -> None:
    result = computed(name)
    assert f"## {result.source}: {result.title}\n" in DOCS
    shown = {row["the paper says"]: row for row in docs.table("papers") if row["figure"] == name}
    assert list(shown) == [claim.paper.replace("|", "") for claim in result.claims]
    for claim, row in zip(result.claims, shown.values(), strict=True):
        assert row["agrees"] == ("yes" if claim.agrees else "no")
        assert name in LOOPS or row["computed"] == claim.found.replace("|", "")
        assert claim.agrees or f"| {name} | {claim.paper} | {row['computed']} |" in DOCS


@pytest.mark.parametrize("name", only(QUICK, FIGURES))
def test_curves_can_be_drawn(name: str) -> None:
    result = computed(name)
    assert len({panel.x_label for panel in result.panels}) == 1  # of the CSV
    for panel in result.panels:
        labels = [curve.label for curve in panel.curves]
        assert len(set(labels)) == len(labels)
        for curve in panel.curves:
            assert len(curve.x) == len(curve.y) > 0
            assert np.all(np.isfinite(curve.x))
            assert np.all(np.diff(curve.x) >= 0), curve.label
            assert np.isfinite(curve.y).any()


def test_golden_models_lie_on_the_lines_of_tsuji6_and_below_those_of_tsuji7() -> None:
    for name, kind in (("tsuji6", "on"), ("tsuji7", "below")):
        curves = {curve.label: curve for curve in computed(name).panels[0].curves}
        measured = [label for label in curves if label.endswith(", golden")]
        assert len(measured) >= 2
        for label in measured:
            dots, line = curves[label], curves[label.removesuffix(", golden")]
            expected = np.interp(dots.x, line.x, line.y)
            if kind == "on":
                np.testing.assert_allclose(dots.y, expected, rtol=0.01)
            else:
                assert np.all(dots.y <= expected * 1.01), label
                assert np.any(dots.y > 0.5 * expected), label


def test_files_and_page_of_a_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.md"
    page.write_text("<!-- differ -->\n<!-- end of differ -->\n")
    (tmp_path / "figures").mkdir()
    for folder in ("one", "two"):
        assert main(["--only", "tsuji6", "-o", str(tmp_path / folder), "--page", str(page)]) == 0
    names = {f"tsuji6.{kind}" for kind in ("svg", "png", "csv")}
    made = [{file.name: file.read_bytes() for file in (tmp_path / folder).iterdir()} for folder in ("one", "two")]
    assert made[0].keys() == names
    assert made[0] == made[1]
    assert (tmp_path / "figures" / "tsuji6.png").read_bytes() == made[0]["tsuji6.png"]
    claims = [row for row in docs.table("papers") if row["figure"] == "tsuji6"]
    with (tmp_path / "tables" / "papers.csv").open(encoding="utf-8") as file:
        assert [{head: row[head] for head in claims[0]} for row in csv.DictReader(file)] == claims
    assert "tsuji6: Tsuji 2009, Fig. 6, " in capsys.readouterr().out
    with (tmp_path / "one" / "tsuji6.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["panel", "curve", "speed (rad/s)", "y"]
    assert {row["panel"] for row in rows} == {"T_m (ms)"}
    assert float(next(row for row in rows if row["curve"] == "S")["y"]) == 10


def test_a_mismatch_of_the_hardware_is_an_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A golden model with a fault, on a short run: the hardware differs, and the exit status is 1."""
    turn = Lab.turn
    monkeypatch.setattr(Lab, "turn", lambda lab, spec, motion, **more: turn(lab, spec, "ramp:0:40rad/s:400ms", **more))
    monkeypatch.setattr(m_method, "round_quotient", lambda *args: round_quotient(*args) + 1)
    assert main(["--only", "tsuji12", "-o", str(tmp_path)]) == 1
    assert "m method: velocity_valid.velocity[0]: expected 1, got 0" in capsys.readouterr().out
