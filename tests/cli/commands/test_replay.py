"""`tachometry replay`."""

import gzip
import itertools
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from support import docs
from support.captures import make_sr
from support.command import run
from support.formats import FORMATS, QUARTERS

from tachometry.sim.captures.text import write_csv
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import Recording, quadrature

ROOT = Path(__file__).parents[3]
WHEEL = ROOT / "tests/captures/wheel_turned_by_a_mouse.csv.gz"
CORE = "--ppr 100 --clock 20kHz --tick 1ms --max-time 10ms".split()


def recorded() -> Recording:
    return VirtualEncoder(100).record(parse_motion("ramp:0:20rad/s:100ms")).recording


def test_a_saved_capture_gives_the_same_trace(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = "--motion ramp:-10rad/s:20rad/s:200ms --jitter 0.2 --illegal 0.01 --vibration 1mrad:80Hz --seed 5".split()
    names = {"--trace": "t.csv", "--counts": "c.csv", "--save-capture": "s.sr", "--vcd": "v.vcd"}

    def outputs(folder: str) -> list[str]:
        return [word for option, name in names.items() for word in (option, str(tmp_path / folder / name))]

    assert run("simulate", *CORE, *options, *outputs("one")) == 0
    assert run("replay", tmp_path / "one" / "s.sr", *CORE, *outputs("two")) == 0
    for name in ("t.csv", "c.csv", "s.sr"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    simulated, replayed = capsys.readouterr().out.split("PASS")[:2]
    for row in ("simulated", "updates", "mismatches"):
        lines = [" ".join(line.split()) for part in (simulated, replayed) for line in part.splitlines() if row in line]
        assert lines[0] == lines[-1]


def test_a_pipe_is_as_its_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_csv(tmp_path / "c.csv", recorded())
    with (tmp_path / "c.csv").open(encoding="utf-8") as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        said = [(run("replay", capture, *CORE), capsys.readouterr().out) for capture in ("-", tmp_path / "c.csv")]
    assert said[0] == said[1]
    assert said[0][0] == 0


def test_what_is_unknown_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_csv(tmp_path / "c.csv", recorded())
    assert run("replay", tmp_path / "c.csv", *CORE, "--plot", tmp_path / "p.pdf") == 0
    rows = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "counts in unknown" in rows
    assert "counts out 62" in rows
    assert "errors flagged 0" in rows
    assert "velocity error unknown: a capture does not have the true speed" in rows


@pytest.mark.parametrize(
    ("rows", "options", "said"),
    [
        ("abz", "--ppr 25", "indices are 100 counts apart; --ppr 25"),
        ("abz", "--ppr 100", "indices are 100 counts apart; --ppr 100 with x4 says 400, and --ppr 25 if it comes once"),
        ("zxab", "--ppr 25 --a z --b x", "x never changes; a and b do: see --b"),
        ("xyab", "--ppr 25 --a x --b y", "x and y never change; a and b do: see --a and --b"),
    ],
)
def test_what_contradicts_itself_is_warned_of(
    rows: str, options: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    level = {"a": "0110", "b": "0011"}
    lines = [f"time,{','.join(rows)}"]
    for k in range(361):
        of = {name: cycle[k % 4] for name, cycle in level.items()} | {"x": "0", "y": "1", "z": str(+(k % 100 == 98))}
        lines.append(",".join([f"{k / 2000:.6f}", *(of[name] for name in rows)]))
    (tmp_path / "c.csv").write_text("\n".join(lines) + "\n")
    index = ["--index"] if rows == "abz" else []
    assert run("replay", tmp_path / "c.csv", *CORE[2:], *options.split(), *index) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert (f"WARNING: {said}" in told) == (options != "--ppr 25")
    if index:
        assert "lines a from a, b from b, z from z captured 0.18 s, 360 changes of the lines speed min " in told
        assert "index 3 times, the last at position 298, 100 counts apart" in told
        assert re.search(r"PASS: .*[0-9]+ values\); wiring and pulses per turn are not checked", told)


@pytest.mark.parametrize(
    ("high", "said"),
    [
        ({40}, None),
        (
            {40, 41, 42, 43},
            "3 counts apart, as it is taken where z rises: z may be high for longer than a quarter of a",
        ),
        (
            {*range(100)} - {40},
            "2 counts apart, as it is taken where z rises: z is high 97.9 % of the time, so it may be",
        ),
    ],
)
def test_an_index_at_two_places_is_warned_of(
    high: set[int], said: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shaft = [*range(61), *range(60, 19, -1), *range(20, 61)]
    rows = [f"{k / 2000:.6f},{'0110'[n % 4]},{'0011'[n % 4]},{int(n in high)}" for k, n in enumerate(shaft)]
    (tmp_path / "c.csv").write_text("\n".join(["time,a,b,z", *rows, ""]))
    assert run("replay", tmp_path / "c.csv", *CORE, *"--index --index-at edge".split()) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert ("WARNING" in told) == (said is not None)
    assert f"WARNING: to and fro, the index is found {said}" in told or said is None
    if said is None:  # by default it is missed
        assert run("replay", tmp_path / "c.csv", *CORE, "--index") == 0
        told = " ".join(capsys.readouterr().out.split())
        assert "index 0 times; passed by without the state of --index-at 3 times" in told
        assert "it is mostly high in A=0,B=0: type --index-at A=0,B=0, or edge" in told


def test_channels_are_chosen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capture = tmp_path / "c.csv"
    write_csv(capture, recorded())
    capture.write_text(capture.read_text().replace("time,a,b", "time,left,right"))
    assert run("replay", capture, *CORE, "--a", "right", "--b", "0") == 0
    assert "counts out -62" in [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]


# What the guide calls a capture, and the format that it has.
IN_GUIDE = {
    "digital": "Saleae Logic 2",
    "scope": "Rigol",
    "timer": "ticks of a timer",
    "bare": "no line of names",
    "port": "both lines in a number",
    "sim": "waveform with a vector",
}


def commands_of_guide() -> list[str]:
    section = docs.page("guides/captures.md").partition("## Captures of real encoders")[2].partition("\n## ")[0]
    return re.findall(r"^tachometry (.*)", section, re.MULTILINE)


def test_the_guide_shows_every_kind() -> None:
    assert {Path(shlex.split(command)[1]).stem for command in commands_of_guide()} == {"run", *IN_GUIDE}


@pytest.mark.parametrize("command", commands_of_guide())
def test_the_guide(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "build").mkdir()
    monkeypatch.chdir(tmp_path)
    arguments = shlex.split(command)
    path = Path(arguments[1])
    if path.stem == "run":
        levels = b"".join(bytes([0, 4, 12, 8]) for _ in range(QUARTERS // 4)) + b"\0"
        make_sr(path, [levels], {3: "D2", 4: "D3"}, samplerate="4 kHz")
    else:
        (form,) = (form for form in FORMATS if form.name == IN_GUIDE[path.stem])
        assert path.suffix == form.suffix
        path.write_bytes(form.content)
    assert run(*arguments, "--method", "m") == 0  # whose core is compiled sooner than that of track
    said = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert f"counts out {QUARTERS}" in said
    assert "errors flagged 0" in said


def test_a_real_shaft_loses_no_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command of docs/guides/captures.md, and the net of the edges, found from the file's rows alone."""
    page = (ROOT / "docs" / "guides" / "captures.md").read_text(encoding="utf-8")
    (command,) = re.findall(r"^tachometry (replay .*mouse.*)$", page, re.MULTILINE)
    (tmp_path / "tests").symlink_to(ROOT / "tests")
    monkeypatch.chdir(tmp_path)
    assert run(*command.split(), "--method", "m") == 0
    rows = [line.split(",") for line in gzip.decompress(WHEEL.read_bytes()).decode().split()[1:]]
    quarters = ["00,10,11,01".split(",").index(a + b) for _, a, b in rows]
    steps = [(after - before + 1) % 4 - 1 for before, after in itertools.pairwise(quarters)]
    assert set(steps) <= {-1, 1}
    said = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert f"counts out {sum(steps)}" in said
    assert sum(steps) == 3680
    assert (tmp_path / "build" / "wheel.png").stat().st_size > 0


# Edges that come faster than the clock, or the capture, can tell; and times and speeds that a core cannot have.
SLOW = "--ppr 500 --clock 20kHz --tick 1ms --engine pysim".split()


def last_lines(text: str) -> str:
    """Return what stands below the table, in one line."""
    return " ".join(text[text.index("WARNING") :].split())


def test_edges_within_a_clock_are_counted_and_told(capsys: pytest.CaptureFixture[str]) -> None:
    # 2000 counts a turn: 60,000 edges a second, three in each clock.
    assert run("simulate", *SLOW, "--motion", "constant:30rev/s:50ms") == 0
    told = last_lines(capsys.readouterr().out)
    assert told.startswith("WARNING: 1999 edges came within one clock of another") or " edges came within" in told
    n_edges = int(told.split()[1])
    assert abs(n_edges - 2000) <= 3
    assert "WARNING: counts out differ from counts in by -" in told
    assert told.endswith("neither was compared with the shaft: see the warning")
    assert run("simulate", *SLOW, "--motion", "constant:1rev/s:50ms") == 0
    assert "WARNING" not in capsys.readouterr().out


def test_a_capture_that_was_sampled_too_slowly_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    level = [quadrature(np.array([2 * k]))[0] for k in range(60)]  # every other edge is missing
    rows = [f"{1e-3 * k},{one & 1},{one >> 1}" for k, one in enumerate(level)]
    (tmp_path / "c.csv").write_text("time,a,b\n" + "\n".join(rows) + "\n")
    assert run("replay", tmp_path / "c.csv", *SLOW) == 0
    assert "at 59 instants of the capture both lines change" in last_lines(capsys.readouterr().out)


def test_merged_edges_are_those_beyond_the_first_of_a_clock() -> None:
    time = np.array([0, 0.1, 0.15, 0.2, 1.0, 1.5, 2.5, 2.6])
    level = quadrature(np.arange(8))
    recording = Recording.of_level(time, level, 3.0)
    assert recording.n_merged(1, 4) == 4  # clocks 1, 1, 1, 1, 2, 3, 3
    assert recording.n_merged(1, 3) == 3
    assert recording.n_merged(100, 300) == 0
    assert recording.n_together == 0
    assert Recording.of_level(time, quadrature(2 * np.arange(8)), 3.0).n_together == 7


def test_a_speed_that_is_cut_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", "--ppr=500", "--clock=1MHz", "--tick=20us", "--max-speed", "100000rpm") == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "note greatest speed cut from 100000rpm to 30000rpm: 20 counts per tick is the most" in told


@pytest.mark.parametrize("command", ["generate", "plan"])
def test_times_that_are_stretched_are_told(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = "--ppr 500 --method mt --tick 10clk --max-time 20clk --min-time 5clk".split()
    assert run(command, *options, *(["-o", tmp_path] if command == "generate" else [])) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "note minimum time raised from 5 clocks to 21: a division takes 22" in told
    assert "note maximum time raised from 20 clocks to 22: a division takes 22" in told
    if command == "generate":
        described = json.loads((tmp_path / "tachometer.json").read_text())
        assert (described["min_time_cycles"], described["max_time_cycles"]) == (21, 22)
        assert described["parameters"]["min_time"] == 21
