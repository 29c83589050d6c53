"""Fits the estimates of cells and greatest clock that commands print, and measures how far off they are.

The fit is to the cores of docs/measured/size.md, so `make size` comes first. It is measured at random cores, which are
synthesised, packed and routed with three seeds, and kept: a second run repeats only what depends on changed Verilog or
tools. It writes sim/studies/estimate.json and docs/measured/estimate.md.
"""

import argparse
import json
import random
import statistics
from collections.abc import Iterator, Mapping, Sequence
from math import log
from pathlib import Path
from typing import Any

import numpy as np
from cores import CONFIGURATIONS
from pages import markdown, write
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

ROOT = Path(__file__).resolve().parent.parent
PAGE, FITTED = ROOT / "docs" / "measured" / "estimate.md", ROOT / "sim" / "studies" / "estimate.json"
SEED, ROUTED = 2, {"ecp5": (40, 14), "ice40hx": (16, 3), "ice40up": (12, 0)}  # random cores, and those that are routed
START = {
    "ecp5": (0.3, 0.5, 0.15, 0.24, 0.2, 0.9, 0.05, 0.3, 6.4, 3.5),
    "ice40hx": (0.6, 0.6, 0.1, 0.4, 0.001, 0.3, 0.13, 0.7, 2.5, 5),
    "ice40up": (1.5, 1.6, 0.2, 1.2, 0.001, 0.7, 0.28, 1.5, 5, 12),
}  # times of the search, in the order of `Timing`
METHODS = "s m t mt rairan track track".split()
# An option a line: its values, how likely it is, and the methods that have it. Of EXTRAS there are up to three.
ALWAYS = """
cpr: 4 16 100 400 1024 2000 4096 10000 16384 65536
clock: 12MHz 25MHz 48MHz 50MHz 100MHz 125MHz
tick: 10us 20us 50us 100us 250us 1ms
max-time: 10ms 50ms 100ms 500ms"""
SOMETIMES = """
max-speed: 100rad/s 1000rad/s 6000rpm 3000rpm: 0.7: s m t mt rairan track
unit: rad/s rpm rev/s: 0.3: s m t mt rairan track
position-width: 16 24 48: 0.2: s m t mt rairan track
frac-bits: 8 12 20: 0.2: s m t mt rairan track
multiplier: serial block: 1: track
reciprocal: table: 0.3: s
average: 4 10 64: 0.4: m
timer: tick: 0.2: t mt
adaptive: 1%: 0.3: rairan
sensor: pulses step-dir up-down: 0.15: s m t mt rairan track"""
EXTRAS = """
filter: 100ns 200ns 1us
index: yes
health: yes
probe: 1 2
age: yes
bounds: yes
over-speed: 500rad/s
position-modulo: rev
preset: 0
external-tick: yes
lowpass: 200rad/s
compare: 0:100:50:10us
stream: axi"""


def lines(text: str, parts: int = 1) -> list[list[str]]:
    """Return the parts of each line, an option and what is said of it."""
    return [line.split(": ", parts) for line in text.strip().splitlines()]


def draw(chance: random.Random) -> tuple[AnySpec, Bus | None, str]:
    """Return a random core, its bus, and its options as text; ValueError if there is none with these options."""
    method = chance.choice(METHODS)
    texts = {name: chance.choice(values.split()) for name, values in lines(ALWAYS)}
    for name, values, likely, methods in lines(SOMETIMES, 3):
        if method in methods.split() and (likely == "1" or chance.random() < float(likely)):
            texts[name] = values if " " not in values else chance.choice(values.split())
    for name, values in chance.sample(lines(EXTRAS), chance.choice([0, 0, 1, 1, 2, 3])):
        texts[name] = chance.choice(values.split())
    bus = chance.choice(["none"] * 7 + [*BUSES])
    axes = chance.choice([1] * 9 + [2, 4, 8]) if method in ("s", "track") else 1
    has_loop = axes == 1 and chance.random() < 0.07
    tachometer = of_texts(method, texts)
    core: Any = tachometer
    if axes > 1:
        core = with_axes(tachometer, axes, parallel=bus != "none")
    elif has_loop:
        core = LoopSpec(tachometer=tachometer)
    ports_on(core, bus_of(bus))
    more = {"bus": bus, "axes": str(axes), "loop": "yes" if has_loop else "no"}
    shown = {"method": method} | texts | {name: text for name, text in more.items() if text not in ("none", "1", "no")}
    return core, bus_of(bus), " ".join(f"{name}={text}" for name, text in shown.items())


def random_cores(number: int) -> Iterator[tuple[AnySpec, Bus | None, str]]:
    """Yield random cores, the same in every run."""
    chance = random.Random(SEED)
    while number:
        try:
            yield draw(chance)
            number -= 1
        except ValueError:  # options that do not go together
            continue


def known(family: str) -> list[tuple[Mapped, Mapping[str, float]]]:
    """Return the cores of docs/measured/size.md in tables, with their figures, but for cores changed since."""
    rows = kept(SIZES.read_text(encoding="utf-8"), versions())
    found = []
    for one in CONFIGURATIONS:
        row = rows.get((one.name, FAMILIES[family].target))
        if row is None or one.demo or one.after:
            continue
        here = estimate.flip_flops(mapped(one.spec, bus_of(one.bus), "ecp5"))
        if (name := (one.name, "ECP5")) in rows and rows[name].figures["FF"] == here:
            found.append((mapped(one.spec, bus_of(one.bus), family), row.figures))
    return found


def cells_of(figures: Mapping[str, float]) -> float:
    """Return logic cells, as the family counts them."""
    return figures.get("COMB", figures.get("LC", 0))


def fit(family: str) -> dict[str, list[float]]:
    """Return weights of cells, least squares of the relative error, and times whose periods are the nearest."""
    rows = known(family)
    counted = np.array([[each / cells_of(figures) for each in features(core, family)] for core, figures in rows])
    weights = np.linalg.lstsq(counted, np.ones(len(rows)), rcond=None)[0]
    routed = [(core, 1000 / figures["Fmax"]) for core, figures in rows if figures.get("Fmax")]

    def error(times: Sequence[float]) -> float:
        return sum(log(Timing(*times).period(core) / period) ** 2 for core, period in routed)

    times, least = [*START[family]], error(START[family])
    for step in (1.3, 1.1):
        for at in range(len(times)):
            for factor in (step, 1 / step):
                while (found := error(more := [*times[:at], times[at] * factor, *times[at + 1 :]])) < least * 0.9999:
                    times, least = more, found
    times = [max(each, 0.001) for each in times]
    return {"cells": [round(float(each), 3) for each in weights], "times": [round(each, 3) for each in times]}


def measured(family: str) -> list[tuple[str, float, float, float, float]]:
    """Return random cores: options, cells and MHz that nextpnr reaches, and those estimated; MHz 0 where not routed."""
    tools, (number, routed) = versions(), ROUTED[family]
    rows = []
    for at, (spec, bus, text) in enumerate(random_cores(number)):
        verilog = export(spec, CORE, bus.name if bus else "none")[f"{CORE}.v"]
        target, seeds = TARGETS[FAMILIES[family].target], range(1, 4) if at < routed else ()
        figures = measure_core(spec, target, verilog, tools, ports_on(spec, bus), [*seeds]).figures
        found = estimate.Estimate.of(spec, bus, family)
        rows.append((text, cells_of(figures), figures.get("Fmax", 0), float(found.cells), found.clock_hz / 1e6))
    return rows


def page(found: Mapping[str, Sequence[tuple[str, float, float, float, float]]]) -> str:
    """Return docs/measured/estimate.md."""

    def spread(pairs: Sequence[tuple[float, float]]) -> list[str]:
        off = sorted(abs(guess / real - 1) for real, guess in pairs if real)
        return [str(len(off)), f"{statistics.median(off):.1%}", f"{off[-1]:.1%}"] if off else ["0", "", ""]

    heads = ("family", "cores", "median, cells", "worst, cells", "routed", "median, MHz", "worst, MHz")
    rows = [
        [FAMILIES[name].title, *spread([(r[1], r[3]) for r in each]), *spread([(r[2], r[4]) for r in each])]
        for name, each in found.items()
    ]
    text = f"""# How far off estimates are

`python bench/estimate.py` wrote this page with {used(versions())}.

`generate`, `plan` and `explore` estimate the cells and the greatest clock of a core. They count the lookup tables,
carry chains and memories of its netlist, and find its longest path. The weights are fitted to the cores of
[size](size.md). Here the estimates are compared with random cores that had no part in the fit: cells as nextpnr packs
them, MHz as the median of three routings. Single routings differ by 8 % from their median. The greatest clock is
printed for ECP5 alone: for an iCE40 it may be off by more than 20 %.

{markdown(heads, rows)}"""
    for name, each in found.items():
        lines = [
            [text, f"{cells:.0f}", f"{guess:.0f}", f"{clock:.0f}" if clock else "", f"{guessed:.0f}"]
            for text, cells, clock, guess, guessed in each
        ]
        columns = ("core", "cells", "estimated", "MHz", "estimated MHz")
        text += f"\n## {FAMILIES[name].title} ({TARGETS[FAMILIES[name].target].device})\n\n{markdown(columns, lines)}"
    return text


def main() -> None:
    """Fit, measure, and write both files; `--keep` measures the estimates as they are."""
    parser = argparse.ArgumentParser(description="Fit the estimates of cells and greatest clock, and measure them.")
    parser.add_argument("--keep", action="store_true", help="measure only: the weights stay")
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=[*ROUTED])
    options = parser.parse_args()
    if not options.keep:
        estimate.FITTED.update({family: fit(family) for family in options.families})
        write(FITTED, json.dumps(estimate.FITTED, indent=1) + "\n")
    write(PAGE, page({family: measured(family) for family in options.families}))


if __name__ == "__main__":
    main()
