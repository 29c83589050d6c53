"""Motion profiles and vibration: the angle and the speed of a shaft as functions of time.

A motion is a row of segments, each a constant acceleration plus at most one sine; all are evaluated at once. Only
operations that IEEE 754 rounds exactly are used (`sin2pi` in place of numpy's sine, whose last bit depends on the
processor), so that equal motions give equal bits on every machine.
"""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, localcontext
from itertools import accumulate, pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tachometry.sim.signals.files import file_of
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.units import ANGLE, FREQUENCY, PLAIN, SPEED, TIME, TORQUE, Units, is_zero, read_nearest

FloatArray = NDArray[np.float64]

_FIELDS: dict[str, dict[str, Units]] = {
    "constant": {"SPEED": SPEED, "TIME": TIME},
    "ramp": {"FROM": SPEED, "TO": SPEED, "TIME": TIME},
    "sine": {"AMPLITUDE": SPEED, "FREQUENCY": FREQUENCY, "TIME": TIME},
    "trapezoid": {"SPEED": SPEED, "ACCEL_TIME": TIME, "HOLD_TIME": TIME},
    "s-curve": {"FROM": SPEED, "TO": SPEED, "TIME": TIME},
    "stop": {"TIME": TIME},
    "torque": {"FROM": SPEED, "TORQUE": TORQUE, "INERTIA": PLAIN, "FRICTION": PLAIN, "TIME": TIME},
}
_FORMS = ", ".join(":".join((kind, *fields)) for kind, fields in _FIELDS.items()) + ", N*(SEGMENT+...)"
_REPEATED = re.compile(r"(?<!\d)(\d{1,4})\*\(([^()]*)\)")
_JERK = re.compile(r"(.*/s)\^?3")  # rad/s3
_SIGNED = (SPEED, TORQUE)
_PIECES = 256  # of even acceleration, for a load that comes to its speed
_BELOW = 1e30  # times, angles, speeds and accelerations: what is computed of them is finite

# (-1)^n (2 pi)^(2n+1) / (2n+1)!, highest power first
_SINE_SERIES = (
    0.0011309237482517963,
    -0.012031585942120627,
    0.10422916220813984,
    -0.7181223017785006,
    3.819952584848282,
    -15.09464257682299,
    42.058693944897655,
    -76.70585975306139,
    81.60524927607506,
    -41.34170224039976,
    6.283185307179586,
)


def _sine_of_quarter(turns: FloatArray) -> FloatArray:
    """Return sin(2 pi turns) for |turns| <= 1/4."""
    square = turns * turns
    total = np.full_like(turns, _SINE_SERIES[0])
    for coefficient in _SINE_SERIES[1:]:
        total = total * square + coefficient
    return total * turns


def sin2pi(phase: ArrayLike) -> FloatArray:
    """Return sine of a phase in turns, the same bits on every machine; |error| < 1e-15."""
    phase = np.asarray(phase, dtype=np.float64)
    turns = phase - np.floor(phase + 0.5)
    return _sine_of_quarter(np.where(np.abs(turns) > 0.25, np.copysign(0.5, turns) - turns, turns))


def cos2pi(phase: ArrayLike) -> FloatArray:
    """Return cosine of a phase in turns, the same bits on every machine; |error| < 1e-15."""
    phase = np.asarray(phase, dtype=np.float64)
    return _sine_of_quarter(0.25 - np.abs(phase - np.floor(phase + 0.5)))


class _Segment(NamedTuple):
    duration: float
    start_speed: float = 0.0
    acceleration: float = 0.0
    sine_speed: float = 0.0
    sine_frequency: float = 0.0


@dataclass(frozen=True, eq=False)
class Motion:
    """Angle and speed of a shaft from time 0 to `duration`.

    In segment j, with u = t - breakpoints[j], the speed is
    start_speed[j] + constant_acceleration[j] u + sine_speed[j] sin(2 pi sine_frequency[j] u).

    It raises ValueError if a segment is too short to be distinguished from a moment, or a number is 1e30 or more.
    """

    # shape (n + 1,), seconds, strictly increasing, first entry 0: where segments begin, and where the last one ends;
    # speed and acceleration are smooth in between
    breakpoints: FloatArray
    start_angle: FloatArray  # shape (n,), rad
    start_speed: FloatArray  # shape (n,), rad/s
    constant_acceleration: FloatArray  # shape (n,), rad/s^2
    sine_speed: FloatArray  # shape (n,), rad/s
    sine_frequency: FloatArray  # shape (n,), Hz: 0 in segments without a sine

    def __post_init__(self) -> None:
        if not all(np.all(np.abs(values) < _BELOW) for values in vars(self).values()):
            raise ValueError("times, angles, speeds and accelerations of a motion must be below 1e30, in s and rad")
        if len(self.breakpoints) < 2 or self.breakpoints[0] != 0 or np.any(np.diff(self.breakpoints) <= 0):
            raise ValueError("times of a motion must begin at 0 and increase by more than their rounding error")

    @staticmethod
    def _joined(segments: Iterable[_Segment]) -> "Motion":
        rows = list(segments)
        duration, speed, acceleration, sine_speed, frequency = np.array(rows, dtype=np.float64).T
        with np.errstate(all="ignore"):  # Motion refuses what is not finite
            travel = duration * (speed + 0.5 * acceleration * duration) + _sine_angle(sine_speed, frequency, duration)
            start_angle = np.array(list(accumulate(travel[:-1], initial=0.0)))
            breakpoints = np.array(list(accumulate(duration, initial=0.0)))
        return Motion(breakpoints, start_angle, speed, acceleration, sine_speed, frequency)

    @staticmethod
    def of_table(time: FloatArray, angle_rad: FloatArray) -> "Motion":
        """Return the motion that is at these angles at these times, from 0, and turns evenly in between."""
        zero = np.zeros(len(time) - 1)
        with np.errstate(all="ignore"):  # Motion refuses what is not finite
            slope = np.diff(angle_rad) / np.diff(time)
        return Motion(time, angle_rad[:-1], slope, zero, zero, zero)

    @property
    def duration(self) -> float:
        """Length of the motion, seconds."""
        return float(self.breakpoints[-1])

    @property
    def jumps(self) -> list[tuple[float, float]]:
        """Times at which the speed jumps between two segments, seconds, and by how much, rad/s."""
        end = self.start_speed + self.constant_acceleration * np.diff(self.breakpoints)
        end = end + self.sine_speed * sin2pi(self.sine_frequency * np.diff(self.breakpoints))
        jump = self.start_speed[1:] - end[:-1]
        rows = np.flatnonzero(np.abs(jump) > 1e-9 * np.abs(self.start_speed).max())
        return [(float(self.breakpoints[row + 1]), float(jump[row])) for row in rows.tolist()]

    @property
    def max_travel(self) -> float:
        """Upper bound on the distance travelled to and fro, rad."""
        duration = np.diff(self.breakpoints)
        with np.errstate(over="ignore"):
            end_speed = self.start_speed + self.constant_acceleration * duration
            mean_speed = 0.5 * np.abs(self.start_speed) + 0.5 * np.abs(end_speed) + np.abs(self.sine_speed)
            return float(np.sum(mean_speed * duration))

    def angle(self, t: ArrayLike) -> FloatArray:
        """Return angle in rad at times `t` in seconds; before and after the motion, as at its ends."""
        j, u = self._locate(t)
        angle = self.start_angle[j] + u * (self.start_speed[j] + 0.5 * self.constant_acceleration[j] * u)
        if self._has_sine:
            angle = angle + _sine_angle(self.sine_speed[j], self.sine_frequency[j], u)
        return angle

    def speed(self, t: ArrayLike) -> FloatArray:
        """Return speed in rad/s at times `t` in seconds; at a breakpoint, that of the segment that begins."""
        j, u = self._locate(t)
        speed = self.start_speed[j] + self.constant_acceleration[j] * u
        if self._has_sine:
            speed = speed + self.sine_speed[j] * sin2pi(self.sine_frequency[j] * u)
        return speed

    def acceleration(self, t: ArrayLike) -> FloatArray:
        """Return acceleration in rad/s^2 at times `t` in seconds; at a breakpoint, that of the segment that begins."""
        j, u = self._locate(t)
        acceleration = self.constant_acceleration[j]
        if self._has_sine:
            rate = 2 * math.pi * self.sine_frequency[j]
            acceleration = acceleration + self.sine_speed[j] * rate * cos2pi(self.sine_frequency[j] * u)
        return acceleration

    @property
    def _has_sine(self) -> bool:
        return bool(np.any(self.sine_frequency))

    def _locate(self, t: ArrayLike) -> tuple[NDArray[np.intp], FloatArray]:
        """Return segment of each time, and time since that segment began."""
        time = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        j = np.searchsorted(self.breakpoints[1:-1], time, side="right")
        return j, time - self.breakpoints[j]


def _sine_angle(speed: FloatArray, frequency: FloatArray, u: FloatArray) -> FloatArray:
    """Return integral of speed sin(2 pi frequency u), free of the cancellation in 1 - cos."""
    half = sin2pi(0.5 * frequency * u)
    return speed * half * half / np.where(frequency > 0, math.pi * frequency, 1.0)


@dataclass(frozen=True)
class Vibration:
    """A sinusoidal vibration of the shaft on top of its motion, beginning at its centre."""

    amplitude_rad: float  # rad, more than 0
    frequency_hz: float  # Hz, more than 0

    def __post_init__(self) -> None:
        for name, value in (("amplitude", self.amplitude_rad), ("frequency", self.frequency_hz)):
            if not 0 < value < math.inf:
                raise ParameterError(f"vibration {name}", f"must be more than 0, not {value}")

    @staticmethod
    def parse(text: str) -> "Vibration":
        """Read AMPLITUDE:FREQUENCY, such as 1mrad:50Hz (rad, mrad or deg; Hz, kHz, MHz or GHz)."""
        amplitude, colon, frequency = text.partition(":")
        if not colon or ":" in frequency:
            raise ParameterError("vibration", f"must be AMPLITUDE:FREQUENCY, not {text!r}")
        return Vibration(
            read_nearest("vibration amplitude", amplitude, ANGLE),
            read_nearest("vibration frequency", frequency, FREQUENCY, "Hz"),
        )

    def angle(self, t: ArrayLike) -> FloatArray:
        """Return angle in rad at times in seconds."""
        return self.amplitude_rad * sin2pi(self._phase(t))

    def speed(self, t: ArrayLike) -> FloatArray:
        """Return speed in rad/s at times in seconds."""
        return self.amplitude_rad * self._rate * cos2pi(self._phase(t))

    def acceleration(self, t: ArrayLike) -> FloatArray:
        """Return acceleration in rad/s^2 at times in seconds."""
        return -self.amplitude_rad * self._rate * self._rate * sin2pi(self._phase(t))

    @property
    def _rate(self) -> float:
        return 2 * math.pi * self.frequency_hz

    def _phase(self, t: ArrayLike) -> FloatArray:
        return self.frequency_hz * np.asarray(t, dtype=np.float64)


def parse_motion(text: str) -> Motion:
    """Read a motion.

    - `text`: Segments joined by `+`: constant:SPEED:TIME, ramp:FROM:TO:TIME, sine:AMPLITUDE:FREQUENCY:TIME,
      trapezoid:SPEED:ACCEL_TIME:HOLD_TIME, s-curve:FROM:TO:TIME (the acceleration is a raised cosine), or with its
      greatest jerk, as 500rad/s3, in place of the time; stop:TIME; and torque:FROM:TORQUE:INERTIA:FRICTION:TIME, a load
      with an inertia in kg m² and a friction in Nm s. N*(...) repeats segments. Or csv:FILE or csv:FILE:COLUMN alone: a
      text with times and a column of speeds or angles, whose unit is in its name. Between two rows what is in the
      column is interpolated linearly; the first time becomes 0. Speeds are 0, or in rad/s, rev/s or rpm, times in s,
      ms, us or ns, frequencies in Hz (default), kHz, MHz or GHz.

    It raises ValueError if the text or the file is not of this form.
    """
    kind, _, file = text.strip().partition(":")
    if kind == "csv":
        return _read_csv(file)
    text = _REPEATED.sub(lambda match: "+".join([match[2]] * int(match[1])), text)
    # a + before a digit is a sign or part of an exponent
    return Motion._joined(
        segment for part in re.split(r"\+(?![\d.])", text) for segment in _parse_segment(part.strip())
    )


def _parse_segment(text: str) -> list[_Segment]:
    kind, *numbers = text.split(":")
    if kind == "csv":
        raise ValueError(f"csv:FILE must be the whole motion, not a segment of it: {text!r}")
    fields = _FIELDS.get(kind)
    if fields is None or len(numbers) != len(fields):
        raise ParameterError("motion segment", f"must be one of {_FORMS}, csv:FILE, not {text!r}")
    values = list[float]()
    for (name, units), number in zip(fields.items(), numbers, strict=True):
        default = next(iter(units))
        if kind == "s-curve" and (jerk := _JERK.fullmatch(number.strip())):
            # The greatest jerk of a raised cosine is 2 pi times the change of the speed over the time squared.
            steepest = read_nearest("JERK of s-curve", jerk[1], SPEED)
            if steepest <= 0 or values[0] == values[1]:
                raise ValueError(f"JERK of s-curve must be more than 0 and change the speed, not {number!r}")
            values.append(math.sqrt(2 * math.pi * abs(values[1] - values[0]) / steepest))
            continue
        plain = "" if units in (SPEED, TIME) and not is_zero(number) else default  # 300 may be rad/s or rpm
        value = read_nearest(f"{name} of {kind}", number, units, plain)
        if units not in _SIGNED and value <= 0 and (name != "FRICTION" or value < 0):
            raise ValueError(f"{name} of {kind} must be more than 0{f' {default}' * bool(default)}, not {number!r}")
        values.append(value)
    match kind, values:
        case "constant", [speed, duration]:
            return [_Segment(duration, speed)]
        case "ramp", [start, end, duration]:
            return [_Segment(duration, start, (end - start) / duration)]
        case "sine", [amplitude, frequency, duration]:
            return [_Segment(duration, sine_speed=amplitude, sine_frequency=frequency)]
        case "s-curve", [start, end, duration]:
            rise = end - start
            return [_Segment(duration, start, rise / duration, -rise / (2 * math.pi), 1 / duration)]
        case "torque", [start, torque, inertia, friction, duration]:
            return _loaded(start, torque / inertia, friction / inertia, duration)
        case "trapezoid", [speed, rise, hold]:
            return [_Segment(rise, 0.0, speed / rise), _Segment(hold, speed), _Segment(rise, speed, -speed / rise)]
        case _:
            return [_Segment(values[0])]


def _loaded(start: float, acceleration: float, rate: float, duration: float) -> list[_Segment]:
    """Return a load that a torque accelerates so, and friction slows down by so much of its speed in a second."""
    if not rate:
        return [_Segment(duration, start, acceleration)]
    step, end = duration / _PIECES, acceleration / rate
    with localcontext(prec=20):  # whose exponential is rounded rightly, so it is the same on every machine
        left = [float((Decimal(-rate * step) * piece).exp()) for piece in range(_PIECES + 1)]
    speeds = [end + (start - end) * share for share in left]
    return [_Segment(step, one, (other - one) / step) for one, other in pairwise(speeds)]


def _read_csv(text: str) -> Motion:
    from tachometry.sim.captures.header import PLAIN as AS_IT_IS
    from tachometry.sim.captures.series import ANGLES, SPEEDS, read_series, wraps_at

    file, column = file_of(text)
    series, unit = read_series(Path(file), column, "motion", AS_IT_IS)
    if unit in ANGLES:
        with np.errstate(all="ignore"):  # Motion refuses what is not finite
            angle = series.value * ANGLES[unit]
            # A sensor's steps are small, and a few are not; what is commanded may turn by most of a turn in one.
            if wraps_at(angle, 2 * math.pi) and np.median(np.abs(np.diff(angle))) < math.pi / 2:
                angle = np.unwrap(angle)
            return Motion.of_table(series.time, angle)
    if not unit:
        units = ", ".join((*SPEEDS, *ANGLES))
        raise ParameterError("motion", f"must have a unit in the name of column {series.name} of {file}: {units}")
    speed = (series.value * SPEEDS[unit]).tolist()
    rows = zip(np.diff(series.time).tolist(), pairwise(speed), strict=True)
    return Motion._joined(_Segment(time, one, (other - one) / time) for time, (one, other) in rows)


@dataclass(frozen=True)
class VibratingShaft:
    """A shaft in motion that vibrates."""

    motion: Motion
    vibration: Vibration | None
    start_angle_rad: float

    @property
    def breakpoints(self) -> FloatArray:
        return self.motion.breakpoints

    @property
    def max_frequency(self) -> FloatArray:
        return np.maximum(self.motion.sine_frequency, self.vibration.frequency_hz if self.vibration else 0.0)

    @property
    def reach(self) -> float:
        """Start angle and distance travelled to and fro together, rad, or a little more."""
        vibrated = 4 * self.vibration.amplitude_rad * self.vibration.frequency_hz if self.vibration else 0.0
        start = abs(self.motion.start_angle[0] + self.start_angle_rad)
        return float(start + self.motion.max_travel + vibrated * self.motion.duration)

    def angle(self, t: ArrayLike) -> FloatArray:
        angle = self.motion.angle(t) + self.start_angle_rad
        return angle + self.vibration.angle(t) if self.vibration else angle

    def speed(self, t: ArrayLike) -> FloatArray:
        speed = self.motion.speed(t)
        return speed + self.vibration.speed(t) if self.vibration else speed

    def acceleration(self, t: ArrayLike) -> FloatArray:
        acceleration = self.motion.acceleration(t)
        return acceleration + self.vibration.acceleration(t) if self.vibration else acceleration
