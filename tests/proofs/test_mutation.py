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
from proofs.mutation.boxes import BOXES
from proofs.mutation.cases import CASES, Case
from proofs.mutation.equivalent import equivalent
from proofs.mutation.loops import LOOPS, Commanded
from proofs.mutation.netlist import GROUP, exported, mutants
from proofs.mutation.score import hold
from proofs.mutation.simulate import library, run
from proofs.mutation.stimulus import Stimulus, bursts, ending, steps, stimulus
from support.nightly import nightly

from tachometry.sim import golden
from tachometry.sim.golden.control import Command
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import TachometerSpec

CASE = replace(next(case for case in CASES if case.name == "mt, in clocks"), mutants=40)
CLOCKS = 200_000


def standstill(spec: TachometerSpec, n_clocks: int) -> Stimulus:
    """Return a reset, and then nothing."""
    pins = np.zeros((n_clocks, 1), dtype=np.uint64)
    pins[0] = 1
    low = {name: np.zeros(1, dtype=np.uint8) for name in ("a", "b")}
    return Stimulus(pins, [PinTrace.of_lines(np.zeros(1, dtype=np.int64), n_clocks - 1, low)], [1])


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


def test_a_motion_that_ends_about_the_first_update_has_a_clock() -> None:
    """Where ticks are short, some of them would end before they begin."""
    box = next(box for box in BOXES if box.name == "registers, native")
    assert min(trace.n_clocks for trace in ending(box.spec, np.random.default_rng(1))) == 1


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
def test_standstill_kills_too_few(small: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    small.setattr(Case, "play", lambda case, n_clocks: standstill(case.spec, n_clocks))
    small.setattr(proofs.mutation.score, "equivalent", lambda case, flat, group, *more: [False] * len(group))
    assert not command.main([])
    survivors = capsys.readouterr().out.partition("survivors of mt, in clocks:\n")[2].splitlines()
    assert len(survivors) > 10
    # Some multiplexers that Yosys makes have no line.
    known = ("  hdl/", "  amaranth/lib/cdc.py", "  : ")
    assert all(line.startswith(known) for line in survivors), survivors
    assert sum(line.startswith("  hdl/") for line in survivors) > 10


@nightly
def test_what_is_killed_is_not_proven_equivalent(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(proofs.mutation.equivalent, "_SECONDS", 2)
    played = stimulus(CASE.spec, CLOCKS)
    # As many as are played at once: among forty, none may be noticed late.
    flat, found = mutants(exported(CASE.component), GROUP, tmp_path)
    clocks, _ = run(library(CASE.pins, flat, found), len(found), len(CASE.pins.outputs), played.pins)
    # Those that are the last to be noticed are the most like the core.
    latest = [found[number] for number in np.argsort(clocks)[-4:]]
    assert clocks.max() > CLOCKS // 25
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
        _, rows = run(library(case.pins, flat, found), len(found), len(case.pins.outputs), played.pins, 3000)
        hold(case, played, rows)


def test_an_external_tick_comes_at_regular_times() -> None:
    trace = bursts(next(case for case in CASES if case.spec.external_tick).spec, np.random.default_rng(1))
    assert trace.tick_in is not None
    rises = trace.clock[1:][trace.tick_in[1:] > trace.tick_in[:-1]]
    assert len({*np.diff(rises).tolist()}) == 1


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
