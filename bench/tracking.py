"""Measures the errors of the tracking method when an update appears, for docs/measured/track.md."""

import argparse
import math
import sys
from pathlib import Path

import numpy as np
from motions import OTHERS, REAL, SITUATIONS, Situation
from numpy.typing import NDArray
from pages import markdown, write_block
from situations import Cell, core

from tachometry.sim import golden
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.spec import TachometerSpec

# What the recursion has in floating point with seeds 301 to 310, in rad/s, at each tick; the rest is rounding alone.
IN_FLOAT = {
    "100us": {
        "ramp": 5.1e-4, "ramp, real": 2.1e-3, "ramp, bad": 4.1e-3, "very slow, real": 7.5e-5,
        "slow, jitter": 3.9e-5, "slow, real": 7e-5, "fast, jitter": 2.5e-5, "fast, real": 2.4e-5, "fast, bad": 4.3e-5,
        "unit velocity, vibration": 0.157, "unit velocity, vibration, real": 0.157,
        "reversals, jitter": 0.114, "reversals, real": 0.137, "reversals, bad": 0.198,
        "slow sine": 0.0116, "slow sine, real": 0.0447, "fast sine": 0.277, "fast sine, real": 1.31,
        "trapezoid": 0.18, "trapezoid, real": 0.261, "stop": 0.702, "stop, real": 0.828,
    },
    "20us": {
        "ramp": 5.1e-4, "ramp, real": 2.07e-3, "ramp, bad": 4.1e-3, "very slow, real": 7.5e-5,
        "slow, jitter": 3.9e-5, "slow, real": 7e-5, "fast, jitter": 7e-5, "fast, real": 7e-5, "fast, bad": 1e-4,
        "unit velocity, vibration": 0.152, "unit velocity, vibration, real": 0.152,
        "reversals, jitter": 0.11, "reversals, real": 0.137, "reversals, bad": 0.201,
        "slow sine": 0.0116, "slow sine, real": 0.0447, "fast sine": 0.18, "fast sine, real": 1.19,
        "trapezoid": 0.176, "trapezoid, real": 0.281, "stop": 0.651, "stop, real": 0.757,
    },
}  # fmt: skip
FIRST_SEED = 401
ALARM = 0.002  # more of the speed than noise makes while the memory is long
# The speed leaves its constant value so slowly that one error hardly differs from the next.
GENTLE = Situation("gentle S-curve", "constant:100rad/s:300ms+s-curve:100rad/s:0:300ms+stop:60ms", "50ms", REAL)


def found(situation: Situation, seed: int, tick: str) -> tuple[float, float]:
    """Return RMS error (rad/s) at the clocks in which updates appear, and how many errors are within `quality` (%)."""
    spec = core(situation, "track", {"tick": tick})
    truth = situation.record(seed)
    updates = golden.run(spec, PinTrace.of(truth.recording, spec)).updates
    seconds = updates.clock / spec.timing.clock_hz
    judged = (seconds > situation.start_s) & (seconds <= truth.recording.duration)
    lsb = spec.scale.rad_per_s_per_lsb
    wrong = updates.velocity[judged] * lsb - truth.true_speed(seconds[judged])
    covered = np.abs(wrong) <= updates.quality[judged] * lsb
    return math.sqrt(float(np.mean(wrong * wrong))), 100 * float(np.mean(covered))


def row(situation: Situation, n_seeds: int) -> list[str]:
    """Return a situation's row: at each tick the error, that of floating point, and the share within `quality`."""
    seeds = range(FIRST_SEED, FIRST_SEED + (n_seeds if situation.random else 1))
    cells = [situation.name]
    for tick, in_float in IN_FLOAT.items():
        errors, covered = zip(*(found(situation, seed, tick) for seed in seeds), strict=True)
        expected = in_float.get(situation.name)
        cells += [str(Cell.of("", [*errors])), f"{expected:.3g}" if expected else "", f"{np.mean(covered):.0f}"]
    return cells


def steady(spec: TachometerSpec, rate: float, jitter: float, seed: int) -> NDArray[np.float64]:
    """Return the errors of all updates in a million counts, in parts of the speed, which is `rate` counts a tick.

    Each edge is off by chance, by `jitter` counts (standard deviation). The first 2000 updates are left out.
    """
    n, rng = 1_000_000, np.random.default_rng(seed)
    place = np.arange(1, n) + rng.normal(0, jitter, n - 1)
    clock = np.maximum.accumulate(np.round(place * spec.timing.tick_cycles / rate).astype(np.int64))
    level = quadrature(np.arange(n))
    trace = PinTrace(np.append(0, clock), level & np.uint8(1), level >> np.uint8(1), int(clock[-1]) + 10)
    velocity = golden.run(spec, trace).updates.velocity[2000:] * spec.scale.rad_per_s_per_lsb
    right = rate / spec.timing.tick_cycles * spec.timing.clock_hz * 2 * math.pi / spec.encoder.counts_per_rev
    return np.abs(velocity / right - 1)


def alarms(millions: int) -> str:
    """Return the table of false alarms, in so many millions of counts each."""
    spec, rows = core(GENTLE, "track", {"tick": "20us"}), []
    for rate in (0.5, 1.0, 2.0):
        for jitter in (0.05, 0.1):
            worst = [float(steady(spec, rate, jitter, seed).max()) for seed in range(millions)]
            false = sum(error > ALARM for error in worst)
            rows.append([f"{rate:g}", f"{jitter:g}", str(millions), str(false), f"{100 * max(worst):.1g}"])
    heads = ["counts a tick", "jitter (counts)", "millions of counts", "of them with an alarm", "greatest error (%)"]
    return markdown(heads, rows)


def main() -> None:
    """Print the table, and put it into the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="seeds of what is random (%(default)s)")
    parser.add_argument("-o", "--output", type=Path, metavar="PAGE", help="page whose table is replaced")
    parser.add_argument("--alarms", type=int, metavar="N", help="count false alarms in N million counts instead")
    given = parser.parse_args()
    ticks = [f"{tick[:-2]} µs" for tick in IN_FLOAT]
    heads = ["situation", *(head for tick in ticks for head in (f"ticks of {tick}", "in float", "within quality (%)"))]
    rows = [] if given.alarms else [row(situation, given.seeds) for situation in (*SITUATIONS, *OTHERS, GENTLE)]
    table = alarms(given.alarms) if given.alarms else markdown(heads, rows)
    sys.stdout.write(table)
    if given.output is not None:
        write_block(given.output, "alarms" if given.alarms else "errors", table)


if __name__ == "__main__":
    main()
