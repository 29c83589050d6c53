"""Measures velocity loops about a core, mean of seeds, for docs/measured/control.md."""

import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import product
from typing import NamedTuple

from loops import IDEAL, KINDS, REAL, TASK, TICKS, check, setting, usable, variants
from matplotlib.figure import Figure
from pages import MEASURED, ROOT, Rows, measure, stamp

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.engines.loop import Observer
from tachometry.sim.plots.style import COLOURS, save_figure
from tachometry.sim.studies.loops.control import Outcome, Task, each_seed, mean, outcome_of

sys.path.append(str(ROOT / "examples"))
from papers.tsuji_loops import SOLUTIONS, Cosine, deviation, solution

DISCS = {"ideal disc": IDEAL, "real disc": REAL}
SLOW = {
    "0": "constant:0:1200ms",
    "2 rad/s": "ramp:0:2rad/s:300ms+constant:2rad/s:900ms",
    "10 rad/s": "ramp:0:10rad/s:300ms+constant:10rad/s:900ms",
}
PAGE, PICTURE = MEASURED / "control.md", MEASURED / "control.png"


class Best(NamedTuple):
    """The greatest usable gain (1/s) of a method at a control tick (s), and its outcome."""

    disc: str
    name: str
    seconds: float
    gain: float
    outcome: Outcome


# The figure: label, levels and value of each row of panels.
SHOWN: tuple[tuple[str, tuple[float, ...], Callable[[Best], float]], ...] = (
    ("usable $k_v$ (1/s)", (50, 100, 200, 400), lambda one: one.gain),
    ("dip under 0.2 Nm (rad/s)", (0.1, 0.2, 0.4, 0.8), lambda one: one.outcome.dip or 0.0),
    ("current above 50 Hz (A rms)", (0.0, 0.2, 0.4, 0.6, 0.8, 1.0), lambda one: one.outcome.sound),
)


def cell(outcome: Outcome) -> str:
    """Return RMS error, greatest error, dip, current above 50 Hz."""
    assert outcome.dip is not None
    return ", ".join(f"{value:.3g}" for value in (outcome.rms, outcome.largest, outcome.dip, outcome.sound))


def usable_gains(seeds: int, jobs: int | None) -> tuple[Rows, list[Best]]:
    """Return a row per disc and method: at each tick the usable gain and its outcome; and all of them."""
    rows, found = [], []
    for (disc, encoder), kind in product(DISCS.items(), KINDS):
        row = [disc, kind.name]
        for seconds in TICKS:
            if kind.method == "track" and seconds < kind.shortest:
                row.append("")  # the core has a new velocity every 20 µs
                continue
            best = usable(lambda kv: setting(kind, kv, seconds, encoder), range(seeds), jobs)  # noqa: B023
            print(disc, kind.name, seconds, best, file=sys.stderr, flush=True)
            row.append(f"{best[0]:g}: {cell(best[1])}" if best else "-")
            found += [Best(disc, kind.name, seconds, *best)] if best else []
        rows.append(row)
    return [["disc", "method", *(head for *_, head in TICKS.values())], *rows], found


def gains(seeds: int, jobs: int | None) -> Rows:
    """Return the table of usable gains, and draw it."""
    table, found = usable_gains(seeds, jobs)
    save_figure(PICTURE, lambda: drawn(found))
    return table


def drawn(found: Sequence[Best]) -> Figure:
    """Return usable gain, dip and current over the tick: a column per disc, a curve per method."""
    figure = Figure(figsize=(9, 6.5), layout="constrained")
    panels = figure.subplots(len(SHOWN), len(DISCS), sharex=True, sharey="row")
    for (row, (label, levels, value)), (column, disc) in product(enumerate(SHOWN), enumerate(DISCS)):
        axes = panels[row, column]
        for name, colour, mark in zip((kind.name for kind in KINDS), COLOURS, "os^DvP", strict=False):
            shown = sorted((one.seconds, value(one)) for one in found if (one.disc, one.name) == (disc, name))
            axes.plot(*zip(*shown, strict=True), color=colour, marker=mark, markersize=4, linewidth=1, label=name)
        axes.set(xscale="log", yscale="linear" if label == SHOWN[-1][0] else "log", ylabel=label * (column == 0))
        axes.set_xticks([*TICKS], [head.split(", ")[-1] for *_, head in TICKS.values()])
        axes.set_yticks(levels, [f"{level:g}" for level in levels])
        axes.minorticks_off()
        axes.set_title(disc * (row == 0), loc="left", fontsize=9)
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=len(KINDS), fontsize=8)
    figure.supxlabel("control tick", fontsize=9)
    return figure


def weights(seeds: int, jobs: int | None) -> Rows:
    """Return ticks of 20 µs: the observer with every tick, and with every update, for S and M/T."""
    rows = []
    for disc, encoder in DISCS.items():
        for kv in (40.0, 80.0, 160.0):
            found = [cell(outcome_of(setting(kind, kv, 20e-6, encoder), range(seeds), jobs)) for kind in KINDS]
            rows.append((disc, f"{kv:g}", *found))
    return [("disc", "k_v", *(kind.name for kind in KINDS)), *rows]


def assumptions(seeds: int, jobs: int | None) -> Rows:
    """Return the changes against the real disc, ticks of 1 ms and 20 µs, k_v = 40 and 80."""
    rows: dict[str, list[str]] = {}
    for kv, seconds in ((40.0, 1e-3), (80.0, 20e-6)):
        base = setting(KINDS[0], kv, seconds, REAL)
        conventional = replace(base, gains=replace(base.gains, way=Observer.CONVENTIONAL))
        for name, varied in (*variants(base), ("the conventional observer", conventional)):
            rows.setdefault(name, [name]).append(cell(outcome_of(varied, range(seeds), jobs)))
    return [("change", "1 ms, k_v = 40", "20 µs, k_v = 80"), *rows.values()]


def in_gates(seeds: int, jobs: int | None) -> Rows:
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
            found = list(pool.map(partial(check, one), range(seeds)))
        gates, double = mean([one.gates for one in found]), mean([one.double for one in found])
        ticks, wrong = sum(one.ticks for one in found), sum(one.mismatches for one in found)
        errors = (f"{gates.rms:.4g}", f"{double.rms:.4g}", f"{gates.sound:.4g}", f"{double.sound:.4g}")
        rows.append((name, f"{ticks}", f"{wrong}", *errors))
    heads = ("loop", "control ticks", "mismatches", "RMS error", "in double", "current", "current in double")
    return [heads, *rows]


def solutions(seeds: int, jobs: int | None) -> Rows:
    """Return the largest deviations of Fig. 14 with shorter ticks, mean of seeds: 1 s to 39 rad/s, from 2 s to 4 s."""
    motion, rows = parse_motion("ramp:0:39rad/s:1s+constant:39rad/s:3s"), []
    for seconds in (1e-3, 1e-4, 20e-6, 1e-6):
        _, tick, head = TICKS[seconds]
        found = []
        for _, cancel, synchronised in SOLUTIONS:
            logs = each_seed(solution(tick, motion, cancel, synchronised), range(seeds), jobs)
            found.append(sum(deviation(log, 2.0) for log in logs) / seeds)
        rows.append((head, *(f"{value:.2f}" for value in found)))
    return [("T_s", "(a)", "(b)", "(c)"), *rows]


def slow_shafts(seeds: int, jobs: int | None) -> Rows:
    """Return a shaft that rests, or turns slowly, under the load: real disc, ticks of 20 µs, usable gains."""
    rows = []
    tracking = KINDS[-1]
    ways = ((KINDS[0], 95.1), (KINDS[2], 95.1), (tracking, 113.1), (tracking._replace(filtered=True), 113.1))
    for speed, motion in SLOW.items():
        row = [speed]
        for kind, kv in ways:
            task = replace(TASK, motion=parse_motion(motion))
            row.append(cell(outcome_of(replace(setting(kind, kv, 20e-6, REAL), task=task), range(seeds), jobs)))
        rows.append(row)
    heads = ("speed", *(kind.name for kind, _ in ways[:-1]), "tracking, with a filter")
    return [heads, *rows]


def accelerations(seeds: int, jobs: int | None) -> Rows:
    """Return tracking, real disc, ticks of 20 µs: the disturbance from velocity and measured acceleration."""
    rows = []
    ways = {"velocity": Observer.SYNCHRONISED, "acceleration": Observer.ACCELERATION}
    for kv, times in ((40.0, 2), (80.0, 2), (113.1, 2), (113.1, 1), (160.0, 1)):
        base = setting(KINDS[-1], kv, 20e-6, REAL)
        for name, way in ways.items():
            changed = replace(base.gains, way=way, observer=times * kv)
            found = outcome_of(replace(base, gains=changed), range(seeds), jobs)
            rows.append((f"{kv:g}", f"{times * kv:g}", name, cell(found)))
    return [("k_v", "G", "observer", "errors, dip, current"), *rows]


BLOCKS = {
    "loop-gains": gains,
    "loop-weights": weights,
    "loop-assumptions": assumptions,
    "loop-solutions": solutions,
    "loop-slow": slow_shafts,
    "loop-acceleration": accelerations,
    "loop-gates": in_gates,
}

if __name__ == "__main__":
    measure(PAGE, BLOCKS, seeds=6, jobs=os.cpu_count())
    stamp(PICTURE)
