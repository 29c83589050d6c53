"""Temporary folders and tools end with the process that has them; files appear whole or not at all."""

import os
import signal
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tachometry.cli.commands import Refused, refusals
from tachometry.sim.signals import files
from tachometry.sim.signals.files import replacing, rows_of, write_csv
from tachometry.sim.signals.temporary import STOPS, end_tools, held_back, run_tool, scratch


class Stopped(Exception):
    """A signal has come."""


@pytest.fixture(params=STOPS)
def stop(request: pytest.FixtureRequest) -> Iterator[signal.Signals]:
    """Give each signal that stops a command, which raises `Stopped` here."""

    def hear(number: int, frame: object) -> None:
        raise Stopped

    before = signal.signal(request.param, hear)
    yield request.param
    signal.signal(request.param, before)


def test_what_is_held_back_is_heard_at_the_end(stop: signal.Signals) -> None:
    done = []

    def work() -> None:
        with held_back():
            signal.raise_signal(stop)
            signal.raise_signal(stop)
            done.append(1)
        done.append(2)

    with pytest.raises(Stopped):
        work()
    assert done == [1]
    with pytest.raises(Stopped):
        signal.raise_signal(stop)


def test_a_folder_ends_with_its_block(stop: signal.Signals, tmp_path: Path) -> None:
    def work() -> None:
        with scratch(tmp_path) as folder:
            (folder / "file").write_text("")
            signal.raise_signal(stop)

    with pytest.raises(Stopped):
        work()
    assert list(tmp_path.iterdir()) == []


def test_what_killed_processes_have_left_is_removed(tmp_path: Path) -> None:
    """Those of living ones stay, and so does what has another name."""
    (tmp_path / ".tachometry-cache").mkdir()
    (tmp_path / ".tachometry-killed.tmp").mkdir()
    (tmp_path / ".tachometry-killed.tmp" / "file").write_text("")
    with scratch(tmp_path) as living, scratch(tmp_path) as other:
        assert set(tmp_path.iterdir()) == {living, other, tmp_path / ".tachometry-cache"}
    assert list(tmp_path.iterdir()) == [tmp_path / ".tachometry-cache"]


def test_a_folder_that_another_run_takes_for_one_that_was_left_is_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []

    def make(**options: Any) -> str:
        made.append(tempfile.mkdtemp(**options))
        if len(made) == 1:
            os.rmdir(made[0])
        return made[-1]

    monkeypatch.setattr("tachometry.sim.signals.temporary.tempfile", SimpleNamespace(mkdtemp=make))
    with scratch(tmp_path) as folder:
        assert [folder] == list(tmp_path.iterdir())


TOOL = """
mktemp
sleep 100 > alive &
kill -{stop} {ours}
wait
"""


def test_a_tool_ends_with_all_that_it_has_started(stop: signal.Signals, tmp_path: Path) -> None:
    """A compiler is a driver and what it calls, with temporary files between them."""
    os.mkfifo(tmp_path / "alive")
    alive = os.open(tmp_path / "alive", os.O_RDONLY | os.O_NONBLOCK)
    with pytest.raises(Stopped):
        run_tool(["sh", "-c", TOOL.format(stop=stop.name.removeprefix("SIG"), ours=os.getpid())], tmp_path)
    os.set_blocking(alive, True)
    assert os.read(alive, 1) == b""  # until the last of those who have its other end is gone
    os.close(alive)
    assert len(list(tmp_path.iterdir())) == 2  # with a temporary file, which lies in the tool's folder


def test_a_tool_that_takes_too_long_is_ended() -> None:
    """By the processor's time, so that a computer with much else to do ends none."""
    endless = ["sh", "-c", "while :; do :; done"]
    with pytest.raises(Refused, match=r"^sh takes longer than 1 s$"), refusals():
        run_tool(endless, seconds=1)
    assert run_tool(["sleep", "1.5"], seconds=1).returncode == 0


def test_a_tool_that_takes_too_much_memory_fails() -> None:
    greedy = [sys.executable, "-c", "import sys; sys.stdin.read(); bytearray(1 << 30)"]
    assert "MemoryError" in run_tool(greedy, memory=1 << 29).stderr
    assert run_tool(greedy).returncode == 0


def test_tools_of_other_threads_are_ended() -> None:
    """As soon as one is known."""
    with ThreadPoolExecutor() as pool:
        running = pool.submit(run_tool, ["sleep", "1000"])
        while not running.done():
            end_tools()
        assert running.result().returncode == -signal.SIGKILL


def test_a_tool_is_given_a_text_and_says_something() -> None:
    done = run_tool(["sh", "-c", "cat; echo µ >&2; exit 3"], text="ü")
    assert (done.stdout, done.stderr, done.returncode) == ("ü", "µ\n", 3)


def test_a_file_is_replaced_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_text("old")
    with replacing(path) as beside:
        beside.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_nothing_is_left_after_an_error(error: type[BaseException], tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_text("old")

    def fail() -> None:
        with replacing(path) as beside:
            beside.write_text("ne")
            raise error

    with pytest.raises(error):
        fail()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_table_of_numbers_reads_back_as_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "_ROWS", 7)
    time, count = np.random.default_rng(1).random(100) / 3, np.arange(100)
    write_csv(tmp_path / "x.csv", ("time", "count"), rows_of([time, count]))
    lines = (tmp_path / "x.csv").read_text().split("\n")
    assert lines[0] == "time,count"
    assert lines[1:] == [f"{t!r},{k}" for t, k in zip(time.tolist(), count.tolist(), strict=True)] + [""]


def test_words_are_quoted_where_they_must_be(tmp_path: Path) -> None:
    write_csv(tmp_path / "x.csv", ("ω", "b"), [('1, "2"', None), (0.1, float("nan"))])
    assert (tmp_path / "x.csv").read_bytes() == 'ω,b\n"1, ""2""",\n0.1,nan\n'.encode()
