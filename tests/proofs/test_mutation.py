"""The short form of `make mutate`: some mutants of one core, and what it says when they are not noticed."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import proofs.mutation.__main__ as command
import proofs.mutation.score
import pytest
from proofs.mutation.cases import CASES
from proofs.mutation.loops import LOOPS, Commanded
from proofs.mutation.netlist import GROUP, Mutant, exported, mutants
from proofs.mutation.score import Score, hold
from proofs.mutation.simulate import library, run
from proofs.mutation.stimulus import steps, stimulus
from support.nightly import nightly

from tachometry.sim import golden
from tachometry.sim.golden.control import Command
from tachometry.sim.signals.recording import PinTrace

CASE = replace(next(case for case in CASES if case.name == "mt, in clocks"), mutants=40)
CLOCKS = 200_000


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    monkeypatch.setattr(command, "CASES", [CASE])
    monkeypatch.setattr(command, "BOXES", [])
    monkeypatch.setattr(proofs.mutation.score, "CLOCKS", CLOCKS)
    return monkeypatch


@nightly
def test_most_mutants_are_killed(small: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["mt"])
    assert "\n| mt, all | 40 |" in capsys.readouterr().out


def test_a_mutant_that_was_killed_must_be_killed_again(small: pytest.MonkeyPatch, tmp_path: Path) -> None:
    sample = [Mutant(f"mutate -mode inv -cell c{number} -src hdl/{number}.py:1") for number in range(40)]
    record = tmp_path / "survivors.json"
    record.write_text("{}")
    small.setattr(command, "SURVIVORS", record)

    def passes(survivors: list[int], sample: list[Mutant] = sample) -> bool:
        small.setattr(command, "judge", lambda case, pool: Score(case, sample, survivors))
        return command.main(["mt", "-o", str(tmp_path / "mutation.csv")])

    assert not passes([*range(9)])  # 77.5 %
    assert passes([*range(8)])
    assert not passes([0, 8])
    # Other lines of the same cells are the same sample; another cell makes another one.
    assert not passes([8], [replace(one, command=one.command.replace("py:1", "py:2")) for one in sample])
    assert passes([0, 8], sample[:-1])
    assert json.loads(record.read_text())[CASE.name][1] == [0, 8]


@nightly
def test_mutants_of_a_control_loop_are_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few of them; the core is that of the golden model, with its commands."""
    monkeypatch.setattr(proofs.mutation.score, "CLOCKS", 30_000)
    case = next(case for case in LOOPS if case.name == "loop, conventional")
    with ThreadPoolExecutor(1) as pool:
        found = proofs.mutation.score.judge(replace(case, mutants=12), pool)
        assert len(found.mutants) == 12
        assert len(found.survivors) <= 2
        # With commands that were not taken it is not that of the golden model.
        played = case.play(3000)
        parts = [
            replace(part, commands=[Command()] * len(part.commands))
            for part in played.traces
            if isinstance(part, Commanded)
        ]
        with pytest.raises(AssertionError, match="loop, conventional, from clock"):
            proofs.mutation.score.judge(replace(case, mutants=12), pool, replace(played, traces=parts))


@nightly
def test_registers_power_up_as_in_the_core(tmp_path: Path) -> None:
    """Those of which an output is mutated too: an initial value of 1 is not lost."""
    case = next(case for case in CASES if case.name == "s, carried")
    played = case.play(3000)
    assert played.starts[0] == 0
    with patch("tachometry.spec.methods.s.MAX_TABLE", case.max_table):
        flat, found = mutants(exported(case.component), 500, tmp_path, "t:$*dff*")
        found = [mutant for mutant in found if mutant.option("port") == "Q"][:GROUP]
        killed = np.full(len(found), -1, dtype=np.int64)
        rows = run(library(case.pins, flat, found), killed, len(case.pins.outputs), played.pins, 3000)
        hold(case, played, rows)


def test_steps_have_windows_of_all_lengths_and_all_counts() -> None:
    spec = next(case for case in CASES if case.name == "s, divided, wide").spec
    run_of = golden.run(spec, steps(spec, np.random.default_rng(1)))
    assert {*run_of.updates.interval.tolist()} == {*range(1, spec.timing.max_ticks + 1)}
    assert {*run_of.ticks.pulse_count.tolist()} == {*range(-spec.tick.max_count, spec.tick.max_count + 1)}


@nightly
def test_golden_model_is_held_against_the_core() -> None:
    played = stimulus(CASE.spec, 1000)
    traces = [trace for trace in played.traces if isinstance(trace, PinTrace)]
    wrong = replace(played, traces=[replace(trace, a=trace.a ^ np.uint8(1)) for trace in traces])
    with ThreadPoolExecutor(1) as pool, pytest.raises(AssertionError, match="mt, in clocks, from clock"):
        proofs.mutation.score.judge(CASE, pool, wrong)
