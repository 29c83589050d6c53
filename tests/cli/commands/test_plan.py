"""`tachometry plan`."""

import csv
import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from support.command import run

from tachometry.cli.reports.core import size_rows
from tachometry.sim.studies.estimate import Estimate
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


def test_a_low_pass_filter_is_late(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", "--ppr", "500", "--max-speed", "400rad/s", "--lowpass", "100Hz") == 0
    rows, _, _ = tables(capsys.readouterr().out)
    assert rows["method"].startswith("TRACK")
    assert rows["delay"].endswith(
        f" from tick to velocity and {1e3 / (2 * math.pi * 100):.3f}ms by the low-pass filter"
    )


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
        rounding = SPEC.velocity.rad_per_s_per_lsb / 2
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
            (*(float(row[f"{name}_rpm"]) for name in ("speed", "resolution", "disc")),) for row in csv.DictReader(file)
        ]
    rpm = math.pi / 30
    errors = {speed: (q_v + disc, q_v) for speed, q_v, disc in shown if speed >= float(least[1])}
    greatest = max(errors, key=lambda speed: errors[speed][0])
    assert float(match[2]) == pytest.approx(greatest, rel=1e-3)
    lsb = json.loads((tmp_path / "core" / "tachometer.json").read_text())["velocity"]["rad_per_s_per_lsb"] / rpm
    for told_error, error in zip((match[1], ideal[1]), errors[greatest], strict=True):
        assert float(told_error) == pytest.approx(error, rel=0.005, abs=1.1 * lsb)


@pytest.mark.usefixtures("mapped")
def test_cells_and_clock_are_those_of_the_core_with_its_bus(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", *OPTIONS) == 0
    alone, _, _ = tables(capsys.readouterr().out)
    assert run("plan", *OPTIONS, "--bus", "apb", "--family", "gowin") == 0
    on_bus, _, _ = tables(capsys.readouterr().out)
    cells = [int(re.sub(r"about ([\d,]+),.*", r"\1", rows["cells"]).replace(",", "")) for rows in (alone, on_bus)]
    assert cells[0] + 100 < cells[1]
    assert alone["cells"].endswith("(ECP5)")
    assert alone["greatest clock"].endswith("MHz (ECP5); seeds of the router differ by 8%")
    assert "MHz (Gowin GW1N)" in on_bus["greatest clock"]
    assert on_bus["registers"].startswith("9 of 32 bits on apb")
    assert "warning" not in alone


def test_a_clock_out_of_reach_is_warned_of() -> None:
    found = Estimate("ecp5", 1290, 905, 94e6, 100_000_000, ("--method s", 209.4e6))
    assert dict(size_rows(found))["warning"] == "--clock 100MHz is above that: --method s reaches about 209 MHz"
    assert dict(size_rows(replace(found, remedy=None)))["warning"].startswith(
        "--clock 100MHz is above that: take a lower"
    )
    far = dict(size_rows(replace(found, remedy=None, wanted_hz=400_000_000)))["warning"]
    assert far == "--clock 400MHz is above that: take a lower --clock"
    assert "warning" not in dict(size_rows(replace(found, wanted_hz=94_000_000)))


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


@pytest.mark.usefixtures("mapped")
def test_equal_options_give_equal_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In another process, too."""

    def command(name: str) -> list[str]:
        folder = tmp_path / name
        files = {"--plot": folder / "p.png", "--csv": folder / "p.csv"}
        return ["plan", *OPTIONS, *(str(word) for pair in files.items() for word in pair)]

    assert run(*command("one")) == 0
    assert run("plan", *OPTIONS, "--plot", tmp_path / "one" / "p.pdf") == 0
    done = subprocess.run(
        [sys.executable, "-m", "tachometry", *command("two")],
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
