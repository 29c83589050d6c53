"""The short form of `make mutate`: some mutants of one core, and what it says when they are not noticed."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import proofs.mutation.__main__ as command
import proofs.mutation.equivalent
import proofs.mutation.score
import pytest
from proofs.mutation.cases import CASES
from proofs.mutation.cones import alike
from proofs.mutation.equivalent import equivalent
from proofs.mutation.loops import LOOPS, Commanded
from proofs.mutation.netlist import GROUP, exported, mutants
from proofs.mutation.score import hold
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
def test_mutants_are_killed_or_equivalent(small: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["mt"])
    assert "| mt, all | 40 |" in (total := capsys.readouterr().out.splitlines()[-1])
    assert "| 100.0 % |" in total


@nightly
def test_mutants_of_a_control_loop_are_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few of them; the core is that of the golden model, with its commands."""
    monkeypatch.setattr(proofs.mutation.score, "CLOCKS", 30_000)
    monkeypatch.setattr(proofs.mutation.score, "equivalent", lambda case, flat, group, *more: [False] * len(group))
    case = next(case for case in LOOPS if case.name == "loop, conventional")
    with ThreadPoolExecutor(1) as pool:
        found = proofs.mutation.score.judge(replace(case, mutants=12), pool)
        assert (found.mutants, found.killed + len(found.survivors)) == (12, 12)
        assert found.killed >= 10, found.survivors
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
def test_what_is_killed_is_not_proven_equivalent(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(proofs.mutation.equivalent, "_SECONDS", 2)
    played = stimulus(CASE.spec, CLOCKS)
    # As many as are played at once: among forty, none may be noticed late.
    flat, found = mutants(exported(CASE.component), GROUP, tmp_path)
    clocks = np.full(len(found), -1, dtype=np.int64)
    run(library(CASE.pins, flat, found), clocks, len(CASE.pins.outputs), played.pins)
    # Those that are the last to be noticed are the most like the core.
    latest = [found[number] for number in np.argsort(clocks)[-4:]]
    assert clocks.max() > CLOCKS // 25
    proven = alike(CASE, flat, found, tmp_path)
    assert any(proven)
    assert not (proven & (clocks >= 0)).any()
    with ThreadPoolExecutor(2) as pool:
        assert not any(equivalent(CASE, flat, latest, played.pins, tmp_path, pool))


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
    assert {*run_of.ticks.pulse_count.tolist()} == {*range(-spec.widths.max_count, spec.widths.max_count + 1)}


@nightly
def test_golden_model_is_held_against_the_core() -> None:
    played = stimulus(CASE.spec, 1000)
    traces = [trace for trace in played.traces if isinstance(trace, PinTrace)]
    wrong = replace(played, traces=[replace(trace, a=trace.a ^ np.uint8(1)) for trace in traces])
    with ThreadPoolExecutor(1) as pool, pytest.raises(AssertionError, match="mt, in clocks, from clock"):
        proofs.mutation.score.judge(CASE, pool, wrong)
