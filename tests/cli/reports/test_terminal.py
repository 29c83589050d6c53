"""Tables on terminals of any width, and in pipes."""

import io
import itertools
import shutil
import sys
import threading
from pathlib import Path
from queue import SimpleQueue
from typing import ClassVar

import pytest
from rich.progress import Progress
from support.command import run

from tachometry.cli.commands import _working
from tachometry.cli.reports import terminal
from tachometry.sim import build
from tachometry.sim.signals import progress

HEADS = ("method", "updates/s", "RMS (rad/s)", "what it is")
ROWS = [("s", "2450", "0.123456789", "a method of words"), ("rairan:estimate=n3", "1.58e+04", "12345.6789", "-")]


def shown(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, width: int | None) -> list[str]:
    if width is not None:
        monkeypatch.setattr(terminal, "_PLAIN_WIDTH", width)
    terminal.print_table(HEADS, ROWS, left=(0, 3))
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("width", [30, 40, 50, 60, 80, 100])
def test_no_cell_is_cut_or_broken(
    width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = shown(capsys, monkeypatch, width)
    text = "\n".join(lines)
    assert "…" not in text
    for row in ROWS:
        for cell in row[1:]:
            assert any(f"  {cell}" in line for line in lines), cell
    assert max(map(len, lines)) <= width or width < len("rairan:estimate=n3  a method of words")


def test_a_narrow_table_has_the_first_column_in_every_part(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = [
        [*group]
        for empty, group in itertools.groupby(shown(capsys, monkeypatch, 45), lambda line: not line.strip())
        if not empty
    ]
    assert len(parts) == 2
    for part in parts:
        assert [line.split()[0] for line in part][-2:] == ["s", "rairan:estimate=n3"]


def test_a_pipe_gets_whole_lines(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    lines = shown(capsys, monkeypatch, None)
    assert len(lines) == 3
    assert lines[0].split() == " ".join(HEADS).split()
    terminal.print_rows([("name", "word " * 200)])
    assert capsys.readouterr().out.count("\n") == 1


@pytest.mark.parametrize("width", [60, 80])
@pytest.mark.parametrize(
    "command",
    [
        "plan --ppr 500 --max-speed 400rad/s",
        "plan --ppr 500 --max-speed 400rad/s --methods all",
        "compare --ppr 50 --clock 100kHz --tick 1ms --max-time 10ms --motion ramp:0:100rad/s:100ms",
        "simulate --engine pysim --ppr 50 --clock 20kHz --tick 1ms --motion constant:20rad/s:50ms",
    ],
)
def test_commands_never_truncate(
    command: str, width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(*command.split()) == 0
    numbers = capsys.readouterr().out.split()
    monkeypatch.setattr(terminal, "_PLAIN_WIDTH", width)
    assert run(*command.split()) == 0
    narrow = capsys.readouterr().out
    assert "…" not in narrow
    for word in numbers:
        assert word in narrow


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_what_takes_long_is_shown_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    screen, begun = _Terminal(), threading.Event()
    start = Progress.start

    def begin(progress: Progress) -> None:
        start(progress)
        begun.set()

    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setattr(Progress, "start", begin)
    with terminal.activity() as say:
        say("synthesising")
    assert not begun.is_set()
    assert screen.getvalue() == ""
    monkeypatch.setattr(terminal, "_PATIENCE", 0)
    with terminal.activity() as say:
        say("placing and routing")
        assert begun.wait(60)
    assert "placing and routing" in screen.getvalue()


class _Clock:
    """Stands for the event that ends the lines: its time passes when a test says so."""

    made: ClassVar[list["_Clock"]] = []

    def __init__(self) -> None:
        self._queue: SimpleQueue[bool] = SimpleQueue()
        self.made.append(self)

    def set(self) -> None:
        self._queue.put(True)

    def pass_ten_seconds(self) -> None:
        self._queue.put(False)

    def wait(self, timeout: float) -> bool:
        assert timeout == 10
        return self._queue.get()


def piped(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    """Return what stands for stderr, and let ten seconds pass when a test says so."""
    monkeypatch.setattr(terminal, "LINE_SECONDS", 10.0)
    monkeypatch.setattr(terminal, "Event", _Clock)
    pipe = io.StringIO()
    monkeypatch.setattr(sys, "stderr", pipe)
    return pipe


def test_a_pipe_gets_nothing_of_what_is_short_and_a_line_every_ten_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    pipe = piped(monkeypatch)
    with terminal.activity() as say:
        say("packing")
    assert pipe.getvalue() == ""
    with terminal.activity() as say:
        say("routing")
        _Clock.made[-1].pass_ten_seconds()
        _Clock.made[-1].pass_ten_seconds()
    with terminal.progress_bar("verifying", 8, "configurations") as report:
        report(2)
        _Clock.made[-1].pass_ten_seconds()
    with terminal.progress_bar("simulating", 0, "clocks") as report:
        report(7)
        _Clock.made[-1].pass_ten_seconds()
    said = ["routing: 10 s", "routing: 20 s", "verifying, 25%: 10 s", "simulating, 7 clocks: 10 s"]
    assert pipe.getvalue().splitlines() == said


def test_a_first_compilation_is_shown_and_a_second_one_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As every command shows it, `monitor` with a simulated board, too."""
    monkeypatch.setenv("TACHOMETRY_CACHE", str(tmp_path))
    pipe = piped(monkeypatch)
    monkeypatch.setattr(progress, "_shown", [_working])

    def made(folder: Path) -> Path:
        _Clock.made[-1].pass_ten_seconds()
        inner = build.cached("inner", ".h", lambda within: Path(shutil.copy(__file__, within / "x.h")))
        assert inner.is_file()  # nothing is shown within
        return Path(shutil.copy(__file__, folder / "x.so.txt"))

    n_clocks = len(_Clock.made)
    for _ in range(2):
        build.cached("key", ".txt", made)
    assert len(_Clock.made) == n_clocks + 1
    assert pipe.getvalue() == "compiling, once for this core and this computer: 10 s\n"
