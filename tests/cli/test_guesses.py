"""Wrong guesses are answered with the thing to type; other words for one thing are taken."""

import shlex
from pathlib import Path

import pytest
from support.command import run

from tachometry.cli.commands import COMMANDS

LINES = Path(__file__).with_name("guesses.txt").read_text(encoding="utf-8").splitlines()[1:]
ROWS = [line.split(" => ") for line in LINES]


def test_every_guess_is_answered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert len(ROWS) >= 100
    wrong = []
    for line, thing in ROWS:
        status, said = run(*shlex.split(line)), capsys.readouterr().err
        if status != 2 or thing not in said or said.count("\n") != 1:
            wrong.append((line, thing, said))
    assert wrong == []
    assert list(tmp_path.iterdir()) == []


def test_what_is_not_near_is_not_guessed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", "--ppr", "500", "--quux", "3") == 2
    assert "mean" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("--method M/T", "--method mt"),
        ("--method Tracking", "--method track"),
        ("--clock 48mhz --tick 20US", "--clock 48MHz --tick 20us"),
        ("--decoding x2", "--decoding 2"),
        ("--decoding 1X", "--decoding 1"),
        ("--unit RPM --max-speed 6000Rpm", "--unit rpm --max-speed 6000rpm"),
        ("--method MT --timer Tick", "--method mt --timer tick"),
    ],
)
def test_case_is_nothing(said: str, meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    told = []
    for words in (said, meant):
        assert run("plan", "--ppr", "500", *words.split()) == 0
        told.append(capsys.readouterr().out)
    assert told[0] == told[1]


@pytest.mark.parametrize("command", COMMANDS)
def test_help_is_short(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    for flag, most in (("-h", 30), ("--help", 150)):
        assert run(command, flag) == 0
        lines = capsys.readouterr().out.splitlines()
        assert len(lines) <= most, flag
        assert max(map(len, lines)) <= 80, flag
        assert sum(line.startswith("  -") for line in lines) >= (flag == "--help"), flag
    assert run("help", command) == 0
    assert len(capsys.readouterr().out.splitlines()) >= len(lines) - 5


def test_one_option_is_explained(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("help", "generate", "--tick") == 0
    assert " ".join(capsys.readouterr().out.split()).startswith(
        "--tick TIME Sampling period Ts, such as 100us, 10kHz or 960clk."
    )
    assert run() == 0
    assert "Commands:" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "number", "completed"),
    [
        ("tachometry gen", 1, ["plain,generate"]),
        ("tachometry generate --max", 2, ["--max-time", "--max-tick-period", "--max-speed", "--max-memory"]),
        ("tachometry plan --method ra", 3, ["plain,rairan"]),
        ("tachometry build ic", 2, ["plain,icebreaker"]),
    ],
)
def test_the_shell_completes(
    words: str, number: int, completed: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("_TACHOMETRY_COMPLETE", "bash_complete"), ("COMP_WORDS", words), ("COMP_CWORD", str(number))):
        monkeypatch.setenv(name, value)
    assert run() == 0
    told = capsys.readouterr().out
    assert all(word in told for word in completed)
    assert len(told.splitlines()) == len(completed)


def test_completion_is_installed_by_one_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    for shell in ("bash", "zsh", "fish"):
        monkeypatch.setenv("SHELL", f"/usr/bin/{shell}")
        assert run("completion") == 0
        path = Path(capsys.readouterr().out.splitlines()[0])
        assert path.is_relative_to(tmp_path)
        assert f"_TACHOMETRY_COMPLETE={shell}_complete" in path.read_text()
