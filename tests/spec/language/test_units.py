"""One grammar for all quantities: every unit is right wherever the quantity fits."""

import math
from fractions import Fraction
from pathlib import Path

import pytest
from support.command import run

from tachometry.sim.encoder.imperfections import Bounce
from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.spec import ParameterError, Speed, Timing
from tachometry.spec.formats.velocity_output import parse_lsb
from tachometry.spec.language.units import (
    ANGLE,
    BANDWIDTH,
    FRACTION,
    FREQUENCY,
    PI,
    SPEED,
    TIME,
    TORQUE,
    SpeedUnit,
    ceil_log2,
    parse_bandwidth,
    parse_time,
    ratio,
    read_exactly,
    rounded,
)
from tachometry.spec.methods.adaptive import parse_target


def test_times_frequencies_speeds_and_angles_are_read_alike() -> None:
    timing = Timing.parse("100MHz", "50ns", "1us")
    assert (timing.clock_hz, timing.tick_cycles, timing.max_ticks) == (10**8, 5, 20)
    assert Timing.parse("1GHz", "50ns", "1us").tick_cycles == 50
    assert parse_motion("constant:10rad/s:50ns").duration == 50e-9
    assert parse_motion("sine:1rad/s:1MHz:1us").sine_frequency == 1e6
    assert Bounce.parse("3:50ns").time_s == 50e-9
    assert Vibration.parse("1deg:1GHz").frequency_hz == 1e9
    assert parse_bandwidth("lowpass", "1MHz") == 2 * PI * 10**6


@pytest.mark.parametrize("units", [TIME, FREQUENCY, SPEED, BANDWIDTH])
@pytest.mark.parametrize("number", ["1", "+.5", "-3.25", "7e-3", "2E+2"])
def test_numbers_are_exact(units: dict[str, object], number: str) -> None:
    for name, unit in units.items():
        assert read_exactly("x", f" {number} {name} ", units) == Fraction(number) * unit.exact  # type: ignore[arg-type, attr-defined]


def test_units_of_one_kind_are_turned_into_each_other() -> None:
    assert ratio("us", "ms") == 1000
    assert ratio("rpm", "rev/s") == 60
    assert ratio("deg", "rad") is None
    assert ratio("s", "Hz") is None


def test_speeds() -> None:
    assert Speed.parse("3000", "rpm") == Speed.parse("3000rpm") == Speed(Fraction(3000), "rpm")


@pytest.mark.parametrize(("text", "target"), [("0.1%", "0.001"), ("1e-3", "0.001"), (" 25 % ", "0.25")])
def test_fractions(text: str, target: str) -> None:
    assert parse_target("adaptive", text) == Fraction(target)


@pytest.mark.parametrize("text", ["20us", "20µs", "20μs", "20 µs"])
def test_micro_may_be_written_with_its_sign(text: str) -> None:
    assert parse_time("tick", text) == Fraction(20, 10**6)
    assert str(Timing.parse("1MHz", text, "1ms")) == str(Timing.parse("1MHz", "20us", "1ms"))


@pytest.mark.parametrize(
    ("text", "bits"), [("2^-4", 4), ("0.0625", 4), (".5", 1), ("1", 0), ("1.0", 0), ("4", -2), ("2^3", -3)]
)
def test_an_lsb_is_a_power_of_two(text: str, bits: int) -> None:
    assert parse_lsb("lsb", text) == bits


@pytest.mark.parametrize("text", ["0", "0.0", "0.06", "0.2", "3", "-0.5", "1/16", "1e-1", "", "2^x", "0." + "0" * 200])
def test_what_is_no_lsb(text: str) -> None:
    with pytest.raises(ParameterError, match=r"^lsb must be a power of two such as 2\^-10 or 0.0625, not "):
        parse_lsb("lsb", text)


@pytest.mark.parametrize(
    ("words", "status"),
    [
        ("--clock 100MHz --tick 50ns --max-time 1us --motion constant:10rad/s:500ns", 0),
        ("--clock 0.1GHz --tick 50ns --max-time 1us --motion sine:5rpm:1MHz:1us --vibration 1deg:1MHz", 0),
        ("--clock 0.1GHz --tick 50ns --max-time 1us --motion stop:1us --phase-error 5deg --bounce 2:50ns", 0),
        ("--clock 1MHz --tick 20µs --motion ramp:0:20rad/s:2000µs --jitter 5% --lost 0.1%", 0),
        ("--clock 1MHz --tick 20us --motion ramp:0:20rad/s:2ms --jitter 5us", 2),
        ("--clock 1e9999Hz --motion stop:1us", 2),
        ("--clock 1MHz --lowpass 1e9999Hz --motion stop:1us", 2),
        ("--method rairan --adaptive 1e999999999 --motion stop:1us", 2),
        ("--motion stop:1us --phase-error 5rpm", 2),
    ],
)
def test_on_the_command_line(words: str, status: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("simulate", "--ppr", "24", "--engine", "pysim", *words.split()) == status
    err = capsys.readouterr().err
    assert err.count("\n") == (status > 0)


def test_pi_to_50_digits() -> None:
    """The first 50 decimals. Machin: π/4 = 4·arctan(1/5) − arctan(1/239)."""

    def arctan(n: int) -> Fraction:
        return sum((Fraction((-1) ** k, (2 * k + 1) * n ** (2 * k + 1)) for k in range(80)), Fraction(0))

    exact = 4 * (4 * arctan(5) - arctan(239))
    assert 0 <= exact - PI < Fraction(1, 10**50)
    assert SPEED["rev/s"].exact == 2 * PI


@pytest.mark.parametrize("k", [-40, -3, -1, 0, 1, 2, 22, 90])
def test_logarithms_are_rounded_up(k: int) -> None:
    power = Fraction(2) ** k
    for number, wanted in (
        (power, k),
        (power * Fraction(10**9 + 1, 10**9), k + 1),
        (power * Fraction(10**9 - 1, 10**9), k),
        (power * Fraction(3, 2), k + 1),
        (power * Fraction(2, 3), k),
        (power * Fraction(4, 7), k),
    ):
        assert ceil_log2(number) == wanted


def test_the_least_and_the_greatest_number() -> None:
    assert read_exactly("x", "1e30Hz", FREQUENCY) == 10**30
    assert read_exactly("x", "1e-30Hz", FREQUENCY) == Fraction(1, 10**30)
    assert read_exactly("x", "-1e30Hz", FREQUENCY) == -(10**30)
    assert read_exactly("x", "0Hz", FREQUENCY) == 0
    for text in ("1.01e30Hz", "0.99e-30Hz", "-1.01e30Hz", "1e31Hz", "1e-31Hz"):
        with pytest.raises(ParameterError, match=f"^x must be of a size from 1e-30 to 1e30, not '{text}'$"):
            read_exactly("x", text, FREQUENCY)


@pytest.mark.parametrize(
    ("value", "digits", "below", "above"),
    [
        (Fraction(1, 3), 4, "0.3333", "0.3334"),
        (Fraction(2, 3), 4, "0.6666", "0.6667"),
        (-Fraction(2, 3), 2, "-0.67", "-0.66"),
        (18_849.556, 6, "18849.5", "18849.6"),
        (Fraction(301_592_895), 4, "3.015e+08", "3.016e+08"),
        (Fraction(99_999), 4, "9.999e+04", "1e+05"),
        (Fraction(5, 2), 2, "2.5", "2.5"),
    ],
)
def test_limits_are_rounded_so_that_they_are_allowed(value: Fraction, digits: int, below: str, above: str) -> None:
    assert rounded(value, up=False, digits=digits) == below
    assert rounded(value, up=True, digits=digits) == above


def test_sizes_of_units() -> None:
    """Of the first of each table."""
    assert [unit.exact for unit in TIME.values()] == [1, Fraction(1, 10**3), Fraction(1, 10**6), Fraction(1, 10**9)]
    assert [unit.exact for unit in FREQUENCY.values()] == [1, 10**3, 10**6, 10**9]
    assert [unit.exact for unit in SPEED.values()] == [1, 2 * PI, PI / 30]
    assert [unit.exact for unit in ANGLE.values()] == [1, Fraction(1, 1000), PI / 180]
    assert [unit.exact for unit in BANDWIDTH.values()] == [1, *(2 * PI * 10**power for power in (0, 3, 6, 9))]
    assert [unit.exact for unit in TORQUE.values()] == [1, Fraction(1, 1000)]
    assert [unit.exact for unit in FRACTION.values()] == [1, Fraction(1, 100)]
    assert [unit.nearest(Fraction(7)) for unit in TIME.values()] == [7.0, 7e-3, 7e-6, 7e-9]
    assert SPEED["rpm"].nearest(Fraction(30)) == math.pi


def test_speeds_are_shown_in_their_unit() -> None:
    shown = [SpeedUnit(name).of(2 * math.pi) for name in ("rad/s", "rev/s", "rpm")]
    assert shown == pytest.approx([2 * math.pi, 1, 60])


def test_numbers_of_up_to_400_characters_are_read() -> None:
    assert read_exactly("x", "1." + "0" * 396 + "Hz", FREQUENCY) == 1
    with pytest.raises(ParameterError):
        read_exactly("x", "1." + "0" * 397 + "Hz", FREQUENCY)
