"""The papers' figures: what they must show, and that docs/figures.md says what they say."""

import functools
from pathlib import Path

import numpy as np
import pytest

from tachometry.sim.figures import FIGURES
from tachometry.sim.figures.lab import Lab
from tachometry.sim.figures.result import Result

DOCS = (Path(__file__).parents[3] / "docs" / "figures.md").read_text(encoding="utf-8")

# What the papers say and the figures do not bear out, by the beginning of the claim.
DISAGREE = {
    ("rairan2", "the time between updates"),
    ("rairan5", "the bounds also apply"),
    ("rairan7", "relative errors always"),
    ("rairan7", "ω_m3 consistently"),
}


@functools.cache
def computed(name: str) -> Result:
    """A figure without its hardware, which tests/test_lockstep.py holds against the golden models."""
    return FIGURES[name].compute(Lab(hdl=False))


@pytest.mark.parametrize("name", FIGURES)
def test_figure_agrees_with_what_its_paper_says(name: str) -> None:
    result = computed(name)
    assert result.claims
    for claim in result.claims:
        expected = not any(name == figure and claim.paper.startswith(text) for figure, text in DISAGREE)
        assert claim.agrees == expected, f"{claim.paper}: {claim.found}"


@pytest.mark.parametrize("name", FIGURES)
def test_docs_have_every_claim_with_the_number_that_is_computed(name: str) -> None:
    result = computed(name)
    assert f"## {result.source}: {result.title}\n" in DOCS
    for claim in result.claims:
        row = f"| {claim.paper} | {claim.found} | {'yes' if claim.agrees else 'no'} |"
        assert row.replace("|Σ m_e|", "Σ m_e") in DOCS, row


@pytest.mark.parametrize("name", FIGURES)
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
