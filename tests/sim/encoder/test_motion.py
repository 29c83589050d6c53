"""Motion profiles: closed forms, units, files, and what is said of texts that are wrong."""

import math
from pathlib import Path

import numpy as np
import pytest

from tachometry.sim.encoder.motion import Motion, Vibration, cos2pi, parse_motion, sin2pi

TOO_LARGE = "times, angles, speeds and accelerations of a motion must be below 1e30, in s and rad"


def csv_file(folder: Path, text: str) -> str:
    file = folder / "motion.csv"
    file.write_text(text)
    return str(file)


def test_sine_and_cosine_are_right_to_1e_15() -> None:
    phase = np.random.default_rng(1).uniform(-0.5, 0.5, 20_000)
    for function, reference in ((sin2pi, math.sin), (cos2pi, math.cos)):
        exact = np.array([reference(2 * math.pi * p) for p in phase])
        assert np.max(np.abs(function(phase) - exact)) < 1e-15
        assert np.max(np.abs(function(phase + 1000) - exact)) < 2e-12  # what is left of the phase there


def test_sine_is_exactly_0_at_half_turns_and_cosine_between_them() -> None:
    half_turns = np.array([-1, -0.5, 0, 0.5, 1, 7.5, 1e9])
    assert sin2pi(half_turns).tolist() == [0] * 7
    assert cos2pi(half_turns + 0.25).tolist() == [0] * 7


def test_constant() -> None:
    motion = parse_motion("constant:40rad/s:2s")
    assert motion.duration == 2
    assert motion.angle([0, 0.5, 2]).tolist() == [0, 20, 80]
    assert motion.speed([0, 0.5, 2]).tolist() == [40, 40, 40]
    assert motion.acceleration([0, 0.5, 2]).tolist() == [0, 0, 0]


def test_ramp() -> None:
    motion = parse_motion("ramp:2rad/s:-6rad/s:4s")
    assert motion.speed([0, 1, 2, 4]).tolist() == [2, 0, -2, -6]
    assert motion.angle([0, 1, 2, 4]).tolist() == [0, 1, 0, -8]
    assert motion.acceleration(3) == -2


def test_sine() -> None:
    motion = parse_motion("sine:3rad/s:50Hz:100ms")
    t = np.linspace(0, 0.1, 1001)
    phase = 2 * math.pi * 50 * t
    np.testing.assert_allclose(motion.speed(t), 3 * np.sin(phase), atol=1e-13)
    np.testing.assert_allclose(motion.angle(t), 3 * (1 - np.cos(phase)) / (2 * math.pi * 50), atol=1e-16)
    np.testing.assert_allclose(motion.acceleration(t), 3 * 2 * math.pi * 50 * np.cos(phase), atol=1e-10)


def test_trapezoid() -> None:
    motion = parse_motion("trapezoid:10rad/s:1s:3s")
    assert motion.breakpoints.tolist() == [0, 1, 4, 5]
    assert motion.speed([0, 0.5, 1, 2, 4, 4.5]).tolist() == [0, 5, 10, 10, 10, 5]
    assert motion.angle([0, 1, 4, 5]).tolist() == [0, 5, 35, 40]


def test_s_curve_begins_and_ends_without_acceleration() -> None:
    motion = parse_motion("s-curve:2rad/s:-6rad/s:4s")
    np.testing.assert_allclose(motion.speed([0, 1, 2, 4]), [2, 2 - 8 * (1 / 4 - 1 / (2 * math.pi)), -2, -6])
    np.testing.assert_allclose(motion.acceleration([0, 1, 2, 3.999999]), [0, -2, -4, 0], atol=1e-9)
    assert motion.angle(4) == pytest.approx(-8)


def test_segments_are_repeated() -> None:
    texts = ("2*(stop:1s+ramp:0:+5rad/s:2s)", "stop:1s+ramp:0:5rad/s:2s+stop:1s+ramp:0:5rad/s:2s")
    angles = [parse_motion(text).angle([1, 4, 6]) for text in texts]
    assert angles[0].tolist() == angles[1].tolist()
    assert parse_motion("stop:1s+10*(constant:1rad/s:1s)+stop:1s").angle(12) == 10


def test_segments_join_with_continuous_angle() -> None:
    motion = parse_motion(
        "constant:4rad/s:1s + stop:500ms+sine:2rad/s:1.5Hz:1s+ramp:-1rad/s:3rad/s:2s+trapezoid:1rev/s:10ms:1ms"
    )
    assert motion.breakpoints.tolist() == pytest.approx([0, 1, 1.5, 2.5, 4.5, 4.51, 4.511, 4.521], abs=1e-14)
    join = motion.breakpoints[1:-1]
    np.testing.assert_allclose(motion.angle(np.nextafter(join, 0)), motion.angle(join), rtol=1e-14)
    assert motion.angle(1.5) == 4
    assert motion.angle(2.5) == pytest.approx(4 + 4 / (2 * math.pi * 1.5), rel=1e-14)
    assert motion.angle(4.5) - motion.angle(2.5) == pytest.approx(2, rel=1e-14)


def test_at_a_breakpoint_speed_is_that_of_the_segment_that_begins() -> None:
    motion = parse_motion("constant:4rad/s:1s+constant:-3rad/s:1s")
    assert motion.speed([np.nextafter(1, 0), 1, 2]).tolist() == [4, -3, -3]


def test_speed_and_acceleration_are_derivatives() -> None:
    motion = parse_motion("ramp:-5rad/s:20rad/s:1s+sine:7rad/s:3Hz:1s")
    t = np.linspace(0.01, 1.99, 500)
    t = t[np.abs(t - 1) > 1e-3]
    h = 1e-5
    np.testing.assert_allclose(motion.speed(t), (motion.angle(t + h) - motion.angle(t - h)) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(motion.acceleration(t), (motion.speed(t + h) - motion.speed(t - h)) / (2 * h), atol=1e-4)


def test_before_and_after_the_motion_the_ends_hold() -> None:
    motion = parse_motion("ramp:1rad/s:3rad/s:1s")
    assert motion.angle([-1, 5]).tolist() == [0, 2]
    assert motion.speed([-1, 5]).tolist() == [1, 3]


@pytest.mark.parametrize(
    ("text", "speed"),
    [
        ("7rad/s", 7),
        ("+7rad/s", 7),
        ("-7.5rad/s", -7.5),
        (".5 rad/s", 0.5),
        ("1e+2rad/s", 100),
        ("1E-2rad/s", 0.01),
        ("2rev/s", 4 * math.pi),
        ("-60rpm", -2 * math.pi),
    ],
)
def test_units_of_speed(text: str, speed: float) -> None:
    assert parse_motion(f"constant:{text}:1s+stop:1s").speed(0) == pytest.approx(speed, rel=1e-15)


@pytest.mark.parametrize(("text", "time"), [("3s", 3), ("9ms", 0.009), ("7us", 7e-6), ("50ns", 50e-9), ("1e-3s", 1e-3)])
def test_units_of_time_are_rounded_once(text: str, time: float) -> None:
    assert parse_motion(f"stop:{text}").duration == time


@pytest.mark.parametrize("number", ["0.1", "7", "33.3", "1e-3", "1234.56789", "-0.07", "2.5e3"])
def test_units_with_pi_are_rounded_as_ever(number: str) -> None:
    """To the bit: recorded motions stay as they are."""
    for unit, factor in (("rev/s", 2 * math.pi), ("rpm", math.pi / 30), ("rad/s", 1.0)):
        assert parse_motion(f"constant:{number}{unit}:1s").start_speed[0] == float(number) * factor
    degrees = abs(float(number))
    assert Vibration.parse(f"{degrees}deg:1Hz").amplitude_rad == degrees * (math.pi / 180)


def test_numbers_that_would_fill_the_memory() -> None:
    for number in ("1e9999", "1e-9999", "1" * 500):
        with pytest.raises(ValueError, match=r"^SPEED of constant must be a number with one of the units "):
            parse_motion(f"constant:{number}rad/s:1s")


def test_units_of_frequency() -> None:
    assert (
        parse_motion("sine:1rad/s:2MHz:1s").sine_frequency
        == parse_motion("sine:1rad/s:0.002GHz:1s").sine_frequency
        == 2e6
    )
    assert (
        parse_motion("sine:1rad/s:2kHz:1s").sine_frequency == parse_motion("sine:1rad/s:2000:1s").sine_frequency == 2000
    )


@pytest.mark.parametrize(
    "text", ["ramp:0:20rad/s:1s", "ramp:-20rad/s:5rad/s:1s+constant:-3rad/s:2s", "sine:7rad/s:3Hz:1s"]
)
def test_max_travel_bounds_the_way(text: str) -> None:
    motion = parse_motion(text)
    way = np.sum(np.abs(np.diff(motion.angle(np.linspace(0, motion.duration, 100_001)))))
    assert way * (1 - 1e-9) <= motion.max_travel < 1.6 * way


def test_csv_is_interpolated_linearly_from_time_0(tmp_path: Path) -> None:
    file = csv_file(tmp_path, "time,angle_rad\n5,1\n6,3\n\n8,2\n")
    motion = parse_motion(f"csv:{file}")
    assert motion.breakpoints.tolist() == [0, 1, 3]
    assert motion.angle([0, 0.5, 1, 2, 3]).tolist() == [1, 2, 3, 2.5, 2]
    assert motion.speed([0, 0.5, 1, 2, 3]).tolist() == [2, 2, -0.5, -0.5, -0.5]


def test_csv_as_a_spreadsheet_writes_it(tmp_path: Path) -> None:
    file = csv_file(tmp_path, "\ufefftime, angle_rad\r\n0, 0\r\n1e0, -2\r\n")
    assert parse_motion(f" csv:{file} ").angle(0.5) == -1


@pytest.mark.parametrize(
    ("content", "column", "speed", "angle"),
    [
        ("time_ms,speed_rpm\n0,0\n1000,60\n3000,60\n", "", math.pi, 5 * math.pi),
        ("t;n [rev/s];a_deg\n0,0;0;0\n1,0;1;99\n3,0;1;9\n", "", math.pi, 5 * math.pi),
        ("t;n [rev/s];a_deg\n0,0;0;0\n1,0;1;90\n3,0;1;180\n", ":a_deg", math.pi / 2, math.pi),
        ("time,v\ns,deg/s\n0.0,360\n3.0,360\n", "", 2 * math.pi, 6 * math.pi),
        ("t,a_deg\n0,0\n1,80\n2,160\n3,240\n4,320\n5,40\n", "", math.radians(80), math.radians(240)),
        ("t,a_deg\n0,0\n1,300\n3,0\n", "", math.radians(300), 0),
    ],
)
def test_csv_of_speeds_or_angles(tmp_path: Path, content: str, column: str, speed: float, angle: float) -> None:
    motion = parse_motion(f"csv:{csv_file(tmp_path, content)}{column}")
    assert motion.speed(0.5) == pytest.approx(speed)
    assert motion.angle(3) == pytest.approx(angle)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "header of {} must name the columns"),
        (
            "t,angle\n0,0\n1,1\n",
            "{} must have a column with a unit in its name, as speed_rpm: one of rad/s, rev/s, rpm",
        ),
        ("time,angle_rad\n0,0\n1,x\n", "{} line 3: angle_rad must be a finite number, not 'x'"),
        ("time,angle_rad\n0,0\n1\n", "{} line 3: a row must have 2 fields (time,angle_rad), not 1"),
        ("time,angle_rad\n0,nan\n1,1\n", "{} line 2: angle_rad must be a finite number, not 'nan'"),
        ("time,angle_rad\n0,0\n2,1\n1,1\n", "{} line 4: time must be at least 2.0 s as before, not 1.0 s"),
        ("time,angle_rad\n0,0\n", "{} must have at least two rows after its header, not 1"),
        ("time,angle_rad\n0,0\n1e-9,1e308\n", TOO_LARGE),
        ("time,angle_rad\n0,0\n1e-300,1\n1e29,2\n", TOO_LARGE),
        ("time,angle_rad\n0,0\n1,1e200\n2,-1e308\n3,1e308\n", TOO_LARGE),
    ],
)
def test_csv_files_that_are_wrong(tmp_path: Path, content: str, message: str) -> None:
    file = csv_file(tmp_path, content)
    with pytest.raises(ValueError) as error:  # noqa: PT011 (the whole message is compared)
        parse_motion(f"csv:{file}")
    assert str(error.value).startswith(message.format(file))
    with pytest.raises(ValueError, match=r"no\.csv does not exist$"):
        parse_motion(f"csv:{tmp_path / 'no.csv'}")


def test_an_s_curve_keeps_to_its_jerk() -> None:
    motion = parse_motion("s-curve:2rad/s:-6rad/s:100rad/s3")
    assert motion.duration == pytest.approx(math.sqrt(2 * math.pi * 8 / 100))
    t = np.linspace(0, motion.duration, 10_001)
    assert np.abs(np.diff(motion.acceleration(t)) / np.diff(t)).max() == pytest.approx(100, rel=1e-3)
    with pytest.raises(ValueError, match=r"^JERK of s-curve must be more than 0"):
        parse_motion("s-curve:2rad/s:2rad/s:100rad/s^3")


def test_a_load_comes_to_its_speed() -> None:
    """J dw/dt = T - b w: of 0.2 Nm against 0.01 Nm s, with 2 g m2."""
    motion = parse_motion("torque:5rad/s:0.2Nm:0.002:0.01:1s")
    for t in (0, 0.1, 0.25, 1):
        assert motion.speed(t) == pytest.approx(20 - 15 * math.exp(-t / 0.2), rel=1e-4)
    assert parse_motion("torque:0:-200mNm:0.002:0:1s").speed(0.5) == -50


def test_jumps_of_the_speed_are_listed() -> None:
    motion = parse_motion("ramp:0:5rad/s:1s+constant:5rad/s:1s+constant:-3rad/s:1s+s-curve:-3rad/s:0:1s+stop:1s")
    assert motion.jumps == [(2, -8)]


@pytest.mark.parametrize("text", ["constant:100rad/s:10", "stop:1", "s-curve:0:5rad/s:2", "trapezoid:9rpm:1s:3"])
def test_a_time_has_a_unit(text: str) -> None:
    with pytest.raises(ValueError, match=r"must be a number with one of the units s, ms, us, ns: type "):
        parse_motion(text)


def test_motion_must_have_a_segment() -> None:
    none = np.empty(0)
    with pytest.raises(ValueError, match=r"^times of a motion must begin at 0 and increase"):
        Motion(np.zeros(1), none, none, none, none, none)


def test_vibration() -> None:
    vibration = Vibration.parse("1mrad:50Hz")
    assert vibration == Vibration(1e-3, 50.0)
    assert Vibration.parse("180deg:1kHz").amplitude_rad == pytest.approx(math.pi, rel=1e-15)
    assert Vibration.parse("0.1rad:1kHz") == Vibration(0.1, 1000.0)
    t = np.linspace(0, 0.04, 201)
    rate = 2 * math.pi * 50
    np.testing.assert_allclose(vibration.angle(t), 1e-3 * np.sin(rate * t), atol=1e-17)
    np.testing.assert_allclose(vibration.speed(t), 1e-3 * rate * np.cos(rate * t), atol=1e-14)
    np.testing.assert_allclose(vibration.acceleration(t), -1e-3 * rate**2 * np.sin(rate * t), atol=1e-12)
