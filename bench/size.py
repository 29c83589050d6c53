"""Size and speed of the cores on three FPGAs, measured with open tools: writes docs/measured/size.md.

Area is that of the core alone, packed but not placed. Fmax is that of the core in a wrapper of registers, routed, the
median over nine seeds, or as many as are asked for; without `--only` it is measured where it has a bar. A second run
repeats only what depends on changed Verilog or changed tools.

Exit codes: 0, 1 if a bar is missed, 2 if a tool fails.
"""

import argparse
import json
import os
import re
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from cores import CONFIGURATIONS, Configuration
from pages import MEASURED, ROOT, count, data, filled, markdown, stamp, write
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
COSTS = (("ECP5", "COMB"), ("ECP5", "FF"), ("ECP5", "DP16KD"), ("HX8K", "LC"), ("HX8K", "RAM"), ("ECP5", "latency"))
UNITS = {"Fmax": "MHz", "latency": "clocks"}
SPEED_TEXT = "Differences of Fmax of a few percent are less than those between seeds."
# Columns of words.
WORDS = {"configuration", "what", "what limits Fmax", "option", "core", "gives", "target", "bars", "missed", "without"}
WORDS |= {"project", "revision", "files", "options", "words after the files"}


@dataclass(frozen=True)
class Table:
    """A table with a title, and a text below it."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    text: str = ""

    def markdown(self) -> str:
        """Return a section in Markdown."""
        words = [column for column, head in enumerate(self.header) if head in WORDS]
        below = f"\n{self.text}\n" if self.text else ""
        return f"## {self.title}\n\n{markdown(self.header, self.rows, words)}{below}"


PEERS, PEER_SOURCES = (Table(**table) for table in data("peers").values())
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


def target_table(target_name: str, results: Results) -> Table:
    """Return all configurations on one target."""
    figures = [*TARGETS[target_name].cells, *UNITS]
    rows = [
        [one.name, one.what, *(text_of(figure, found) for figure in figures), found.limit]
        for one in CONFIGURATIONS
        if (found := results.get((one.name, target_name)))
    ]
    header = ["configuration", "what", *map(heading, figures), "what limits Fmax"]
    return Table(f"{target_name} ({TARGETS[target_name].device})", header, rows)


def difference(results: Results, name: str, base: str, target: str, figure: str) -> str:
    """Return how much a figure of a core is above that of another one; empty if one of them is not known."""
    found, other = (
        results[one, target].figures.get(figure) if (one, target) in results else None for one in (name, base)
    )
    return "" if found is None or other is None else f"{found - other:+.{1 if figure == 'Fmax' else 0}f}"


def cost_table(results: Results) -> Table:
    """Return what each option costs: differences from the reference."""
    base, rows = CONFIGURATIONS[0].name, []
    for one in (one for one in CONFIGURATIONS if one.is_option):
        cells = [difference(results, one.name, base, *place) for place in COSTS]
        rows += [[one.name, one.what, *cells]] if all(cells) else []
    header = ["option", "what", *(f"{target} {heading(figure)}" for target, figure in COSTS)]
    return Table(f"What each option costs: difference from {base}", header, rows)


def speed_table(results: Results) -> Table:
    """Return what a greatest speed changes: differences from the same core without one."""
    shown = [
        (target, figure)
        for target, device in TARGETS.items()
        for figure in (next(iter(device.cells)), "FF", "Fmax")
        if figure in (*device.cells, "Fmax")
    ]
    rows = []
    for one in (one for one in CONFIGURATIONS if one.without_max_speed):
        cells = [difference(results, one.name, one.without_max_speed, *place) for place in shown]
        rows += [[one.name, one.without_max_speed, *cells]] if any(cells) else []
    header = ["configuration", "without", *(f"{target} {heading(figure)}" for target, figure in shown)]
    return Table("What --max-speed 1000rad/s changes: difference from the core without", header, rows, SPEED_TEXT)


def is_met(figure: str, bar: float, found: Measurement) -> bool:
    """Return whether a figure is what it should be: Fmax at least the bar, all others at most."""
    value = found.figures[figure]
    return value >= bar if figure == "Fmax" else value <= bar


def bar_table(results: Results) -> Table:
    """Return the bars of each configuration, and which of them are missed."""
    rows, missed = [], []
    for one in CONFIGURATIONS:
        for target, bars in one.bars.items():
            found = results.get((one.name, target))
            if found is None or not (judged := {name: bar for name, bar in bars.items() if name in found.figures}):
                continue
            texts = [f"{name} {'≥' if name == 'Fmax' else '≤'} {bar}" for name, bar in judged.items()]
            wrong = [name for name, bar in judged.items() if not is_met(name, bar, found)]
            missed += [one] if wrong else []
            rows.append([one.name, target, ", ".join(texts), ", ".join(wrong)])
    why = dict.fromkeys(f"- `{one.name}`: {one.missed}" for one in missed if one.missed)
    return Table("Bars", ["configuration", "target", "bars", "missed"], rows, "\n".join(why))


def tables(results: Results) -> list[Table]:
    """Return all tables of measured figures that are not empty."""
    made = [*(target_table(target, results) for target in TARGETS), bar_table(results), speed_table(results)]
    return [table for table in (*made, cost_table(results)) if table.rows]


def used(tools: Mapping[str, str]) -> str:
    """Return the tools as the page names them."""
    return ", ".join(f"{package} {version}" for package, version in tools.items())


def page(measured: Sequence[Table], tools: Mapping[str, str]) -> str:
    """Return the page docs/measured/size.md."""
    sections = [table.markdown() for table in (*measured, PEERS, PEER_SOURCES)]
    return filled("size.md", used=used(tools), measured="\n".join(sections))


def kept(text: str, tools: Mapping[str, str]) -> dict[tuple[str, str], Measurement]:
    """Return what stands on the page; RuntimeError if it was measured with other tools."""
    if used(tools) not in text:
        raise RuntimeError(f"{PAGE.name} was not written with {used(tools)}: make size")
    results = {}
    for target in TARGETS:
        section = text.partition(f"## {target} (")[2].partition("\n## ")[0]
        lines = [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("|")]
        figures = [head.partition(" (")[0] for head in lines[0][2:-1]] if lines else []
        for line in lines[2:]:
            name, _, *cells = (cell.strip() for cell in line)
            found = {figure: float(cell.split(" (")[0]) for figure, cell in zip(figures, cells, strict=False) if cell}
            spread = re.search(r"\((\d+)–(\d+)\)", " ".join(cells))
            results[name, target] = Measurement(
                {figure: value if figure == "Fmax" else int(value) for figure, value in found.items()},
                cells[len(figures)] if len(cells) > len(figures) else "",
                (float(spread[1]), float(spread[2])) if spread else None,
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
    for table in tables(results):
        print(table.markdown())
    if options.update:
        names = {one.name for one in chosen}
        before = kept(PAGE.read_text(encoding="utf-8"), tools)
        results |= {place: found for place, found in before.items() if place[0] not in names}
    if options.output:
        write(options.output, page(tables(results), tools))
        stamp(options.output, *(one.name for one in chosen))
        if options.output == PAGE:
            cells = {name: results[row, "ECP5"].figures["COMB"] for name, row in METHOD_CELLS.items()}
            CELLS.write_text(json.dumps(cells, indent=2) + "\n", encoding="utf-8")
        print(f"written: {options.output}")
    return int(any(row[-1] for row in bar_table(results).rows))


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    try:
        return run(arguments(words))
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
