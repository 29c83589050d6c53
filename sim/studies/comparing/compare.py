"""Several methods on the same edges: their velocities when a loop reads them, and the error at these instants."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from tachometry.sim import golden
from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.golden.sampling import windows
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run
from tachometry.sim.studies.comparing import baselines
from tachometry.spec import TachometerSpec
from tachometry.spec.formats.tracking_code import SMOOTH

TrueSpeed = Callable[[FloatArray], FloatArray]
Instants = list[FloatArray]  # seconds: those at which each curve is read

_MOST_READS = 200_000
_LONGEST_DELAY = 0.02  # seconds, that is looked for
_ALIKE = 1e-9  # of a speed; a constant one has no delay
# Shares of the mean square error that go with a delay: enough in any case, and at least.
_MUCH, _LITTLE = 0.25, 0.01


@dataclass(frozen=True, eq=False)
class Curve:
    """Holds the velocities that a method shows.

    - `estimate`: Velocity in rad/s, held from each time (s) on.
    - `measurement_time`, shape (n,), seconds: Of each update; empty where the method has none.
    - `reads`, shape (n,), seconds: See `read_times`.
    """

    name: str
    what: str
    estimate: baselines.Estimate
    measurement_time: FloatArray
    reads: FloatArray
    ages: FloatArray | None = None  # shape (n,), seconds: of each velocity when it is new; None: it is that of its time
    # times (s), and angles as the port shows them; in a `Comparison` their errors, in degrees
    angle: tuple[FloatArray, FloatArray] | None = None

    def instants_of(self, instants: FloatArray) -> FloatArray:
        """Return the instants (s) that the velocities held at some instants belong to."""
        if self.ages is None:
            return instants
        which = np.searchsorted(self.estimate.time, instants, side="right") - 1
        return np.maximum((self.estimate.time - self.ages)[which], 0.0)


@dataclass(frozen=True)
class Judge:
    """The true speed, and the instants at which values are compared with it."""

    true_speed: TrueSpeed | None  # None: it is not known
    begin: float  # seconds
    end: float  # seconds
    read_delay: float = 0.0  # seconds: from the valid velocity to its reading

    def among(self, reads: FloatArray) -> FloatArray:
        """Return the instants (s) of some reads that count: all, or an even choice of at most 200,000."""
        reads = reads + self.read_delay
        first, after = np.searchsorted(reads, self.begin), np.searchsorted(reads, self.end, side="right")
        return reads[first : after : max(1, -(-(after - first) // _MOST_READS))]


@dataclass(frozen=True)
class Score:
    """A curve against the truth; None is what cannot be determined.

    - `mean_time`, `worst_time`, seconds: Measurement time.
    - `rms`, `max`, rad/s: Error of the held velocity.
    - `delay`, seconds: Mean age of `velocity_smooth`; else shift of the true speed that comes closest. None where it
      says nothing: the true speed is constant, or the curve would be early, or hardly any of the error goes with the
      shift, or an offset might be its cause as well.
    - `angle_rms_deg`, `angle_max_deg`, degrees: Error of an angle at the instant of its use, if cores show one.
    """

    name: str
    what: str
    updates_per_second: float
    mean_time: float | None
    worst_time: float | None
    rms: float | None
    max: float | None
    delay: float | None
    angle_rms_deg: float | None = None
    angle_max_deg: float | None = None


def core_curve(name: str, spec: TachometerSpec, trace: PinTrace) -> Curve:
    """Return what a core shows, by its golden model, which the hardware equals bit for bit; with --smooth that."""
    run = golden.run(spec, trace)
    curve, updates = run_curve(name, spec, run, trace), run.updates
    if "angle" in run.ticks.columns:
        curve = replace(curve, angle=(run.ticks.clock / spec.timing.clock_hz, run.ticks.angle))
    if SMOOTH[0] not in updates.columns:
        return curve
    smooth = baselines.Estimate(curve.estimate.time, updates.velocity_smooth * spec.velocity.rad_per_s_per_lsb)
    ages = updates.smooth_delay / spec.timing.clock_hz
    return replace(curve, what=f"{curve.what}, velocity_smooth at its time", estimate=smooth, ages=ages)


def read_times(spec: TachometerSpec, trace: PinTrace) -> FloatArray:
    """Return when the velocities of all ticks are valid, in seconds: `tick_to_velocity` clocks after each tick.

    A method that updates by events, or that ends its ticks itself, is read at the end of each nominal tick as well.
    """
    clock = windows(spec, trace)[0] + (spec.latency.tick + spec.latency.tick_to_velocity)
    return clock[clock < trace.n_clocks] / spec.timing.clock_hz


def run_curve(name: str, spec: TachometerSpec, run: Run, trace: PinTrace) -> Curve:
    """Return what a core shows in the run of a trace."""
    updates = run.updates
    clock_hz = spec.timing.clock_hz
    velocity = updates.velocity.astype(np.float64) * spec.velocity.rad_per_s_per_lsb
    return Curve(
        name,
        f"{spec.method} method, tick {spec.timing.tick_cycles} clocks",
        baselines.Estimate(updates.clock / clock_hz, velocity),
        updates.interval.astype(np.float64) * (spec.times.interval_unit / clock_hz),
        read_times(spec, trace),
    )


def begun(curves: Iterable[Curve], earliest: float = 0.0) -> float:
    """Return when all curves have a value, in seconds; at least `earliest`."""
    return max([earliest, *(float(curve.estimate.time[0]) for curve in curves if len(curve.estimate.time))])


def rms_error(curve: Curve, instants: FloatArray, truth: FloatArray) -> float:
    """Return RMS error of the held velocity, rad/s, at some instants (s), where the true speed is known."""
    error = curve.estimate.at(instants) - truth
    return float(np.sqrt(np.mean(error * error)))


def score(curve: Curve, duration: float, instants: FloatArray, true_speed: TrueSpeed | None) -> Score:
    """Return how good a curve is at the instants (s) at which it is read; only even ones show a delay."""
    times = curve.measurement_time
    rms = worst = delay = None
    if true_speed is not None and len(instants):
        held, truth = curve.estimate.at(instants), true_speed(curve.instants_of(instants))
        error = held - truth
        rms, worst = float(np.sqrt(np.mean(error * error))), float(np.max(np.abs(error)))
        reach = min(_LONGEST_DELAY, (instants[-1] - instants[0]) / 4)
        if curve.ages is not None:
            delay = float(np.mean(instants - curve.instants_of(instants)))
        elif np.ptp(truth) > _ALIKE * np.max(np.abs(truth)):
            with suppress(ValueError):  # a motion that looks alike at several shifts
                delay = baselines.delay_seconds(instants, held, truth, reach)
                if not _says_something(error, held - true_speed(np.maximum(instants - delay, 0)), delay):
                    delay = None
    return Score(
        curve.name,
        curve.what,
        len(curve.estimate.time) / duration,
        float(np.mean(times)) if len(times) else None,
        float(np.max(times)) if len(times) else None,
        rms,
        worst,
        delay,
    )


def _says_something(error: FloatArray, left: FloatArray, delay: float) -> bool:
    """Return whether a delay is more than noise or an offset, which look like one while the speed rises.

    It is if a quarter of the mean square error goes with it; or less, but more than twice what goes with an offset.
    """
    square = float(np.mean(error * error))
    if delay < 0 or square == 0:
        return delay >= 0
    explained, offset = 1 - float(np.mean(left * left)) / square, float(np.mean(error)) ** 2 / square
    return explained >= _MUCH or explained >= max(_LITTLE, 2 * offset)
