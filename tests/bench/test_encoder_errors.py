"""The tables of docs/measured/encoder-errors.md are those of the bench, and say what docs/concepts says."""

import re
from pathlib import Path

import pytest
from support.nightly import nightly
from support.script import load

bench = load("encoder_errors")
PAGE = bench.PAGE.read_text("utf-8")


def table(name: str, text: str = PAGE) -> list[list[str]]:
    """Return rows of a table of the page, without its head."""
    begin, end = text.index(f"<!-- {name} -->"), text.index(f"<!-- end of {name} -->")
    return [line.strip("| ").split(" | ") for line in text[begin:end].splitlines()[3:]]


def numbers(row: list[str]) -> list[float]:
    return [float(word) for word in re.findall(r"(?<![\w^-])\d+(?:\.\d+)?(?![\w^])", " ".join(row[2:]))]


# Rows by disc, motion and method: the error as it is, and what is left of it, in parts.
LEFT = {
    (disc, motion, method): [float(part) for part in cell.split(": ")[1].split(", ")]
    for disc, motion, *cells in table("gains")
    for method, cell in zip(bench.METHODS, cells, strict=True)
}


def test_the_table_of_gains_has_all_rows() -> None:
    assert list(LEFT) == [
        (disc, motion, name) for disc in bench.DISCS for motion in bench.MOTIONS for name in bench.METHODS
    ]


@nightly
@pytest.mark.parametrize(("disc", "motion"), [("real", "217 rad/s"), ("phase", "20 rad/s")])
def test_gains_are_those_of_the_study(disc: str, motion: str) -> None:
    found = bench.gained(disc, *bench.MOTIONS[motion])
    for method, (none, *others) in found.items():
        parts = [one / none for one in others]
        assert parts == pytest.approx(LEFT[disc, motion, method], abs=0.011)


def test_limits_are_those_of_the_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "page.md"
    page.write_text(PAGE, "utf-8")
    monkeypatch.setattr(bench, "PAGE", page)
    bench.main(["limits"])
    new, old = table("limits", page.read_text("utf-8")), table("limits")
    assert [row[:2] for row in new] == [row[:2] for row in old]
    for one, other in zip(new, old, strict=True):
        assert numbers(one) == pytest.approx(numbers(other), rel=0.02)


def test_what_the_page_says() -> None:
    """A cycle table never halves the error on real and bad discs, and takes nine tenths out where lines are good."""
    for (disc, motion, method), (cycle, lines, *rest) in LEFT.items():
        assert bool(rest) != method.startswith("track")
        if not rest:
            continue
        (whole,) = rest
        steady = motion.endswith("rad/s")
        if disc in ("real", "bad"):
            assert cycle > 0.5
            assert lines < cycle
        if disc == "phase" and steady:
            assert cycle < 0.1
        if disc == "lines":
            assert 0.98 < cycle < 1.02
            assert not steady or lines <= 0.1
        if motion == "217 rad/s":
            assert whole <= cycle
    of_track = {(disc, motion): left for (disc, motion, method), left in LEFT.items() if method == "track"}
    assert of_track["real", "1.3 rad/s"][0] == 0.51
    del of_track["real", "1.3 rad/s"]
    assert all(0.95 <= left[0] <= 1.01 for (disc, _), left in of_track.items() if disc == "real")
    (cells,) = [row[2:] for row in table("gains") if row[:2] == ["bad", "20 rad/s"]]
    bad = {method: float(cell.split(":")[0]) for method, cell in zip(bench.METHODS, cells, strict=True)}
    assert bad["track, E = 0.8"] < bad["track"] / 100
    after = {(disc, rate): [float(one) for one in rest] for disc, rate, *rest in table("speeds")}
    assert after["real", "2^-7"][3] < 0.0045
