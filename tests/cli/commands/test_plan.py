"""`tachometry plan`."""

import csv
import json
import math
import os
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from support.command import run

from tachometry.sim.theory import tsuji
from tachometry.spec import Encoder, Speed, STachometer, Timing
from tachometry.spec.formats.reciprocal import DividedReciprocal
from tachometry.spec.registers.manifest import manifest

OPTIONS = "--method s --ppr 500 --clock 48MHz --tick 20us --max-time 10ms --max-speed 400rad/s".split()
SPEC = STachometer(
    encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"), max_speed=Speed.parse("400rad/s")
)


def tables(text: str) -> tuple[dict[str, str], list[str], list[list[str]]]:
    """Return the rows of the configuration, the heads of the second table and its rows."""
    first, second, *_ = text.split("\n\n")
    rows = [re.split(r" {2,}", line.strip(), maxsplit=1) for line in first.splitlines()]
    heads, *lines = (re.split(r" {2,}", line.strip()) for line in second.splitlines())
    return dict(rows), heads, lines


def test_configuration_agrees_with_the_manifest(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", *OPTIONS, "--filter", "3", "--decoding", "2") == 0
    rows, _, _ = tables(capsys.readouterr().out)
    spec = STachometer(encoder=Encoder(500, 2), timing=SPEC.timing, max_speed=SPEC.max_speed, filter_clocks=3)
    described = json.loads(json.dumps(manifest(spec)))
    assert rows["encoder"] == "500 pulses per revolution x2: 1000 counts"
    assert rows["clock"] == "48,000,000 Hz"
    assert rows["tick"] == "20us (960 clocks)"
    assert rows["maximum time"] == "10ms (500 ticks)"
    assert rows["unit velocity"] == "314.159 rad/s (1 count per tick)"
    assert rows["greatest speed"] == "628.319 rad/s (2 counts per tick)"
    assert float(rows["one LSB of velocity"].split()[3]) == pytest.approx(100 * math.pi / 65536, rel=1e-5)
    assert rows["full scale"] == "2 count/tick = 628.319 rad/s, either way"
    assert {name: int(bits) for name, bits in (pair.split() for pair in rows["widths"].split(", "))} == {
        port["name"]: port["width"] for port in described["ports"] if port["width"] > 1
    }
    assert isinstance(spec.form.reciprocal, DividedReciprocal)
    # All of its bits but the last, which is 1, the first digit, and a clock to begin.
    assert rows["reciprocal"] == f"divided in {spec.form.reciprocal.width + 1} clocks between two ticks"
    for name, clocks in described["latency_cycles"].items():
        assert rows[name].startswith(f"{clocks} clocks (")
    assert rows["pin_to_count"] == "5 clocks (104.2ns)"
    assert rows["standstill"] == "reads 0 at most 15ms (750 ticks) after the last count's tick"
    assert rows["method"] == "S, eq. (21), cancels alternate alterations"


def test_speeds_from_one_count_in_the_maximum_time_to_the_greatest(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", *OPTIONS) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    _, heads, rows = tables(captured.out)
    assert heads == ["speed (rad/s)", "counts/tick", "m_s (ticks)", "T_m", "Q_V (rad/s)", "error/V (%)", "update by"]
    assert len(rows) == 12
    assert rows[0] == ["0.314159", "0.002", "500", "10ms", "0.0006296", "0.582", "alteration"]
    assert rows[-1][0] == "400"
    ratio = [float(b[0]) / float(a[0]) for a, b in pairwise(rows)]
    assert ratio == pytest.approx([ratio[0]] * 11, rel=1e-4)
    for speed, counts, m_s, t_m, q_v, percent, update_by in rows:
        units = float(speed) / (50 * math.pi)
        interval = 1 / abs(units - math.floor(units + 0.5))
        assert float(counts) == pytest.approx(units, rel=1e-5)
        assert float(m_s) == pytest.approx(interval, rel=1e-3)
        scale = 1e-3 if t_m.endswith("ms") else 1e-6
        assert float(t_m[:-2]) * scale == pytest.approx(interval * 20e-6, rel=1e-3)
        assert float(q_v) == pytest.approx(50 * math.pi / (interval * (interval - 1)), rel=1e-3)
        rounding = SPEC.scale.rad_per_s_per_lsb / 2
        assert float(percent) == pytest.approx(100 * (float(q_v) + rounding) / float(speed), rel=1e-2)
        assert update_by == "alteration"


@pytest.mark.parametrize("method", ["s", "mt", "track"])
def test_the_worst_error_is_told_with_where_it_is(
    method: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No row of the CSV has a greater one, in the unit of the greatest speed that was typed."""
    core = ["--ppr", "500", "--max-speed", "3000rpm", "--method", method]
    assert run("generate", *core, "-o", tmp_path / "core") == 0
    generated = capsys.readouterr().out.split()
    assert run("plan", *core, "--csv", tmp_path / "p.csv") == 0
    told = capsys.readouterr().out
    assert told.split("\n\n")[0].split() == generated[generated.index("method") :]
    rows = tables(told)[0]
    match = re.match(r"(\S+) rpm at a constant (\S+) rpm, measured in \S+, with a real disc$", rows["worst error"])
    ideal = re.search(r"an ideal one has (\S+) rpm there$", rows["real disc"])
    least = re.match(r"(\S+) rpm to 3000 rpm; below, ", rows["range"])
    assert match is not None
    assert ideal is not None
    assert least is not None
    with (tmp_path / "p.csv").open() as file:
        shown = [
            (*(float(row[f"{name}_rad_s"]) for name in ("speed", "resolution", "disc")),)
            for row in csv.DictReader(file)
        ]
    rpm = math.pi / 30
    errors = {speed: (q_v + disc, q_v) for speed, q_v, disc in shown if speed >= float(least[1]) * rpm}
    greatest = max(errors, key=lambda speed: errors[speed][0])
    assert float(match[2]) * rpm == pytest.approx(greatest, rel=1e-3)
    lsb = json.loads((tmp_path / "core" / "tachometer.json").read_text())["velocity"]["rad_per_s_per_lsb"]
    for told_error, error in zip((match[1], ideal[1]), errors[greatest], strict=True):
        assert float(told_error) * rpm == pytest.approx(error, rel=0.005, abs=1.1 * lsb)


def test_a_multiple_of_the_unit_velocity_is_forced(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", *OPTIONS, "--speeds", "0.5:1500rpm") == 0
    _, heads, rows = tables(capsys.readouterr().out)
    assert heads[0] == "speed (rpm)"
    assert rows[0][:4] == ["0.5", "0.000333333", "500", "10ms"]
    assert rows[0][4:] == ["3", "602", "maximum time (forced)"]
    assert rows[-1] == ["1500", "1", "500", "10ms", "3", "0.201", "maximum time (forced)"]


def test_plain_averaging_has_the_wider_bound(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", *OPTIONS, "--no-cancel", "--speeds", "1:1500rpm") == 0
    rows, _, lines = tables(capsys.readouterr().out)
    assert rows["method"] == "S, eq. (17)"
    assert lines[-1][4] == f"{1500 / 251:.4g}"


@pytest.mark.parametrize(
    ("text", "first", "last"),
    [
        ("10:100rad/s", "10 rad/s", "100 rad/s"),
        ("1:2rev/s", "1 rev/s", "2 rev/s"),
        ("600rpm:20rev/s", "10 rev/s", "20 rev/s"),
        (" 1e1rpm : 75rev/s ", "0.166667 rev/s", "75 rev/s"),  # exactly the greatest speed
        (None, "0.314159 rad/s", "400 rad/s"),
    ],
)
def test_units_of_speeds(text: str | None, first: str, last: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", *OPTIONS, *([] if text is None else ["--speeds", text])) == 0
    _, heads, rows = tables(capsys.readouterr().out)
    unit = heads[0].removeprefix("speed (").removesuffix(")")
    assert (f"{rows[0][0]} {unit}", f"{rows[-1][0]} {unit}") == (first, last)


def test_without_a_greatest_speed_ten_counts_per_tick_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", "--method", "s", "--ppr", "500") == 0
    _, _, rows = tables(capsys.readouterr().out)
    assert (rows[0][1], rows[-1][1]) == ("0.002", "10")


def test_csv_holds_the_dense_samples(tmp_path: Path) -> None:
    assert run("plan", *OPTIONS, "--csv", tmp_path / "new" / "p.csv") == 0
    with (tmp_path / "new" / "p.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > 1000
    assert float(rows[-1]["speed_rad_s"]) == 400
    assert {row["forced"] for row in rows} == {"0", "1"}
    for row in rows:
        m_s = min(float(tsuji.tsuji_eq20_interval(float(row["speed_rad_s"]), 2000, 20e-6)), 500)
        assert float(row["interval_ticks"]) == pytest.approx(m_s)
        assert float(row["measurement_time_s"]) == pytest.approx(20e-6 * m_s)


WITHOUT_AMARANTH = """
import sys
from tachometry.cli.main import main
try:
    main()
finally:
    assert "matplotlib" in sys.modules and "amaranth" not in sys.modules
"""


def test_equal_options_give_equal_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In a process that loads no Amaranth, too."""

    def command(name: str) -> list[str]:
        folder = tmp_path / name
        files = {"--plot": folder / "p.png", "--csv": folder / "p.csv"}
        return ["plan", *OPTIONS, *(str(word) for pair in files.items() for word in pair)]

    assert run(*command("one")) == 0
    assert run("plan", *OPTIONS, "--plot", tmp_path / "one" / "p.pdf") == 0
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_AMARANTH, *command("two")],
        env={**os.environ, "PYTHONHASHSEED": "7", "TZ": "Asia/Tokyo", "LC_ALL": "C", "PYTHONUTF8": "0"},
        capture_output=True,
        text=True,
        check=True,
    )
    out = capsys.readouterr().out
    assert done.stdout == out[: len(out) // 2]
    assert out.isascii()
    for name in ("p.png", "p.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    assert (tmp_path / "one" / "p.png").read_bytes().startswith(b"\x89PNG\r")
    assert (tmp_path / "one" / "p.pdf").read_bytes().startswith(b"%PDF-")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            "--speeds 5",
            "--speeds must be LO:HI, both greater than 0, in rad/s, rev/s or rpm such as 10:3000rpm,",
        ),
        ("--speeds :", "--speeds must be LO:HI, both greater than 0"),
        (
            "--speeds 1:2:3",
            "--speeds must be LO:HI, both greater than 0, in rad/s, rev/s or rpm such as",
        ),
        ("--speeds 0:5rpm", "--speeds must be LO:HI, both greater than 0"),
        ("--speeds -1:5rpm", "--speeds must be LO:HI, both greater than 0"),
        ("--speeds 1m/s:5rpm", "--speeds must be LO:HI, both greater than 0"),
        ("--speeds nan:inf", "--speeds must be LO:HI, both greater than 0"),
        ("--speeds 5:5rad/s", "--speeds must be LO:HI with LO less than HI, not '5:5rad/s'"),
        ("--speeds 50:5rpm", "--speeds must be LO:HI with LO less than HI, not '50:5rpm'"),
        ("--speeds 1:75.01rev/s", "--speeds must be at most 3 counts per tick (75rev/s), the most that this core"),
        ("--speeds 1:1e29rad/s", "--speeds must be at most 3 counts per tick (471.239rad/s)"),
        ("--speeds 1:1e999", "--speeds must be LO:HI, both greater than 0"),
        ("--speeds 1e999:1", "--speeds must be LO:HI, both greater than 0"),
        ("--speeds 1e-29:1rad/s", "--speeds must be at least 1.5708e-07rad/s, not '1e-29:1rad/s'"),
        ("--speeds 1e-9:1rpm", "--speeds must be at least 1.5e-06rpm, not '1e-9:1rpm'"),
        ("--max-speed 1e999rpm", "--max-speed must be of a size from 1e-30 to 1e30, not '1e999rpm'"),
        ("--max-time 1us", "--max-time must be a whole number of ticks"),
        ("--plot {new}/p.gif", "Invalid value for '--plot': file must end in .png, .pdf or .svg, not '{new}/p.gif'"),
        ("--plot {new}/p.png --csv {new}/p.png", "--plot and --csv must be different files, not both {new}/p.png"),
        ("--csv {new}/..", "--csv must be a file, which"),
        ("--plot {new}/p.png --csv {new}/../file/p.csv", "file/p.csv: Not a directory"),
        ("--csv {new}/p.csv --speeds 2:1rad/s", "--speeds must be LO:HI with LO less than HI"),
        ("--motion stop:1s", "No such option '--motion'"),
    ],
)
def test_what_cannot_be_is_told_in_one_line(
    options: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("before")
    new = str(tmp_path / "new")
    assert run("plan", *OPTIONS, *options.replace("{new}", new).split()) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("tachometry: error: ")
    assert captured.err.count("\n") == 1
    assert message.replace("{new}", new) in captured.err
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"file": "before"}


def test_nothing_is_left_when_the_figure_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tachometry.sim.plots.plan.save_plan_plot", interrupted)
    assert run("plan", *OPTIONS, "--csv", tmp_path / "new" / "p.csv", "--plot", tmp_path / "p.png") == 130
    assert not list(tmp_path.iterdir())


def test_the_range_ends_where_a_filter_swallows_the_lines(capsys: pytest.CaptureFixture[str]) -> None:
    """A level lasts two of 2000 counts: at π rad/s that is 2 ms."""
    assert run("plan", "--ppr", "500", "--filter", "2ms") == 0
    assert "to 3.14159 rad/s" in capsys.readouterr().out
