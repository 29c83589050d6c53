"""The commands of docs/concepts/control.md run, and rows of docs/measured/tables are what comes of them."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import click
import pytest
from loops import KINDS, REAL, setting, variants
from support import command, docs
from support.nightly import only

from tachometry.cli.commands.loop import loop
from tachometry.cli.options.loop_study import loop_options
from tachometry.cli.options.points import loops_of
from tachometry.cli.options.sweep import by_name
from tachometry.cli.options.sweep_settings import of_command_line
from tachometry.sim.engines.loop import Observer
from tachometry.sim.studies.loops.control import Outcome, outcome_of, simulation_of

PAGE = docs.page("concepts/control.md")
COMMANDS = [
    shlex.split(found.replace("\\\n", ""))
    for found in re.findall(r"^    tachometry loop (--lines(?:.*\\\n)*.*)$", PAGE, re.MULTILINE)
]


def figures(found: Outcome) -> list[float]:
    """Return what a row says of an outcome."""
    assert found.dip is not None
    return [float(f"{value:.3g}") for value in (found.rms, found.largest, found.dip, found.sound)]


def cells(table: str, *begin: str) -> list[str]:
    """Return the other cells of the only row that begins so."""
    rows = [[*row.values()] for row in docs.table(table)]
    (found,) = (row[len(begin) :] for row in rows if row[: len(begin)] == [*begin])
    return found


def numbers(cell: str) -> list[float]:
    return [float(number) for number in cell.replace(":", ",").split(", ")]


RUN = [words for words in COMMANDS if "--vary" not in words]


# Gates have to be compiled; tests/sim/engines/test_gate_loop.py runs them.
@pytest.mark.parametrize(
    "words", only([words for words in RUN if "--gates" not in words], RUN), ids=lambda words: words[-1]
)
def test_commands_run(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With one seed, and with S, for the time that they take."""
    monkeypatch.chdir(tmp_path)
    given = words[: words.index("--seeds")] if "--seeds" in words else words
    assert command.run("loop", *given, "--methods", "s", "--seeds", "1") == 0


def test_the_command_with_axes_means_loops() -> None:
    (words,) = [words for words in COMMANDS if "--vary" in words]
    raw, _, _ = loop.make_parser(click.Context(loop)).parse_args(words)
    found = loops_of(of_command_line(raw, by_name(loop) | loop_options()), str(raw["methods"]), 6)
    assert [(point.method, found.at[key]["kv"]) for key, point in found.points.items()] == [
        (method, kv) for method in ("s", "mt", "track") for kv in ("20", "40")
    ]


@pytest.mark.parametrize("place", [0, 1])
def test_rows_of_what_synchronising_does(place: int) -> None:
    found = outcome_of(setting(KINDS[place], 80.0, 20e-6, REAL), range(6))
    assert numbers(cells("loop-weights", "real disc", "80")[place]) == figures(found)


def test_rows_of_what_was_assumed() -> None:
    base = setting(KINDS[0], 40.0, 1e-3, REAL)
    for name, varied in list(variants(base))[1::3]:
        assert numbers(cells("loop-assumptions", name)[0]) == figures(outcome_of(varied, range(6))), name
    conventional = replace(base, gains=replace(base.gains, way=Observer.CONVENTIONAL))
    assert numbers(cells("loop-assumptions", "the conventional observer")[0]) == figures(
        outcome_of(conventional, range(6))
    )


def test_what_is_held_is_more_than_the_speed() -> None:
    one = setting(KINDS[0], 80.0, 20e-6, REAL)
    log = one.run(simulation_of(one.spec), 0)
    steady = (log["time"] > 0.5) & (log["time"] < 0.8)
    said = re.search(r"by ([\d.]+) rad/s with S", PAGE)
    assert said is not None
    assert (log["held"] - log["speed"])[steady].mean() == pytest.approx(float(said[1]), abs=0.1)
