"""`--unit` is the unit of all that commands show; the same speeds in rad/s are the reference."""

import csv
import json
import math
import re
from pathlib import Path

import pytest
from support.command import run
from support.nightly import only

CORE = "--ppr 100 --clock 100kHz --tick 1ms --max-time 20ms".split()
S = ["--method", "s"]
MOTION = ["--motion", "ramp:0:40rad/s:60ms"]
RAD_PER_S = {"rpm": math.pi / 30, "rev/s": 2 * math.pi}


def columns(path: Path, name: str) -> list[float]:
    with path.open(newline="") as file:
        return [float(row[name]) for row in csv.DictReader(file) if row[name]]


# The unit is a factor; tests/spec/language/test_units.py has all of them.
@pytest.mark.parametrize("unit", only(["rpm"], RAD_PER_S))
def test_traces_summaries_and_comparisons(unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    suffix, told = unit.replace("/", "_"), {}
    # With a fine LSB the velocities differ by what is rounded only; errors are compared at slightly other instants.
    for chosen, frac_bits in (("rad/s", "16"), (unit, "14")):
        unit_options = ["--unit", chosen, "--frac-bits", frac_bits]
        trace, table = tmp_path / f"{frac_bits}.csv", tmp_path / f"c{frac_bits}.csv"
        assert run("simulate", *CORE, *S, *MOTION, *unit_options, "--engine", "pysim", "--trace", trace) == 0
        assert run("compare", *CORE, *MOTION, *unit_options, "--methods", "m,difference", "--csv", table) == 0
        told[chosen] = capsys.readouterr().out
        assert set(re.findall(r"\b(?:rad/s|rev/s|rpm)(?=[\s)])", told[chosen])) == {chosen}
    scale = RAD_PER_S[unit]
    for name, files in (("velocity", ("16.csv", "14.csv")), ("rms", ("c16.csv", "c14.csv"))):
        reference, shown = (
            columns(tmp_path / files[0], f"{name}_rad_s"),
            columns(tmp_path / files[1], f"{name}_{suffix}"),
        )
        assert [value * scale for value in shown] == pytest.approx(
            reference, abs=1e-3, rel=0.05 if name == "rms" else 1e-3
        )
    errors = [float(re.findall(r"error, RMS +(\S+)", text)[0]) for text in told.values()]
    assert errors[1] * scale == pytest.approx(errors[0], rel=0.1)


def test_plans(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for unit in ("rad/s", "rpm"):
        assert (
            run("plan", *CORE, "--unit", unit, "--speeds", "1rev/s:2rev/s", "--csv", tmp_path / f"{unit[:3]}.csv") == 0
        )
        assert f"speed ({unit})" in capsys.readouterr().out
    for name in ("speed", "resolution"):
        reference, shown = columns(tmp_path / "rad.csv", f"{name}_rad_s"), columns(tmp_path / "rpm.csv", f"{name}_rpm")
        assert [value * RAD_PER_S["rpm"] for value in shown] == pytest.approx(reference)


def test_figures_are_labelled(tmp_path: Path) -> None:
    """The text of a figure is in its PDF, which is not compressed."""
    options = [*CORE, *MOTION, "--unit", "rpm", "--engine", "pysim", "--plot", tmp_path / "p.pdf"]
    assert run("simulate", *options) == 0
    assert (tmp_path / "p.pdf").stat().st_size > 1000


def test_the_core_is_described_when_it_is_generated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = (
        "--method s --ppr 2500 --clock 100MHz --tick 100us --max-speed 4000rpm --unit rpm --velocity-width 18".split()
    )
    assert run("generate", *options, "-o", tmp_path) == 0
    rows = {
        line.split("  ")[0]: line.split("  ", 1)[1].strip()
        for line in capsys.readouterr().out.splitlines()
        if "  " in line
    }
    described = json.loads((tmp_path / "tachometer.json").read_text())
    assert rows["full scale"] == "4020 rpm, either way"  # 67 counts in 100 us
    assert described["velocity"]["full_scale"] == 4020
    assert described["velocity"]["frac_bits"] == 5
    assert rows["one LSB of velocity"].startswith("2^-5 rpm = ")
    assert rows["widths"].startswith("velocity 18, interval 7, ")
    assert rows["tick_to_velocity"].startswith(f"{described['latency_cycles']['tick_to_velocity']} clocks")
    assert rows["range"].startswith("0.9139 rpm to 4000 rpm; ")
    assert rows["worst error"] == "45.7 rpm at a constant 30 rpm, measured in 200us, with a real disc"
    assert rows["advice"].startswith("track: ")
