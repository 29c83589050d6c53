"""A sweep takes axes and options from texts and files."""

import re
import shlex
from pathlib import Path

import click
import pytest
from support import docs

from tachometry.cli.commands.sweep import sweep
from tachometry.cli.options.loop_study import loop_options
from tachometry.cli.options.sweep import by_name, point_options
from tachometry.cli.options.sweep_settings import Settings, arguments, of_command_line, of_file

OPTIONS = by_name(sweep) | point_options()


def vary(*texts: str) -> dict[str, list[str | None]]:
    return of_command_line({"vary": texts}, OPTIONS).vary


def read(folder: Path, text: str) -> Settings:
    path = folder / "s.toml"
    path.write_text(text, encoding="utf-8")
    return of_file(path, OPTIONS)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("tick=10us,20us , 50us", ["10us", "20us", "50us"]),
        ("tick=10us..30us:3", ["10us", "20us", "30us"]),
        ("tick=10us..1ms:3log", ["10us", "100us", "1000us"]),
        ("tick=480..4800:4log", ["480", "1034", "2228", "4800"]),
        ("speed=1..1000rad/s:4log", ["1rad/s", "10rad/s", "100rad/s", "1000rad/s"]),
        ("speed=1..10:4log", ["1", "2.154", "4.642", "10"]),
        ("speed=-2..2:5", ["-2", "-1", "0", "1", "2"]),
        ("jitter=0..1:4", ["0", "0.333333333", "0.666666667", "1"]),
        ("average=1..4:10", ["1", "2", "3", "4"]),
        ("edge-error=0..1:3", ["0", "0.5", "1"]),
        ("damping=0..1:3", ["0", "0.5", "1"]),
        ("clock=1MHz..48MHz:2", ["1MHz", "48MHz"]),
        ("lowpass=none,100rad/s", [None, "100rad/s"]),
        ("motion=csv:../a.csv,stop:1s", ["csv:../a.csv", "stop:1s"]),
        ("bounce=3:500us,3:500us", ["3:500us"]),
    ],
)
def test_values_of_an_axis(text: str, values: list[str | None], tmp_path: Path) -> None:
    """Command line and file give the same values."""
    name, _, right = text.partition("=")
    assert vary(text) == {name: values}
    assert read(tmp_path, f'[vary]\n{name} = "{right}"').vary == {name: values}
    items = ", ".join(f'"{item}"' for item in right.split(","))
    assert read(tmp_path, f"[vary]\n{name} = [{items}]").vary == {name: values}


@pytest.mark.parametrize("name", ["kp", "kv", "inertia", "viscous"])
def test_a_range_of_a_loop_need_not_be_whole(name: str) -> None:
    assert of_command_line({"vary": [f"{name}=1..2:3"]}, loop_options()).vary == {name: ["1", "1.5", "2"]}


def test_an_axis_twice() -> None:
    with pytest.raises(ValueError, match=r"^--vary must be given once for tick$"):
        vary("tick=1us", "tick=2us")


def test_files_and_options_mean_the_same(tmp_path: Path) -> None:
    text = """
ppr = 500
clock = "10MHz"
tick = "200clk"
jitter = 0.02
index = true
cancel = false
methods = ["s", "m:average=8"]
motion = "constant:{speed}:1s"
[vary]
speed = [1, 2.5, "3rad/s"]
bounds = [true, false]
"""
    line = {
        "core_ppr": "500",
        "core_clock": "10MHz",
        "core_tick": "200clk",
        "jitter": "0.02",
        "core_index": True,
        "core_cancel": False,
        "methods": "s,m:average=8",
        "motion": "constant:{speed}:1s",
        "vary": ("speed=1,2.5,3rad/s", "bounds=yes,no"),
    }
    settings = read(tmp_path, text)
    assert settings == of_command_line(line, OPTIONS)
    assert arguments(settings.first(), OPTIONS | {"speed": OPTIONS["tick"]}) == [
        "--ppr=500",
        "--clock=10MHz",
        "--tick=200clk",
        "--jitter=0.02",
        "--index",
        "--no-cancel",
        "--methods=s,m:average=8",
        "--motion=constant:{speed}:1s",
        "--tick=1",
        "--bounds",
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ppr = ", "must be TOML: Invalid value"),
        ("turns = 500", ": 'turns' is no key of a sweep: keys must be of methods, from, "),
        ("turns = 500", ", index-width, index-skew, noise, interpolation, frame-errors, seed, and [vary]"),
        ("tick = [1, 2]", "tick must be a text, a number, true or false, not [1, 2]: a list belongs into [vary]"),
        ("tick = 1979-05-27", "tick must be a text, a number, true or false, not datetime.date"),
        ("vary = 3", "vary must be a table of axes, not 3"),
        ("[vary]\ntick = []", "tick must have values to be varied"),
        ("[vary]\ntick = {a = 1}", "tick must be a text, a number, true or false, not {'a': 1}"),
        ('tick = "1us"\n[vary]\ntick = ["1us"]', "tick must be given or varied, not both"),
    ],
)
def test_what_is_no_file_of_a_sweep(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(str(tmp_path))}/s.toml.*{re.escape(message)}"):
        read(tmp_path, text)


def test_the_command_line_replaces_what_is_in_the_file() -> None:
    file = Settings({"ppr": "500", "tick": "1us"}, {"speed": ["1", "2"], "jitter": ["0", "0.1"]})
    line = Settings({"jitter": "0.2"}, {"tick": ["2us"], "speed": ["3"]})
    assert line.over(file) == Settings({"ppr": "500", "jitter": "0.2"}, {"speed": ["3"], "tick": ["2us"]})


def test_flags_are_yes_or_no() -> None:
    with pytest.raises(ValueError, match=r"^--index must be yes or no, not 'maybe'$"):
        arguments({"index": "maybe"}, OPTIONS)


# docs/guides/sweep.md shows the file that is there, and a command that means the same.
DOCS = docs.DOCS / "guides"
PAGE = (DOCS / "sweep.md").read_text()


def test_the_file_is_shown_as_it_is() -> None:
    assert f"```toml\n{(DOCS / 'sweep.toml').read_text()}```" in PAGE


def test_the_options_beside_it_mean_the_same() -> None:
    options = by_name(sweep) | point_options()
    command = re.search(r"^    tachometry sweep (--lines(?:.*\\\n)*.*)$", PAGE, re.MULTILINE)
    assert command is not None
    words = shlex.split(command[1].replace("\\\n", ""))
    raw, _, _ = sweep.make_parser(click.Context(sweep)).parse_args(words)
    file = of_file(DOCS / "sweep.toml", options)
    for output in ("results", "plot"):
        del file.fixed[output]
    assert of_command_line(raw, options) == file
