"""The errors of the tracking method when an update appears, for docs/concepts/track.md: mean and spread over seeds."""

import argparse
import math
import sys

import numpy as np
from pages import markdown
from situations import Cell

from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.comparing.compare import core_curve
from tachometry.sim.studies.comparing.situations import SITUATIONS, Situation
from tachometry.spec import of_texts

TICKS = ("100us", "20us")
SHOWN = (
    *("ramp", "ramp, real", "slow, jitter", "slow, real", "fast, jitter", "fast, real", "unit velocity, vibration"),
    *("reversals, jitter", "reversals, real", "slow sine, real", "fast sine, real", "trapezoid, real", "stop"),
    *("ramp, bad", "reversals, bad", "fast, bad"),
)


def error(situation: Situation, seed: int, tick: str) -> float:
    """RMS error (rad/s) at the clocks in which updates appear."""
    edge_error = "0.6" if situation.name.endswith("bad") else "0.4"
    core = {"ppr": "500", "clock": "48MHz", "tick": tick, "max-time": "10ms", "max-speed": "400rad/s"}
    spec = of_texts("track", core | {"edge-error": edge_error})
    truth = situation.record(seed)
    found = core_curve("track", spec, PinTrace.of(truth.recording, spec)).estimate
    judged = (found.time > situation.start_s) & (found.time <= truth.recording.duration)
    wrong = found.velocity[judged] - truth.true_speed(found.time[judged])
    return math.sqrt(float(np.mean(wrong * wrong)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, metavar="N", help="seeds of what is random (%(default)s)")
    seeds = range(1, parser.parse_args().seeds + 1)
    rows = []
    for situation in (each for each in SITUATIONS if each.name in SHOWN):
        used = seeds if situation.random else (1,)
        rows.append((situation.name, *(str(Cell.of("", [error(situation, n, tick) for n in used])) for tick in TICKS)))
    sys.stdout.write(markdown(("situation", *(f"ticks of {tick[:-2]} µs" for tick in TICKS)), rows))


if __name__ == "__main__":
    main()
