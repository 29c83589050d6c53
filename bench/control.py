"""Measures what a velocity loop about a core can do, mean of seeds, for docs/measured/control.md."""

import argparse
import functools
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from gain_figure import Found, save_usable_gains
from gate_check import check
from pages import ROOT, markdown, stamp, write_block
from usable_gain import IDEAL, KINDS, REAL, TASK, TICKS, setting, usable, variants

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.engines.loop import Observer
from tachometry.sim.studies.loops.control import Outcome, Task, each_seed, mean, outcome_of

sys.path.append(str(ROOT / "examples"))
from papers.tsuji_loops import SOLUTIONS, Cosine, deviation, solution

DISCS = {"ideal disc": IDEAL, "real disc": REAL}
SLOW = {
    "0": "constant:0:1200ms",
    "2 rad/s": "ramp:0:2rad/s:300ms+constant:2rad/s:900ms",
    "10 rad/s": "ramp:0:10rad/s:300ms+constant:10rad/s:900ms",
}
SHOWN_TICKS = {1e-3: "1 ms", 1e-4: "100 µs", 20e-6: "20 µs", 1e-6: "1 µs", 20e-9: "one clock, 20 ns"}


def cell(outcome: Outcome) -> str:
    """Return RMS error, greatest error, dip, current above 50 Hz."""
    assert outcome.dip is not None
    return ", ".join(f"{value:.3g}" for value in (outcome.rms, outcome.largest, outcome.dip, outcome.sound))


def usable_gains(seeds: Sequence[int], jobs: int) -> tuple[str, list[Found]]:
    """Return a row per disc and method: at each tick the usable gain and what comes of it; and the same for the
    figure.
    """
    rows, found = [], []
    for disc, encoder in DISCS.items():
        for kind in KINDS:
            row = [disc, kind.name]
            for seconds in TICKS:
                if kind.method == "track" and seconds < kind.shortest:
                    row.append("")  # the core has a new velocity every 20 µs
                    continue
                best = usable(lambda kv: setting(kind, kv, seconds, encoder), seeds, jobs)  # noqa: B023
                print(disc, kind.name, seconds, best, file=sys.stderr, flush=True)
                row.append(f"{best[0]:g}: {cell(best[1])}" if best else "-")
                if best is not None:
                    found.append(Found(disc, kind.name, seconds, *best))
            rows.append(row)
    heads = ["disc", "method", *(SHOWN_TICKS[seconds] for seconds in TICKS)]
    return markdown(heads, rows, left=range(len(heads))), found


def weights(seeds: Sequence[int], jobs: int) -> str:
    """Return ticks of 20 µs: the observer with every tick, and with every update, for S and M/T."""
    rows = []
    for disc, encoder in DISCS.items():
        for kv in (40.0, 80.0, 160.0):
            found = [cell(outcome_of(setting(kind, kv, 20e-6, encoder), seeds, jobs)) for kind in KINDS]
            rows.append((disc, f"{kv:g}", *found))
    return markdown(("disc", "k_v", *(kind.name for kind in KINDS)), rows, left=range(len(KINDS) + 2))


def assumptions(seeds: Sequence[int], jobs: int) -> str:
    """Return what is changed against the real disc, ticks of 1 ms and 20 µs, k_v = 40 and 80."""
    rows: dict[str, list[str]] = {}
    for kv, seconds in ((40.0, 1e-3), (80.0, 20e-6)):
        base = setting(KINDS[0], kv, seconds, REAL)
        conventional = replace(base, gains=replace(base.gains, way=Observer.CONVENTIONAL))
        for name, varied in (*variants(base), ("the conventional observer", conventional)):
            rows.setdefault(name, [name]).append(cell(outcome_of(varied, seeds, jobs)))
    return markdown(("what is changed", "1 ms, k_v = 40", "20 µs, k_v = 80"), list(rows.values()), left=range(3))


def in_gates(seeds: Sequence[int], jobs: int) -> str:
    """Return the controller in gates against its golden model, and against double precision."""
    held = setting(KINDS[0], 80.0, 20e-6, REAL)
    cosine = replace(
        setting(KINDS[0], 50.0, 20e-6, REAL), task=Task(motion=Cosine(10.0), noise=held.task.noise), begin=1.0
    )
    loops = {
        "S, as in Fig. 15, k_v = 50, 10 s each": cosine,
        "S, 39 rad/s, k_v = 80, 1.2 s each": held,
        "M/T, 39 rad/s, k_v = 80, 1.2 s each": setting(KINDS[2], 80.0, 20e-6, REAL),
        "tracking, 39 rad/s, k_v = 80, 1.2 s each": setting(KINDS[-1], 80.0, 20e-6, REAL),
    }
    rows = []
    for name, one in loops.items():
        with ThreadPoolExecutor(jobs) as pool:
            found = list(pool.map(functools.partial(check, one), seeds))
        gates, double = mean([one.gates for one in found]), mean([one.double for one in found])
        ticks, wrong = sum(one.ticks for one in found), sum(one.mismatches for one in found)
        errors = (f"{gates.rms:.4g}", f"{double.rms:.4g}", f"{gates.sound:.4g}", f"{double.sound:.4g}")
        rows.append((name, f"{ticks}", f"{wrong}", *errors))
    heads = ("loop", "control ticks", "mismatches", "RMS error", "in double", "current above 50 Hz", "in double")
    return markdown(heads, rows)


def solutions(seeds: Sequence[int], jobs: int) -> str:
    """Return the largest deviations of Fig. 14 with shorter ticks, mean of seeds: 1 s to 39 rad/s, from 2 s to 4 s."""
    motion, rows = parse_motion("ramp:0:39rad/s:1s+constant:39rad/s:3s"), []
    for seconds in (1e-3, 1e-4, 20e-6, 1e-6):
        _, tick = TICKS[seconds]
        found = []
        for _, cancel, synchronised in SOLUTIONS:
            logs = each_seed(solution(tick, motion, cancel, synchronised), seeds, jobs)
            found.append(sum(deviation(log, 2.0) for log in logs) / len(seeds))
        rows.append((SHOWN_TICKS[seconds], *(f"{value:.2f}" for value in found)))
    return markdown(("T_s", "(a)", "(b)", "(c)"), rows)


def slow_shafts(seeds: Sequence[int], jobs: int) -> str:
    """Return a shaft that rests, or turns slowly, under the load: real disc, ticks of 20 µs, usable gains."""
    rows = []
    tracking = KINDS[-1]
    ways = ((KINDS[0], 95.1), (KINDS[2], 95.1), (tracking, 113.1), (replace(tracking, filtered=True), 113.1))
    for speed, motion in SLOW.items():
        row = [speed]
        for kind, kv in ways:
            task = replace(TASK, motion=parse_motion(motion))
            row.append(cell(outcome_of(replace(setting(kind, kv, 20e-6, REAL), task=task), seeds, jobs)))
        rows.append(row)
    heads = ("speed", *(kind.name for kind, _ in ways[:-1]), "tracking, with a filter")
    return markdown(heads, rows, left=range(len(heads)))


def accelerations(seeds: Sequence[int], jobs: int) -> str:
    """Return tracking, real disc, ticks of 20 µs: the disturbance from the velocity, and from the measured
    acceleration.
    """
    rows = []
    ways = {"velocity": Observer.SYNCHRONISED, "acceleration": Observer.ACCELERATION}
    for kv, times in ((40.0, 2), (80.0, 2), (113.1, 2), (113.1, 1), (160.0, 1)):
        base = setting(KINDS[-1], kv, 20e-6, REAL)
        for name, way in ways.items():
            gains = replace(base.gains, way=way, observer=times * kv)
            found = outcome_of(replace(base, gains=gains), seeds, jobs)
            rows.append((f"{kv:g}", f"{times * kv:g}", name, cell(found)))
    return markdown(("k_v", "G", "observer", "errors, dip, current"), rows, left=(2, 3))


TABLES = {
    "weights": weights,
    "assumptions": assumptions,
    "solutions": solutions,
    "slow": slow_shafts,
    "acceleration": accelerations,
    "gates": in_gates,
}


def main() -> None:
    """Print the tables, and put them into the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=6, metavar="N", help="seeds of what is random (%(default)s)")
    parser.add_argument("--jobs", type=int, metavar="N", help="threads (one for each core)")
    parser.add_argument("--only", choices=(*TABLES, "gains"), help="one of the tables")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="figure of the usable gains")
    parser.add_argument("-o", "--output", type=Path, metavar="PAGE", help="page whose tables are replaced")
    given = parser.parse_args()
    for name in (*TABLES, "gains"):
        if given.only not in (None, name):
            continue
        if name == "gains":
            table, found = usable_gains(range(given.seeds), given.jobs)
            if given.plot is not None:
                save_usable_gains(given.plot, found)
        else:
            table = TABLES[name](range(given.seeds), given.jobs)
        sys.stdout.write(f"{table}\n")
        if given.output is not None:
            write_block(given.output, name, table)
        if name == "gains" and given.plot is not None:
            stamp(given.plot)


if __name__ == "__main__":
    main()
