"""Fits the estimates of cells and greatest clock that commands print, and measures how far off they are.

The fit is to the cores of docs/measured/size.md, so `make size` comes first; Gowin, which it lacks, is fitted to random
cores. It is measured at other random cores, which are synthesised, packed and routed with three seeds, and kept: a
second run repeats only what depends on changed Verilog or tools. It writes sim/studies/estimate.json and
docs/measured/estimate.md.
"""

import argparse
import json
import random
import statistics
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from math import log
from typing import Any

import numpy as np
from cores import CONFIGURATIONS
from pages import MEASURED, ROOT, data, markdown, read_table, write, write_block, write_table
from size import PAGE as SIZES
from size import kept, used

from tachometry.hdl.export import export
from tachometry.sim.studies import estimate
from tachometry.sim.studies.estimate import FAMILIES, Timing, features, mapped
from tachometry.sim.studies.mapping import Mapped
from tachometry.sim.studies.size import CORE, TARGETS, measure_core, versions
from tachometry.spec import of_texts, with_axes
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.registers.buses import BUSES, Bus, bus_of, ports_on

PAGE, FITTED = MEASURED / "estimate.md", ROOT / "sim" / "studies" / "estimate.json"
TABLE, HEADS = MEASURED / "tables" / "estimate.csv", ("family", "core", "cells", "estimated", "MHz", "estimated MHz")
_DATA = data("estimate")
DRAWN: dict[str, dict[str, Any]] = _DATA["families"]


def draw(chance: random.Random) -> tuple[AnySpec, Bus | None, str]:
    """Return a random core, its bus, and its options as text; ValueError if there is none with these options."""
    method = chance.choice(_DATA["methods"].split())
    texts = {name: chance.choice(values.split()) for name, values in _DATA["always"].items()}
    for name, (values, likely, methods) in _DATA["sometimes"].items():
        if method in methods.split() and (likely == 1 or chance.random() < likely):
            texts[name] = values if " " not in values else chance.choice(values.split())
    for name, values in chance.sample([*_DATA["extras"].items()], chance.choice([0, 0, 1, 1, 2, 3])):
        texts[name] = chance.choice(values.split())
    bus = chance.choice(["none"] * 7 + [*BUSES])
    axes = chance.choice([1] * 9 + [2, 4, 8]) if method in ("s", "track") else 1
    has_loop = axes == 1 and chance.random() < 0.07
    core: Any = of_texts(method, texts)
    if axes > 1:
        core = with_axes(core, axes, parallel=bus != "none")
    elif has_loop:
        core = LoopSpec(tachometer=core)
    ports_on(core, bus_of(bus))
    more = {"bus": bus, "axes": str(axes), "loop": "yes" if has_loop else "no"}
    shown = {"method": method} | texts | {name: text for name, text in more.items() if text not in ("none", "1", "no")}
    return core, bus_of(bus), " ".join(f"{name}={text}" for name, text in shown.items())


def random_cores(number: int) -> Iterator[tuple[AnySpec, Bus | None, str]]:
    """Yield random cores, the same in every run."""
    chance = random.Random(_DATA["seed"])
    while number:
        with suppress(ValueError):  # options that do not go together
            yield draw(chance)
            number -= 1


def known(family: str) -> list[tuple[Mapped, Mapping[str, float]]]:
    """Return the cores of docs/measured/size.md in tables, with their figures, but for cores changed since."""
    every, target = kept(SIZES, versions()), FAMILIES[family].target
    rows = {name: row for (name, device), row in every.items() if TARGETS[device] is target}
    found = [(mapped(spec, bus, family), figures) for spec, bus, _, figures in drawn(family, "fitted")]
    for one in CONFIGURATIONS:
        if (row := rows.get(one.name)) is None or one.demo or one.after:
            continue
        here = estimate.flip_flops(mapped(one.spec, bus_of(one.bus), "ecp5"))
        if (name := (one.name, "ECP5")) in every and every[name].figures["FF"] == here:
            found.append((mapped(one.spec, bus_of(one.bus), family), row.figures))
    return found


def drawn(
    family: str, part: str, only: Sequence[int] | None = None, stays: Mapping[str, Mapping[str, float]] = {}
) -> Iterator[tuple[AnySpec, Bus | None, str, Mapping[str, float]]]:
    """Yield the random cores of a family that are compared, or that have a part in its fit, with their figures."""
    target, numbers = FAMILIES[family].target, DRAWN[family]
    chosen = {at for ends in numbers.get(part, []) for at in range(*ends)}
    seeds = [1, 2, 3] if part == "compared" else [1]  # one shows what to fit to
    for at, (spec, bus, text) in enumerate(random_cores(max(chosen, default=-1) + 1)):
        if only is not None and at in chosen - {*only}:
            if text in stays:  # else it has not been measured yet
                yield spec, bus, text, stays[text]
        elif at in chosen:
            verilog, tools = export(spec, CORE, bus.name if bus else "none")[f"{CORE}.v"], versions(target.route[0])
            yield spec, bus, text, measure_core(spec, target, verilog, tools, ports_on(spec, bus), seeds).figures


def fit(family: str) -> dict[str, list[float]]:
    """Return weights of cells, least squares of the relative error, and times whose periods are the nearest."""
    rows = known(family)
    cells = [next(iter(figures.values())) for _, figures in rows]
    counted = np.array([features(core, family) for core, _ in rows]) / np.array(cells)[:, None]
    weights = np.linalg.lstsq(counted, np.ones(len(rows)), rcond=None)[0]
    routed = [(core, 1000 / figures["Fmax"]) for core, figures in rows if figures.get("Fmax")]

    def error(times: Sequence[float]) -> float:
        return sum(log(Timing(*times).period(core) / period) ** 2 for core, period in routed)

    least = error(times := [*DRAWN[family]["start"]])
    for step in (1.3, 1.1, 1.3, 1.1, 1.05):
        for at in range(len(times)):
            for factor in (step, 1 / step):
                while (found := error(more := [*times[:at], times[at] * factor, *times[at + 1 :]])) < least * 0.9999:
                    times, least = more, found
    return {"cells": [round(float(each), 3) for each in weights], "times": [round(max(t, 0.001), 3) for t in times]}


def before(family: str) -> dict[str, dict[str, float]]:
    """Return the figures of a family in the table, by core: cores of other families have the same options."""
    table = (row for row in read_table(TABLE) if row["family"] == FAMILIES[family].title)
    return {row["core"]: {"cells": float(row["cells"]), "Fmax": float(row["MHz"] or 0)} for row in table}


def measured(family: str, only: Sequence[int] | None) -> list[tuple[str, float, float, float, float]]:
    """Return random cores: options, cells packed and estimated, MHz and estimated; those not in `only` stay."""
    rows = []
    for spec, bus, text, figures in drawn(family, "compared", only, before(family)):
        found, (cells, *_) = estimate.Estimate.of(spec, bus, family), figures.values()
        rows.append((text, cells, float(found.cells), figures["Fmax"], found.clock_hz / 1e6))
    return rows


def summary(found: Mapping[str, Sequence[tuple[str, float, float, float, float]]]) -> str:
    """Return the block of docs/measured/estimate.md."""

    def spread(each: Sequence[tuple[str, float, float, float, float]], at: int) -> list[str]:
        off = sorted(abs(float(row[at + 1]) / float(row[at]) - 1) for row in each if row[at])
        return [str(len(off)), f"{statistics.median(off):.1%}", f"{off[-1]:.1%}"] if off else ["0", "", ""]

    heads = ("family", "cores", "median, cells", "worst, cells", "routed", "median, MHz", "worst, MHz")
    rows = [[FAMILIES[name].title, *spread(each, 1), *spread(each, 3)] for name, each in found.items()]
    tools = used(versions(*(FAMILIES[name].target.route[0] for name in found)))
    return f"{markdown(heads, rows)}\nMeasured with {tools}.\n"


def main() -> None:
    """Fit, measure, and write both files; `--keep` measures the estimates as they are."""
    parser = argparse.ArgumentParser(description="Fit the estimates of cells and greatest clock, and measure them.")
    parser.add_argument("--keep", action="store_true", help="measure only: the weights stay")
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=[*DRAWN], help="some of the families")
    parser.add_argument("--only", nargs="+", type=int, metavar="N", help="measure these cores of them: the others stay")
    options = parser.parse_args()
    if not options.keep:
        estimate.FITTED.update({family: fit(family) for family in options.families})
        write(FITTED, json.dumps(estimate.FITTED).replace('}, "', '},\n "') + "\n")
    numbers = {family: options.only if family in options.families else [] for family in DRAWN}
    found = {family: measured(family, only) for family, only in numbers.items()}
    rows = [(FAMILIES[f].title, text, *(f"{n:.0f}" * bool(n) for n in each)) for f in found for text, *each in found[f]]
    write_table(TABLE, [HEADS, *rows])
    write_block(PAGE, "summary", summary(found))


if __name__ == "__main__":
    main()
