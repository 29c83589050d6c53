"""The command among others: what ends it, what it writes to, what it finds of the user's folders."""

import io
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from support.command import run
from support.nightly import only_rows

from tachometry.cli.commands import Refused, refusals
from tachometry.cli.files import writable_caches
from tachometry.cli.reports.standard_streams import printable
from tachometry.cli.reports.terminal import print_rows, print_table
from tachometry.sim.studies import plan as study

PLAN = ["plan", "--ppr", "500"]
COMMAND = [sys.executable, "-c", "from tachometry.cli.main import main; main()"]
SIMULATE = ["simulate", *"--ppr 9 --clock 1MHz --tick 100us --motion stop:1ms --engine pysim".split()]


def test_a_fault_of_the_program_has_a_status_and_a_line_of_its_own(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def faulty(*_: object) -> None:
        raise KeyError("an\nentry")

    monkeypatch.setattr(study, "plan_at", faulty)
    assert run(*PLAN) == 70
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.startswith("tachometry: internal error: KeyError: 'an\\nentry' (test_main.py, line ")
    assert "this is a fault of tachometry: please report it" in err


# A finder that is asked for every import, and is interrupted at one of them.
INTERRUPTED = """
import signal, sys
from tachometry.cli.main import main
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[1]:
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Finder())
main(sys.argv[2:])
"""


# A function of a command is stopped when it begins.
STOPPED = """
import importlib, signal, sys
from tachometry.cli.main import main
module, _, name = "{where}".rpartition(".")
def stopped(*_, **__):
    signal.raise_signal(signal.{stop})
setattr(importlib.import_module(module), name, stopped)
main(sys.argv[1:])
"""


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (OSError(28, "No space", "/tmp/.tachometry-k3.tmp/new/x"), "cannot write a temporary file in /tmp: No space"),
        (MemoryError(), "a number is too large for this computer: out of memory"),
    ],
)
def test_no_message_has_a_hidden_file_or_a_class(error: Exception, message: str) -> None:
    with pytest.raises(Refused, match=f"^{message}$"), refusals():
        raise error


@pytest.mark.parametrize(
    "module",
    [
        "tachometry.cli.commands",
        "tachometry.spec.methods",  # an import of an import
        "numpy",
    ],
)
def test_ctrl_c_during_an_import(module: str, tmp_path: Path) -> None:
    words = [sys.executable, "-c", INTERRUPTED, module, *SIMULATE, "--trace", "new/t.csv"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "tachometry: interrupted\n")
    assert list(tmp_path.iterdir()) == []


COMMANDS = {
    "generate": (["generate", "--ppr", "9", "-o", "out"], "tachometry.cli.commands.generate.core_files"),
    "simulate": ([*SIMULATE, "--trace", "out/t.csv"], "tachometry.cli.options.outputs.write_trace"),
    "monitor": (
        "monitor sim:icebreaker --ppr 9 --max-speed 9rad/s --record out/r.csv".split(),
        "tachometry.sim.engines.board.Cxxrtl",  # which compiles it
    ),
}


# Every signal has one handler, whatever the command.
@pytest.mark.parametrize(
    ("stop", "command"),
    only_rows(
        [("SIGINT", "generate"), ("SIGTERM", "simulate"), ("SIGHUP", "generate"), ("SIGTERM", "monitor")],
        [(stop, command) for stop in ("SIGINT", "SIGTERM", "SIGHUP") for command in COMMANDS],
    ),
)
def test_whatever_stops_a_command_leaves_nothing(stop: str, command: str, tmp_path: Path) -> None:
    words, where = COMMANDS[command]
    code = STOPPED.format(stop=stop, where=where)
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (130, "tachometry: interrupted\n")
    assert list(tmp_path.iterdir()) == []


def test_an_import_that_turns_ctrl_c_into_another_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object) -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise AttributeError("half imported") from None

    monkeypatch.setattr(study, "plan_at", interrupted)
    assert run(*PLAN) == 130
    assert capsys.readouterr().err == "tachometry: interrupted\n"


@pytest.mark.parametrize("words", [PLAN, ["--help"], [*PLAN, "--help"]])
def test_a_pipe_that_ends_is_no_error(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    read, write = os.pipe()
    os.close(read)
    with open(write, "w") as stdout:
        monkeypatch.setattr(sys, "stdout", stdout)
        assert run(*words) == 141
        print("what is still to be written goes nowhere", file=stdout, flush=True)
    assert capsys.readouterr().err == ""


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")
@pytest.mark.parametrize("words", [PLAN, ["--help"]])
def test_a_full_disk_behind_the_output(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with open("/dev/full", "w") as stdout:
        monkeypatch.setattr(sys, "stdout", stdout)
        assert run(*words) == 2
    err = capsys.readouterr().err
    assert err.startswith("tachometry: error: cannot write standard output")
    assert err.endswith(": No space left on device\n")


def test_streams_that_are_closed(tmp_path: Path) -> None:
    command = 'exec "$0" "$@" <&- >&- 2>&-'
    words = ["sh", "-c", command, *COMMAND, *SIMULATE, "--trace", "t.csv"]
    assert subprocess.run(words, cwd=tmp_path).returncode == 0
    assert (tmp_path / "t.csv").read_text().startswith("clock,tick,")
    assert [path.name for path in tmp_path.iterdir()] == ["t.csv"]


def test_the_output_is_utf8_in_any_locale(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    written = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(written, encoding="ascii"))
    monkeypatch.chdir(tmp_path)
    assert run("help", "generate", "--method") == 0
    assert "Rairán 2013" in " ".join(written.getvalue().decode("utf-8").split())


def test_a_home_that_cannot_be_written(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", "/dev/null")
    for name in ("XDG_CACHE_HOME", "MPLCONFIGDIR", "TACHOMETRY_CACHE"):
        monkeypatch.delenv(name, raising=False)
    with writable_caches():
        folder = Path(os.environ["XDG_CACHE_HOME"])
        assert os.environ["HOME"] == os.environ["MPLCONFIGDIR"] == str(folder)
        (folder / "file").write_text("")
    assert not folder.exists()
    assert (os.environ["HOME"], os.environ.get("XDG_CACHE_HOME")) == ("/dev/null", None)

    def within(*words: Any) -> Any:
        Path(os.environ["XDG_CACHE_HOME"], "of the tools").write_text("")
        return real(*words)

    real = study.plan_at
    monkeypatch.setattr(study, "plan_at", within)
    assert run(*PLAN) == 0
    assert capsys.readouterr().err == ""


def test_what_a_terminal_would_obey_is_not_printed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert printable("Ω, µs\n") == "Ω, µs\n"
    assert printable("a\x1b]0;title\x07\x9b\u202e\udcffb\n") == "a]0;titleb\n"
    monkeypatch.chdir(tmp_path)
    Path("c.csv").write_text("time,\x1b[31mA,\x9bB\n0,0,0\n1,1,1\n")
    assert run("replay", "c.csv", "--ppr", "9", "--a", "C") == 2
    assert "must be one of [31mA (0), B (1), not 'C'" in capsys.readouterr().err

    print_table(["a \x1bc head"], [["a \x1bc cell\x07"]])
    print_rows([("a \x1bc name", "a value\x9b")])
    assert capsys.readouterr().out.split() == "a c head a c cell a c name a value".split()
