"""`tachometry verify`."""

import os
import re
import shlex
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from support.command import run
from support.nightly import nightly
from support.pipes import read

from tachometry.sim.encoder.stress import stress
from tachometry.sim.golden.methods import m as golden_m
from tachometry.sim.golden.quotient import round_quotient
from tachometry.sim.signals.temporary import run_tool
from tachometry.sim.studies import verify as study
from tachometry.sim.studies.pairs import configurations, spec_of
from tachometry.sim.studies.verify import motions
from tachometry.spec import METHODS, MTachometer


@pytest.fixture
def few(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    """Return only one or two configurations of every method, with the shortest ticks, whose motions are short; how
    many.
    """
    number: int = getattr(request, "param", 2)

    def short(method: str) -> list[tuple[str, ...]]:
        return sorted(configurations(method), key=lambda words: spec_of(words).timing.tick_cycles)[:number]

    monkeypatch.setattr(study, "configurations", short)
    monkeypatch.setattr(study, "AXES", ())
    monkeypatch.setattr(study, "WHEELS", ())
    return number


@pytest.mark.parametrize(
    ("methods", "engines", "few"),
    [
        (["m"], ["cxxrtl"], 1),
        pytest.param(["m"], ["cxxrtl", "verilator"], 1, marks=nightly),  # whose core takes long to compile
        pytest.param(list(METHODS), ["pysim"], 1, marks=nightly),
    ],
    indirect=["few"],
)
def test_engines_and_methods(
    methods: list[str], engines: list[str], few: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The short form of `make verify`."""
    chosen = ["--methods", ",".join(methods), "--engines", ",".join(engines)]
    assert run("verify", *chosen, "--clocks", "120000", "--jobs", "1", "-o", tmp_path / "out") == 0
    told = capsys.readouterr().out
    rows = [line.split() for line in told.splitlines()[1:]][: len(methods) * len(engines)]
    assert [row[:2] for row in rows] == [[method, name] for method in methods for name in engines]
    assert all(int(row[2]) == few <= int(row[3]) and row[7] == "0" for row in rows)
    assert all(int(row[6]) > (5 if row[0] == "track" else 100) for row in rows)  # whose ticks are long
    assert all(int(row[4]) >= 60_000 for row in rows if row[1] != "pysim")
    assert f"PASS: {', '.join(engines)} and golden models agree" in told
    assert not (tmp_path / "out").exists()


def test_a_difference_is_saved_with_the_command_that_replays_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cores = {words: spec_of(words) for words in configurations("m")}
    # Of the last one the ticks are short. In other units a difference of one may be rounded away.
    plain = {
        words: spec for words, spec in cores.items() if spec.velocity_width is None and spec.velocity.output is None
    }
    averaging = [words for words, spec in plain.items() if isinstance(spec, MTachometer) and spec.average > 2][-2:]
    monkeypatch.setattr(study, "configurations", lambda method: averaging)
    options = ["--methods", "m", "--engines", "pysim", "--jobs", "1", "-o", tmp_path / "out"]
    with monkeypatch.context() as patch:
        patch.setattr(golden_m, "round_quotient", lambda *numbers: round_quotient(*numbers) + 1)
        assert run("verify", *options) == 1
    told = capsys.readouterr().out
    assert "FAIL: hardware and golden model differ in" in told
    replay = re.findall(r"^  tachometry (replay .*)$", told, re.MULTILINE)
    captures = sorted(map(str, (tmp_path / "out").iterdir()))
    assert sorted(shlex.split(line)[1] for line in replay) == captures
    assert len(captures) > 1
    assert run(*shlex.split(replay[0])) == 0


def test_motions_last_as_long_as_is_wanted_and_differ() -> None:
    spec = spec_of(("--method", "m", "--ppr", "500", "--tick", "3clk", "--max-time", "1500clk"))
    some = list(motions(spec, 7, 500_000))
    assert [seed for seed, _ in some] == list(range(7, 7 + len(some)))
    assert 500_000 <= sum(trace.n_clocks for _, trace in some) < 2_000_000
    assert len({trace.n_clocks for _, trace in some}) == len(some) > 1
    assert len(list(motions(spec, 7, 0))) == 1
    assert (stress(spec, 3).clock != stress(spec, 4).clock).any()


def test_ctrl_c_tells_what_was_done(
    few: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    checked: list[object] = []

    def check(core: object, **options: object) -> object:
        if checked:
            raise KeyboardInterrupt
        checked.append(core)
        return real(core, **options)  # type: ignore[arg-type]

    real = study._check
    monkeypatch.setattr(study, "_check", check)
    assert run("verify", "--methods", "m", "--engines", "pysim", "--jobs", "1") == 130
    told = capsys.readouterr()
    assert told.out.splitlines()[1].split()[:3] == ["m", "pysim", "1"]
    assert "interrupted after 1 of 2 configurations" in told.err
    assert "PASS" not in told.out


def begin_and_wait(begun: int, core: object) -> None:
    os.write(begun, b".")
    signal.pause()


def test_workers_end_with_a_command_that_is_killed() -> None:
    begun, alive = os.pipe(), os.pipe()
    child = os.fork()
    if child == 0:
        try:
            check: Any = partial(begin_and_wait, begun[1])
            with study._each(check, [None, None], 2) as results:
                list(results)
        finally:
            os._exit(1)
    os.close(begun[1])
    os.close(alive[1])
    assert read(begun[0]) + read(begun[0]) == b".."
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    assert read(alive[0]) == b""  # until the last of those who have its other end is gone
    os.close(begun[0])
    os.close(alive[0])


def test_signals_are_held_back_while_workers_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fork loses what is raised in it; the workers end with the context."""
    seen: list[Any] = []

    @contextmanager
    def held_back() -> Iterator[None]:
        seen.append("held")
        yield
        seen.append("free")

    def start(*arguments: Any, **options: Any) -> Any:
        seen.append(real(*arguments, **options))
        return seen[-1]

    real = vars(study)["Process"]
    monkeypatch.setattr(study, "Process", start)
    monkeypatch.setattr(study, "held_back", held_back)
    with study._each(abs, [1, -2, 3], 2) as results:
        assert sorted(results) == [1, 2, 3]
    first, *workers, last = seen
    assert (first, last, len(workers)) == ("held", "free", 2)
    assert not any(worker.is_alive() for worker in workers)


def lose_a_signal(begun: int, core: object) -> None:
    class Deaf:
        def __del__(self) -> None:
            begin_and_wait(begun, core)

    Deaf()
    signal.pause()


def test_workers_that_lose_a_signal_end_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    begun, workers, real = os.pipe(), list[Any](), vars(study)["Process"]

    def start(**options: Any) -> Any:
        workers.append(real(**options))
        return workers[-1]

    monkeypatch.setattr(study, "Process", start)
    with study._each(partial(lose_a_signal, begun[1]), [None, None], 2):
        assert read(begun[0]) + read(begun[0]) == b".."
    assert [worker.exitcode for worker in workers] == [1, 1]
    for end in begun:
        os.close(end)


def end_or_wait(core: int) -> None:
    os._exit(9) if core == 1 else signal.pause()


@pytest.mark.parametrize(
    ("check", "error", "message"),
    [
        (end_or_wait, OSError, r"^a process of verify was killed \(out of memory\?\): try fewer --jobs$"),
        (int, ValueError, "invalid literal for int"),
    ],
)
def test_a_worker_that_fails_is_told(check: Any, error: type[Exception], message: str) -> None:
    cores: list[Any] = [0, 1] if check is end_or_wait else ["x", "y"]
    with pytest.raises(error, match=message), study._each(check, cores, 2) as results:
        list(results)


def compile_for_ever(folder: Path, core: object) -> None:
    run_tool(["sh", "-c", "sleep 100 > alive & echo > begun; wait"], folder)


def test_a_compiler_ends_with_its_worker(tmp_path: Path) -> None:
    for name in ("alive", "begun"):
        os.mkfifo(tmp_path / name)
    alive = os.open(tmp_path / "alive", os.O_RDONLY | os.O_NONBLOCK)
    with study._each(partial(compile_for_ever, tmp_path), [None], 2):
        (tmp_path / "begun").read_text()
    os.set_blocking(alive, True)
    assert os.read(alive, 1) == b""  # until the last of those who have its other end is gone
    os.close(alive)
