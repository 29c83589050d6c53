"""Help and version: what an engineer sees first."""

import importlib.util
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from support.command import run

from tachometry.cli.main import main
from tachometry.spec import METHODS, common_options, own_options


def shown(capsys: pytest.CaptureFixture[str], *args: str) -> str:
    with pytest.raises(SystemExit) as stop:
        main(args)
    assert stop.value.code == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert shown(capsys, "--version") == f"tachometry {version('tachometry')}\n"


@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_commands_are_listed(flag: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = shown(capsys, flag)
    for command in "plan generate simulate replay compare sweep loop build program monitor".split():
        assert f"\n  {command} " in text
    assert max(map(len, text.splitlines())) <= 80


CORE = """
    --ppr --pole-pairs --decoding --sensor --reverse --invert
    --clock --tick --max-time --external-tick --max-tick-period --unit --frac-bits --lsb
    --velocity-width --cancel --no-cancel --max-speed --position-width --filter --index --index-reset
""".split()
DEFAULTS = (
    "48MHz",
    "20us, or as long as the method needs at this clock",
    "10ms, with method track 100ms",
    "count/tick",
    "4",
    "as many as it can need",
)
FAULTS = "--jitter --nonuniformity --eccentricity --phase-error --duty-error --bounce --lost --illegal".split()
OUTPUTS = "--vcd --plot --trace --counts --save-capture".split()


@pytest.mark.parametrize(
    ("command", "options", "groups"),
    [
        ("plan", ["--speeds", "--methods", "--plot", "--csv"], ["Range", "Outputs"]),
        (
            "generate",
            [*"--name --output -o --bus --baud --for --loop --kp --observer --control-period".split()],
            ["Files", "Loop"],
        ),
        (
            "simulate",
            [*"--motion --vibration --seed".split(), *FAULTS, *OUTPUTS],
            ["Motion", "Encoder faults", "Outputs"],
        ),
        ("build", ["BOARD", "--name", "--output", "-o", "--bus", "--baud"], ["Files"]),
        (
            "sweep",
            [*"FILE --vary --methods --engine --jobs --scheduler --results --axes --metric --seed".split(), *FAULTS],
            ["Sweep", "Machines", "Motion", "Encoder faults", "Outputs"],
        ),
        (
            "loop",
            [
                *"--kp --kv --observer --velocity-filter --synchronised --control-period --delay".split(),
                *"--current-limit --inertia --friction --load --vary --methods --seeds --log --csv --seed".split(),
                *FAULTS[:4],
            ],
            ["Controller", "Motor and load", "Sweep", "Motion", "Encoder faults", "Outputs"],
        ),
        (
            "replay",
            ["CAPTURE", "--a", "--b", "--z", "--tick-in", "--time", "--samplerate", *OUTPUTS],
            ["Capture", "Outputs"],
        ),
    ],
)
def test_every_option_is_explained(
    command: str, options: list[str], groups: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    text = shown(capsys, "help", command)
    words = text.replace(",", " ").split()
    for option in [*CORE, *options, *(["--method"] if command not in ("sweep", "loop") else [])]:
        assert option in words
    for group in ["Encoder", "Timing", "Core", *groups, "Examples"]:
        assert f"{group}:\n" in text
    for default in DEFAULTS[1:] if command == "build" else DEFAULTS:
        assert f"[default: {default}]" in " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 80


def test_shared_options_say_what_every_method_does(capsys: pytest.CaptureFixture[str]) -> None:
    text = re.sub(
        r"(?<=-edge)- (?=error)|(?<=step)- (?=dir)|(?<=up)- (?=down)",
        "-",
        " ".join(shown(capsys, "help", "plan").split()),
    )
    for method in METHODS:
        assert f"{method} {METHODS[method].facts.summary}" in text
        for about in own_options(method):
            assert about.help in text, (method, about.name)
    for about in common_options():
        assert about.help in text
    assert "Research:" in text
    assert "t, mt: Let the velocity decay" in text
    assert " rairan: Let the velocity decay" in text
    assert text.count("[default: bound-decay]") == 1


def test_forms_of_a_motion_are_listed_with_its_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("help", "compare", "--motion") == 0
    assert "trapezoid:SPEED:ACCEL_TIME:HOLD_TIME" in capsys.readouterr().out


def test_the_list_of_commands_loads_nothing_heavy() -> None:
    code = """
import sys
from tachometry.cli.main import main
try:
    main(["--help"])
finally:
    heavy = {"numpy", "amaranth", "matplotlib", "rich", "distributed", "pyarrow", "amaranth_boards"} & set(sys.modules)
    assert not heavy, heavy
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("line", ["plan --ppr 9 --plot p.png", "plan --ppr 9 --csv c.csv"])
def test_pictures_without_matplotlib_are_refused_before_any_work(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "matplotlib" else real(name))
    monkeypatch.chdir(tmp_path)
    assert run(*line.split()) == (0 if line.endswith("csv") else 2)
    if not line.endswith("csv"):
        assert "needs Matplotlib: pip install 'tachometry[plot]'" in capsys.readouterr().err
        assert list(tmp_path.iterdir()) == []
