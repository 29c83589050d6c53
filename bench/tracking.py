"""Measures the errors of the tracking method when an update appears, for docs/measured/compare.md."""

import math
import sys
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np
from motions import OTHERS, REAL, SITUATIONS, Situation
from numpy.typing import NDArray
from pages import MEASURED, ROOT, Rows, measure
from situations import Cell, core

from tachometry.sim import golden
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.spec import TachometerSpec, TrackTachometer

sys.path.append(str(ROOT / "tests"))
from support.tracking import in_float

TICKS = ("100us", "20us")
FIRST_SEED = 401
ALARM = 0.002  # more of the speed than noise makes while the memory is long
BURST = 0.01  # more than the disc makes that is off centre
SWINGS = ((220, 60, 5), (300, 50, 3), (250, 40, 7))  # mean and amplitude in rad/s, frequency in Hz
STARTS = 200
# The speed leaves its constant value so slowly that one error hardly differs from the next.
GENTLE = Situation("gentle S-curve", "constant:100rad/s:300ms+s-curve:100rad/s:0:300ms+stop:60ms", "50ms", REAL)


class Errors(NamedTuple):
    """Errors of all updates of a situation, in rad/s, and what `velocity_std` shows there."""

    core: NDArray[np.float64]
    velocity_std: NDArray[np.float64]
    model: NDArray[np.float64] | None  # of the independent model in floating point

    @property
    def covered(self) -> float:
        """Updates whose error is within `velocity_std`, in %."""
        return 100 * float(np.mean(np.abs(self.core) <= self.velocity_std))


def errors(spec: TachometerSpec, situation: Situation, seed: int, beside: bool = False) -> Errors:
    """Return the errors at the clocks in which updates appear; `beside` them those of the model."""
    assert isinstance(spec, TrackTachometer)
    truth = situation.record(seed)
    trace = PinTrace.of(truth.recording, spec)
    updates = golden.run(spec, trace).updates
    seconds = updates.clock / spec.timing.clock_hz
    judged = (seconds > situation.start_s) & (seconds <= truth.recording.duration)
    right, lsb = truth.true_speed(seconds[judged]), spec.velocity.rad_per_s_per_lsb
    model = in_float(spec, trace, updates.clock)[judged] - right if beside else None
    return Errors(updates.velocity[judged] * lsb - right, updates.velocity_std[judged] * lsb, model)


def rms(wrong: NDArray[np.float64] | None) -> float:
    """Return the root of the mean square."""
    return math.nan if wrong is None else math.sqrt(float(np.mean(wrong * wrong)))


def row(situation: Situation, n_seeds: int, beside: bool = True) -> list[str]:
    """Return a row: at each tick the errors of the core and in floating point, and the share in `velocity_std`."""
    seeds = range(FIRST_SEED, FIRST_SEED + (n_seeds if situation.random else 1))
    cells = [situation.name]
    for tick in TICKS:
        found = [errors(core(situation, "track", {"tick": tick}), situation, seed, beside) for seed in seeds]
        model = np.mean([rms(one.model) for one in found])
        cells += [str(Cell.of("", [rms(one.core) for one in found])), f"{model:.3g}"]
        cells.append(f"{np.mean([one.covered for one in found]):.0f}")
    return cells


def disc(rng: np.random.Generator, off_centre: float, real: bool) -> NDArray[np.float64]:
    """Return the displacements of the edges of a disc of 500 lines, in counts; also those of a real one. It begins
    anywhere.
    """
    edges = np.arange(2000)
    displaced = off_centre * np.sin(2 * np.pi * edges / 2000)
    if real:
        displaced += rng.uniform(-0.1, 0.1, 2000) + (edges % 2) / 9
    return np.roll(displaced, rng.integers(2000))


def steady(
    spec: TachometerSpec,
    rate: float,
    jitter: float,
    seed: int,
    *,
    off_centre: float = 0,
    real: bool = False,
    n: int = 1_000_000,
    first: int = 2000,
) -> NDArray[np.float64]:
    """Return the errors of all updates but the first ones, in parts of the speed, which is `rate` counts a tick.

    There are n counts. Each edge is off by chance, by `jitter` counts (standard deviation). See `disc` for the others.
    """
    rng = np.random.default_rng(seed)
    place = np.arange(3, n + 2) + rng.normal(0, jitter, n - 1) + np.resize(disc(rng, off_centre, real), n - 1)
    clock = np.maximum.accumulate(np.round(place * spec.timing.tick_cycles / rate).astype(np.int64))
    level = quadrature(np.arange(n))
    trace = PinTrace(np.append(0, clock), level & np.uint8(1), level >> np.uint8(1), int(clock[-1]) + 10)
    velocity = golden.run(spec, trace).updates.velocity[first:] * spec.velocity.rad_per_s_per_lsb
    right = rate / spec.timing.tick_cycles * spec.timing.clock_hz * 2 * math.pi / spec.encoder.counts_per_rev
    return np.abs(velocity / right - 1)


def swinging(mean: float, amplitude: float, hertz: float, off_centre: float, seed: int) -> NDArray[np.float64]:
    """Return the errors of all updates where a speed (rad/s) swings for 12 s, in parts of its mean, on a real disc."""
    vibration = f"{amplitude / (2 * math.pi * hertz):.5f}rad:{hertz}Hz"
    faults = {**REAL, "eccentricity": str(off_centre), "vibration": vibration}
    situation = Situation("", f"constant:{mean}rad/s:12s", "1s", faults)
    return np.abs(errors(core(situation, "track", {"tick": "20us"}), situation, seed).core) / mean


def alarm_cases(runs: int) -> Iterator[tuple[str, str, float, int, Callable[[int], NDArray[np.float64]]]]:
    """Yield motion, encoder, error of an alarm, number of runs, and the errors of a run by its seed."""
    steadily = partial(steady, core(GENTLE, "track", {"tick": "20us"}))
    for rate, jitter in product((0.5, 1.0, 2.0), (0.05, 0.1)):
        yield f"{rate:g} counts a tick", f"jitter {jitter:g}", ALARM, runs, partial(steadily, rate, jitter)
    for rate, off, real in product((1.0, 1.5, 1.7, 2.5), (0.0, 0.25, 1.0), (False, True)):
        encoder = f"{'real' if real else 'jitter 0.05'}, {off:g} off centre"
        run = partial(steadily, rate, 0.05, off_centre=off, real=real, first=50_000)
        yield f"{rate:g} counts a tick", encoder, BURST, runs, run
    for (mean, amplitude, hertz), off in product(SWINGS, (0.0, 0.25)):
        name = f"{mean} ± {amplitude} rad/s at {hertz} Hz"
        yield name, f"real, {off:g} off centre", BURST, runs, partial(swinging, mean, amplitude, hertz, off)
    start = partial(steadily, 0.318, 0.05, off_centre=0.25, real=True, n=16_000, first=5000)
    yield "start at 50 rad/s", "real, 0.25 off centre", BURST, STARTS, start


def alarms(seeds: int, runs: int) -> Rows:
    """Return the table of false alarms."""
    rows = []
    for motion, encoder, limit, n, run in alarm_cases(runs):
        worst = [float(run(seed).max()) for seed in range(n)]
        false = sum(error > limit for error in worst)
        rows.append([motion, encoder, f"{100 * limit:g}", str(n), str(false), f"{100 * max(worst):.1g}"])
    heads = ["motion", "encoder", "alarm from (%)", "runs", "of them with an alarm", "greatest error (%)"]
    return [heads, *rows]


def table(seeds: int, runs: int) -> Rows:
    """Return the table of errors in all situations."""
    heads = ["situation"]
    for tick in TICKS:
        heads += [f"{what} {tick[:-2]} µs" for what in ("ticks of", "in float,", "within velocity_std (%),")]
    return [heads, *(row(situation, seeds) for situation in (*SITUATIONS, *OTHERS, GENTLE))]


if __name__ == "__main__":
    measure(MEASURED / "compare.md", {"tracking": table, "alarms": alarms}, usual=["tracking"], seeds=20, runs=100)
