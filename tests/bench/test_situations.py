"""Situations: what is recorded is what the options of the command line say."""

import csv
import shlex
from pathlib import Path

import numpy as np
import pytest
from motions import OTHERS, SITUATIONS, Situation
from support.command import run
from support.nightly import only

from tachometry.sim.studies.comparing.baseline_catalogue import steps_curve
from tachometry.sim.studies.comparing.compare import Judge
from tachometry.sim.studies.comparing.comparison import steps_beside
from tachometry.sim.studies.comparing.tune import error_of
from tachometry.spec import of_texts

ALL = (*SITUATIONS, *OTHERS)


def test_names_are_different() -> None:
    assert len({situation.name for situation in ALL}) == len(ALL)


@pytest.mark.parametrize("situation", only(ALL[::6], ALL), ids=lambda situation: situation.name)
def test_options_are_of_what_is_recorded(situation: Situation, tmp_path: Path) -> None:
    truth = situation.record(3)
    core = "--clock 10MHz --tick 100us --max-time 10ms --max-speed 400rad/s".split()
    texts = {name.strip("-"): text for name, text in zip(core[::2], core[1::2], strict=True)}
    spec = of_texts("s", {"ppr": str(situation.lines), **texts})
    curve = steps_curve("hostmot2", steps_beside(spec, truth.recording))
    error = error_of(curve, Judge(truth.true_speed, situation.start_s, truth.recording.duration))
    lines = [] if "--ppr" in situation.options else ["--ppr", 500]
    options = [*shlex.split(situation.options), "--seed", 3, "--methods", "hostmot2", "--csv", tmp_path / "c.csv"]
    assert run("compare", *lines, *core, *options) == 0
    with (tmp_path / "c.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["rms_rad_s"]) == pytest.approx(error, rel=1e-9)


@pytest.mark.parametrize("situation", only(ALL[::6], ALL), ids=lambda situation: situation.name)
def test_seeds_make_a_difference_where_something_is_random(situation: Situation) -> None:
    first, second = (situation.record(seed).recording.time for seed in (1, 2))
    assert np.array_equal(first, second) is not situation.random
