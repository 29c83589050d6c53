"""Size and speed of the cores on three FPGAs, measured with open tools: writes docs/measured/size.md.

Area is that of the core alone, packed but not placed. Fmax is that of the core in a wrapper of registers, routed, the
median over nine seeds, or as many as are asked for; without `--only` it is measured where it has a bar. A second run
repeats only what depends on changed Verilog or changed tools.

Exit codes: 0, 1 if a bar is missed, 2 if a tool fails.
"""

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from cores import CONFIGURATIONS, Configuration
from pages import MEASURED, ROOT, Rows, count, data, filled, markdown, read_table, stamp, write, write_table
from rich.console import Console
from rich.progress import track

from tachometry.sim.studies.size import SEEDS, TARGETS, Measurement, measure_core, versions

PAGE = MEASURED / "size.md"
# What `plan` and `generate` know of the cells of a method, by the configuration that is measured.
CELLS = ROOT / "sim" / "studies" / "cells.json"
METHOD_CELLS = {
    "s": "reference",
    **{name: f"{name}-max-speed" for name in ("m", "t", "mt", "rairan")},
    **{name: name for name in ("track", "track-block")},
}
COSTS = (("ECP5", "COMB"), ("HX8K", "LC"), ("ECP5", "latency"))
SHOWN = (
    *(("ECP5", figure) for figure in ("COMB", "FF", "DP16KD", "MULT", "Fmax")),
    *((target, figure) for target in ("HX8K", "UP5K") for figure in ("LC", "Fmax")),
    ("ECP5", "latency"),
)
FIGURES = tuple(dict.fromkeys([*(cell for target in TARGETS.values() for cell in target.cells), "Fmax", "latency"]))
UNITS = {"Fmax": "MHz", "latency": "clocks"}
WORDS = {"configuration", "target", "what", "what limits Fmax", "option", "core", "gives"}  # columns of words


def section(title: str, header: Sequence[str], rows: Rows, text: str = "") -> str:
    """Return a table in Markdown, with a title, and a text below it."""
    words = [column for column, head in enumerate(header) if head in WORDS]
    return f"## {title}\n\n{markdown(header, rows, words)}" + (f"\n{text}\n" if text else "")


PEERS = data("peers")["peers"]
Results = Mapping[tuple[str, str], Measurement]  # by core and target


def measure(one: Configuration, target: str, tools: Mapping[str, str], seeds: int = len(SEEDS)) -> Measurement:
    """Synthesise, pack and route a core for a target."""
    verilog, ports = one.hardware
    return measure_core(one.spec, replace(TARGETS[target], after=one.after), verilog, tools, ports, range(1, seeds + 1))


def text_of(figure: str, found: Measurement) -> str:
    """Return a figure as the tables show it: Fmax with its spread."""
    value = found.figures.get(figure, "")
    if figure != "Fmax" or value == "":
        return str(value)
    return f"{value:.1f}" + (f" ({found.spread[0]:.0f}–{found.spread[1]:.0f})" if found.spread else "")


def heading(figure: str) -> str:
    """Return a figure's name with its unit."""
    return f"{figure} ({UNITS.get(figure, 'cells')})"


def rows(results: Results) -> Rows:
    """Return the table size.csv: all figures of all cores, and which bars they miss."""
    made = [["configuration", "target", "what", *FIGURES, "slowest", "fastest", "what limits Fmax", "missed"]]
    for (name, target), found in results.items():
        (one,) = (one for one in CONFIGURATIONS if one.name == name)
        cells = [str(round(found.figures[figure], 1)) if figure in found.figures else "" for figure in FIGURES]
        spread = [f"{end:.0f}" for end in found.spread or ()] or ["", ""]
        made.append([name, target, one.what, *cells, *spread, found.limit, ", ".join(missed(one, target, found))])
    return made


def missed(one: Configuration, target: str, found: Measurement) -> list[str]:
    """Return figures that miss their bar: Fmax must be at least the bar, all others at most."""
    bars = {figure: bar for figure, bar in one.bars.get(target, {}).items() if figure in found.figures}
    signs = {figure: 1 if figure == "Fmax" else -1 for figure in bars}
    return [figure for figure, bar in bars.items() if signs[figure] * (found.figures[figure] - bar) < 0]


def figures(results: Results, name: str, places: Sequence[tuple[str, str]]) -> list[float | None]:
    """Return figures of a core at targets; None if unknown."""
    return [results[name, at].figures.get(figure) if (name, at) in results else None for at, figure in places]


def core_table(results: Results) -> str:
    """Return the cores that a reader chooses between."""
    beside = [one for one in CONFIGURATIONS if one.has_speed_bar and not one.is_option]
    shown = [one for one in beside if "external" not in one.name and "8-output" not in one.name]
    found = {(one.name, one.what): figures(results, one.name, SHOWN) for one in shown}
    made = [[*one, *("" if n is None else f"{n:.0f}" for n in row)] for one, row in found.items() if any(row)]
    header = ["configuration", "what", *(f"{target} {heading(figure)}" for target, figure in SHOWN)]
    return section("Cores", header, made)


def cost_table(results: Results) -> str:
    """Return the cost of each option: differences from the reference."""
    reference = CONFIGURATIONS[0].name
    found = {(one.name, one.what): figures(results, one.name, COSTS) for one in CONFIGURATIONS if one.is_option}
    base = figures(results, reference, COSTS)
    made = [
        [*one, *(f"{n - m:+.0f}" for n, m in zip(row, base, strict=True) if n is not None and m is not None)]
        for one, row in found.items()
        if None not in row
    ]
    header = ["option", "what", *(f"{target} {heading(figure)}" for target, figure in COSTS)]
    return section(f"What each option costs: difference from {reference}", header, made)


def used(tools: Mapping[str, str]) -> str:
    """Return the tools as the page names them."""
    return ", ".join(f"{package} {version}" for package, version in tools.items())


def page(results: Results, tools: Mapping[str, str]) -> str:
    """Return the page docs/measured/size.md."""
    sections = [core_table(results), cost_table(results), section(**PEERS)]
    return filled("size.md", used=used(tools), measured="\n".join(sections))


def table_of(page: Path) -> Path:
    """Return the file with all figures of a page."""
    return page.parent / "tables" / "size.csv"


def kept(page: Path, tools: Mapping[str, str]) -> dict[tuple[str, str], Measurement]:
    """Return the figures of the table beside the page; RuntimeError if they were measured with other tools."""
    if used(tools) not in page.read_text(encoding="utf-8"):
        raise RuntimeError(f"{page.name} was not written with {used(tools)}: make size")
    results = {}
    for row in read_table(table_of(page)):
        found = {figure: float(row[figure]) for figure in FIGURES if row[figure]}
        results[row["configuration"], row["target"]] = Measurement(
            {figure: value if figure == "Fmax" else int(value) for figure, value in found.items()},
            row["what limits Fmax"],
            (float(row["slowest"]), float(row["fastest"])) if row["slowest"] else None,
        )
    return results


def arguments(words: Sequence[str] | None) -> argparse.Namespace:
    """Return the options of the command."""
    parser = argparse.ArgumentParser(description="Measure size and speed of the cores on three FPGAs.")
    names = [one.name for one in CONFIGURATIONS]
    parser.add_argument("--only", nargs="+", choices=names, metavar="NAME", help=f"some of: {', '.join(names)}")
    parser.add_argument("--update", action="store_true", help="write the page, where what is not measured stays")
    parser.add_argument("--jobs", type=count, default=os.cpu_count(), metavar="N", help="cores at a time (%(default)s)")
    parser.add_argument("--seeds", type=count, default=len(SEEDS), metavar="N", help="routings (%(default)s)")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="page (size.md; with --only: none)")
    options = parser.parse_args(words)
    if options.update and options.seeds != len(SEEDS):
        parser.error("--update does not take --seeds: rows of a page are measured alike")
    if options.output is None and (options.update or (options.only is None and options.seeds == len(SEEDS))):
        options.output = PAGE
    return options


def run(options: argparse.Namespace) -> int:
    """Measure, print, and write the page; 1 if a bar is missed."""
    tools = versions()
    chosen = [one for one in CONFIGURATIONS if options.only is None or one.name in options.only]
    work = [(one, target) for one in chosen for target in one.targets]
    all_routed, console = options.only and not options.update, Console(stderr=True)

    def measured(item: tuple[Configuration, str]) -> Measurement:
        return measure(*item, tools, options.seeds if all_routed or item[0].has_speed_bar else 0)

    with ThreadPoolExecutor(options.jobs) as pool:
        done = track(pool.map(measured, work), "measuring", len(work), console=console, disable=not console.is_terminal)
        results = {(one.name, target): result for (one, target), result in zip(work, done, strict=True)}
    made = rows(results)
    print(markdown(made[0], made[1:], left=[at for at, head in enumerate(made[0]) if head in WORDS]))
    if options.output:
        names = [one.name for one in chosen]
        before = kept(PAGE, tools) if options.update else {}
        results = {place: found for place, found in before.items() if place[0] not in names} | results
        write_table(table_of(options.output), made, merge=options.update, parts=names)
        write(options.output, page(results, tools))
        stamp(options.output)
        if options.output == PAGE:
            cells = {name: results[row, "ECP5"].figures["COMB"] for name, row in METHOD_CELLS.items()}
            CELLS.write_text(json.dumps(cells, indent=2) + "\n", encoding="utf-8")
        print(f"written: {options.output}")
    wrong = {one.name: one for one, target in work if missed(one, target, results[one.name, target])}
    print("".join(f"{name} misses a bar. {one.missed}\n" for name, one in wrong.items()), end="")
    return int(bool(wrong))


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    try:
        return run(arguments(words))
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
