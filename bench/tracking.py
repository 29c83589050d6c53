"""Measures the errors of the tracking method when an update appears, for docs/measured/track.md."""

import argparse
import math
import sys
from pathlib import Path

import numpy as np
from pages import markdown, write_block
from situations import FIRST_SEED, Cell, core

from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.comparing.compare import core_curve
from tachometry.sim.studies.comparing.situations import OTHERS, SITUATIONS, Situation

TICKS = ("100us", "20us")


def error(situation: Situation, seed: int, tick: str) -> float:
    """Return RMS error (rad/s) at the clocks in which updates appear."""
    spec = core(situation, "track", {"tick": tick})
    truth = situation.record(seed)
    found = core_curve("track", spec, PinTrace.of(truth.recording, spec)).estimate
    judged = (found.time > situation.start_s) & (found.time <= truth.recording.duration)
    wrong = found.velocity[judged] - truth.true_speed(found.time[judged])
    return math.sqrt(float(np.mean(wrong * wrong)))


def main() -> None:
    """Print the table, and put it into the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, metavar="N", help="seeds of what is random (%(default)s)")
    parser.add_argument("-o", "--output", type=Path, metavar="PAGE", help="page whose table is replaced")
    given = parser.parse_args()
    seeds = range(FIRST_SEED, FIRST_SEED + given.seeds)
    rows = []
    for situation in (*SITUATIONS, *OTHERS):
        used = seeds if situation.random else seeds[:1]
        rows.append((situation.name, *(str(Cell.of("", [error(situation, n, tick) for n in used])) for tick in TICKS)))
    table = markdown(("situation", *(f"ticks of {tick[:-2]} µs" for tick in TICKS)), rows)
    sys.stdout.write(table)
    if given.output is not None:
        write_block(given.output, "errors", table)


if __name__ == "__main__":
    main()
