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
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from cores import CONFIGURATIONS, Configuration
from pages import markdown, stamp, write
from rich.console import Console
from rich.progress import track

from tachometry.sim.studies.size import (
    CORE,
    SEEDS,
    TARGETS,
    Measurement,
    made,
    measure_core,
    split_name,
    synthesis,
    versions,
)

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "measured" / "size.md"
# What `plan` and `generate` know of the cells of a method, by the configuration that is measured.
CELLS = ROOT / "sim" / "studies" / "cells.json"
METHOD_CELLS = {
    "s": "reference",
    **{name: f"{name}-max-speed" for name in ("m", "t", "mt", "rairan")},
    **{name: name for name in ("track", "track-block")},
}
Item = TypeVar("Item")


COSTS = (("ECP5", "COMB"), ("ECP5", "FF"), ("ECP5", "DP16KD"), ("HX8K", "LC"), ("HX8K", "RAM"), ("ECP5", "latency"))
WORDS = (
    "configuration",
    "what",
    "what limits Fmax",
    "option",
    "box",
    "core",
    "gives",
    "target",
    "bars",
    "missed",
    "without",
    "project",
    "revision",
    "files",
    "options",
    "words after the files",
)
UNITS = {"Fmax": "MHz", "latency": "clocks"}


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


# Why a bar is missed, by its core.
MISSED = {
    "bus-native": "It has some flip-flops more than planned.",
    "m-10": "Its carry chain of 41 bits is the longest of these cores. Two shorter ones, as "
    "[S](../concepts/s-method.md) has, need a reciprocal that is divided, and that of the mean is a constant.",
}
PEERS = Table(
    "Peers",
    (
        "core",
        "gives",
        "ECP5 COMB (cells)",
        "ECP5 FF (cells)",
        "blocks",
        "ECP5 Fmax (MHz)",
        "HX8K LC (cells)",
        "HX8K Fmax (MHz)",
        "latency (clocks)",
    ),
    (
        ("PandABlocks", "position", "142", "39", "", "186.4 (183–194)", "138", "119.9 (111–124)", ""),
        ("AMDC", "position", "667", "142", "", "118.5 (112–124)", "412", "90.6 (86–95)", ""),
        (
            *("ADI speed_detector", "period only, unsigned", "452", "283", "2 RAM (HX8K)", "133.2 (128–136)"),
            *("497", "88.9 (85–94)", ""),
        ),
        ("LiteX-CNC", "position", "116", "44", "", "192.9 (177–198)", "117", "136.7 (121–137)", ""),
        ("HostMot2 qcounter", "position, time", "151", "84", "", "213.9 (206–227)", "210", "143.8 (133–160)", ""),
        ("UltraZohm V26", "speed, position", "7929", "3802", "74 MULT", "42.1 (one seed)", "", "", ""),
        ("M/T, serial divider", "speed", "300", "217", "", "203.5 (185–218)", "378", "135.2 (122–135)", "39"),
    ),
    """These are cores of others, and one as textbooks have it. They were measured as everything on this page; VHDL went
through GHDL 2.0.0. They do different things, as the column "gives" says. A blank was not measured, or is none.
UltraZohm's core has more multipliers than the LFE5U-25F: its figures are those of the LFE5U-85F. In silence the
textbook's M/T holds its velocity for 10 ms, where that of the core `mt` decays.""",
)

PEER_SOURCES = Table(
    "What was measured of the peers",
    ("core", "project", "revision", "files", "options", "seeds", "words after the files"),
    (
        (
            *("PandABlocks", "PandABlocks/PandABlocks-FPGA", "916fb9a6b537", "common/hdl/qdecoder.vhd, qdec.vhd"),
            *("it has none", "9", "`--top qdec --clock clk_i`"),
        ),
        (
            *("AMDC", "Severson-Group/AMDC-Firmware", "d348fd484476", "ip_repo/amdc_encoder_1.0/src/encoder.v"),
            *("it has none", "9", "`--top encoder`"),
        ),
        (
            *("ADI speed_detector", "analogdevicesinc/hdl", "96adaf4fc702", "library/axi_mc_speed/speed_detector.v"),
            "defaults: AVERAGE_WINDOW=32, LOG_2_AW=5, SAMPLE_CLK_DECIM=10000",
            *("9", "`--top speed_detector --clock clk_i`"),
        ),
        (
            *("LiteX-CNC", "Peter-van-Tol/LiteX-CNC", "957b877dcc2a"),
            "src/litexcnc/firmware/modules/encoder.py, class EncoderModule, as Verilog from Migen 0.10.0",
            "defaults: no bounds, reset_value 0; with Z; two flags from registers, as in create_from_config",
            *("9", "`--top litexcnc_encoder --clock sys_clk`"),
        ),
        (
            *("HostMot2 qcounter", "LinuxCNC/hostmot2-firmware", "c15c0c3c0af8", "src/qcountersf.vhd"),
            *("default: buswidth=32", "9", "`--top qcounter`"),
        ),
        (
            *("UltraZohm V26", "ultrazohm/ultrazohm_sw", "65431ca4df39"),
            "ip_cores/IncreEncoder_V26_ip/Simulation/hdl_prj/hdlsrc/inc_enc_v26: the 20 files of"
            " Incremental_Encoder_v26_src_IncEnc_V26_compile.do, in its order, so without the AXI interface",
            *("it has none", "1"),
            "`--top Incremental_Encoder_v26_src_IncEnc_V26 --targets ECP5-85F --seeds 1`",
        ),
        (
            *("M/T, serial divider", "this one", "this one", "bench/peers/mt_serial_divider.v"),
            *("it has none: 48 MHz, 20 us, standstill after 10 ms, 16 fraction bits", "9"),
            "`--top mt_serial_divider`",
        ),
    ),
    """The other projects are on GitHub. `python bench/peers.py FILE…` with the words of the last column measures a row
again; other files and words measure any other core. ADI removed its file in the commit after this revision.""",
)

PAGE_HEAD = """\
# Size and speed

`make size` (`python bench/size.py`) wrote this page with {used}.

- Area is that of the core alone, as nextpnr packs it. COMB, FF, DP16KD and MULT are the ECP5 cells TRELLIS_COMB,
  TRELLIS_FF, DP16KD (block RAM) and MULT18X18D. LC, RAM and DSP are the iCE40 cells ICESTORM_LC, ICESTORM_RAM and
  ICESTORM_DSP.
- Fmax is that of the core in a wrapper, routed. It is the median over seeds 1 to 9; in brackets are the slowest and the
  fastest of them. A bar is met if the median meets it. The inputs come from a shift register. The outputs are
  registered, and then loaded into a shift register that ends in one pin.
- Latency is from `tick` to `velocity_valid`, which come together with many axes; of a core with a control loop, from
  `control_tick` to `current_valid`.
- The column "what limits Fmax" has the longest path of the median seed, from register to register, as `box.signal`.
- Fmax 0 is of a seed whose placement nextpnr cannot route.
- Only cores whose Fmax has a bar are routed. `python bench/size.py --only NAME` routes any of them.

"""


SPEED_TEXT = "Differences of Fmax of a few percent are less than those between seeds."


Results = Mapping[tuple[str, str], Measurement]


def measure(
    configuration: Configuration, target_name: str, verilog: str, tools: Mapping[str, str], seeds: int = len(SEEDS)
) -> Measurement:
    """Synthesise, pack and route a core for a target."""
    ports = configuration.hardware[1]
    target = replace(TARGETS[target_name], after=configuration.after)
    return measure_core(configuration.spec, target, verilog, tools, ports, range(1, seeds + 1))


def box_name(cell: str) -> str:
    """Return box that a cell of the core alone is in."""
    if cell.startswith("$"):
        return "packer"  # ends of carry chains, constants
    instances = split_name(cell)[:-1]
    below = instances[1:] if instances[:1] == ["datapath"] else instances
    return (below or instances or ["top"])[0]


def boxes(configuration: Configuration, target_name: str, verilog: str, tools: Mapping[str, str]) -> Table:
    """Return cells by box: the core packed as before, but synthesised without optimisation across boxes.

    Flattened, a cell bears the name of a net that may be another box's. The price is a total that differs somewhat.
    """
    target = TARGETS[target_name]
    commands = [
        synthesis("core.v", f"{target.synth} -noflatten -top {CORE}; flatten", "core"),
        [*target.route, "-q", "--json", "core.json", "--pack-only", "--write", "packed.json"],
    ]
    (packed,) = made({"core.v": verilog}, commands, ["packed.json"], tools)
    (module,) = packed["modules"].values()
    return boxes_table(f"{configuration.name} on {target_name}, by box", module["cells"], target.cells)


def boxes_table(title: str, cells: Mapping[str, Mapping[str, Any]], counted: Mapping[str, str]) -> Table:
    """Return packed cells by box, the largest box first."""
    found = Counter((box_name(name), cell["type"]) for name, cell in cells.items())
    names = {box for box, kind in found if kind in counted.values()}
    rows = sorted(([found[box, kind] for kind in counted.values()], box) for box in names)[::-1]
    total = [sum(column) for column in zip(*(row for row, _ in rows), strict=True)]
    return Table(title, ["box", *counted], [[box, *map(str, row)] for row, box in [*rows, (total, "total")]])


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
    described = {configuration.name: configuration.what for configuration in CONFIGURATIONS}
    rows = [
        [name, described[name], *(text_of(figure, found) for figure in figures), found.limit]
        for (name, target), found in results.items()
        if target == target_name
    ]
    header = ["configuration", "what", *map(heading, figures), "what limits Fmax"]
    return Table(f"{target_name} ({TARGETS[target_name].device})", header, rows)


def cost_table(results: Results) -> Table:
    """Return what each option costs: differences from the reference."""
    base = CONFIGURATIONS[0].name
    rows = [
        [option.name, option.what]
        + [
            f"{results[option.name, target].figures[figure] - results[base, target].figures[figure]:+d}"
            for target, figure in COSTS
        ]
        for option in CONFIGURATIONS
        if option.is_option and all((option.name, target) in results for target, _ in COSTS)
    ]
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

    def difference(name: str, without: str, target: str, figure: str) -> str:
        if (name, target) not in results or (without, target) not in results:
            return ""
        figures, base = results[name, target].figures, results[without, target].figures
        digits = 1 if figure == "Fmax" else 0
        return f"{figures[figure] - base[figure]:+.{digits}f}" if {figure} <= figures.keys() & base.keys() else ""

    rows = []
    for configuration in CONFIGURATIONS:
        if without := configuration.without_max_speed:
            row = [difference(configuration.name, without, *where) for where in shown]
            rows += [[configuration.name, without, *row]] if any(row) else []
    header = ["configuration", "without", *(f"{target} {heading(figure)}" for target, figure in shown)]
    return Table("What --max-speed 1000rad/s changes: difference from the core without", header, rows, SPEED_TEXT)


def is_met(figure: str, bar: float, found: Measurement) -> bool:
    """Tell whether a figure is what it should be: Fmax at least the bar, all others at most."""
    value = found.figures[figure]
    return value >= bar if figure == "Fmax" else value <= bar


def bar_table(results: Results) -> Table:
    """Return the bars of each configuration, and which of them are missed."""
    rows, missed = [], set()
    for configuration in CONFIGURATIONS:
        for target, bars in configuration.bars.items():
            found = results.get((configuration.name, target))
            if found is None or not (judged := {name: bar for name, bar in bars.items() if name in found.figures}):
                continue
            texts = [f"{name} {'≥' if name == 'Fmax' else '≤'} {bar}" for name, bar in judged.items()]
            wrong = [name for name, bar in judged.items() if not is_met(name, bar, found)]
            missed |= {configuration.name} if wrong else set()
            rows.append([configuration.name, target, ", ".join(texts), ", ".join(wrong)])
    below = "\n".join(f"- `{name}`: {why}" for name, why in MISSED.items() if name in missed)
    return Table("Bars", ["configuration", "target", "bars", "missed"], rows, below)


def tables(results: Results) -> list[Table]:
    """Return all tables of measured figures that are not empty."""
    made = [*(target_table(target, results) for target in TARGETS), bar_table(results), speed_table(results)]
    if CONFIGURATIONS[0].name in {name for name, _ in results}:
        made.append(cost_table(results))
    return [table for table in made if table.rows]


def used(tools: Mapping[str, str]) -> str:
    """Return the tools as the page names them."""
    return ", ".join(f"{package} {version}" for package, version in tools.items())


def page(measured: Sequence[Table], tools: Mapping[str, str]) -> str:
    """Return the page docs/measured/size.md."""
    return PAGE_HEAD.format(used=used(tools)) + "\n".join(
        table.markdown() for table in [*measured, PEERS, PEER_SOURCES]
    )


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
    names = [configuration.name for configuration in CONFIGURATIONS]
    parser.add_argument("--only", nargs="+", choices=names, metavar="NAME", help=f"some of: {', '.join(names)}")
    parser.add_argument("--update", action="store_true", help="write the page, where what is not measured stays")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), metavar="N", help="targets at a time (%(default)s)")
    parser.add_argument(
        "--seeds", type=int, default=len(SEEDS), metavar="N", help="routings whose median Fmax is (%(default)s)"
    )
    parser.add_argument("--targets", nargs="+", choices=TARGETS, default=tuple(TARGETS), help="FPGAs (all)")
    parser.add_argument("--boxes", action="store_true", help="also print the area of each box")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="page (that of docs/measured; of a part: none)"
    )
    options = parser.parse_args(words)
    if options.jobs < 1:
        parser.error(f"--jobs must be at least 1, not {options.jobs}")
    if options.seeds < 1:
        parser.error(f"--seeds must be at least 1, not {options.seeds}")
    everything = (options.only, options.seeds, options.targets) == (None, len(SEEDS), tuple(TARGETS))
    if options.update and options.seeds != len(SEEDS):
        parser.error("--update does not take --seeds: rows of a page are measured alike")
    if options.output is None and (everything or options.update):
        options.output = PAGE
    return options


def run(options: argparse.Namespace) -> int:
    """Measure, print, and write the page; 1 if a bar is missed."""
    tools = versions()
    chosen = [found for found in CONFIGURATIONS if options.only is None or found.name in options.only]
    work = [
        (found, target, found.hardware[0], tools)
        for found in chosen
        for target in found.targets
        if target in options.targets
    ]
    asked = [
        (*item, options.seeds if (options.only and not options.update) or item[0].has_speed_bar else 0) for item in work
    ]
    with ThreadPoolExecutor(options.jobs) as pool:
        done = list(with_progress(pool.map(lambda item: measure(*item), asked), len(work)))
        split = list(with_progress(pool.map(lambda item: boxes(*item), work), len(work))) if options.boxes else []
    results = {(found.name, target): result for (found, target, *_), result in zip(work, done, strict=True)}
    for table in [*tables(results), *split]:
        print(table.markdown())
    if options.update:
        names = {found.name for found in chosen}  # on targets that are left out, they are not those of today
        before = kept(PAGE.read_text(encoding="utf-8"), tools)
        results |= {place: found for place, found in before.items() if place[0] not in names}
        order = [(found.name, target) for found in CONFIGURATIONS for target in found.targets]
        results = {place: results[place] for place in order if place in results}
    measured = tables(results)
    if options.output:
        write(options.output, page(measured, tools))
        stamp(options.output, *(found.name for found in chosen))
        if options.output == PAGE:
            counted = {name: results[row, "ECP5"].figures["COMB"] for name, row in METHOD_CELLS.items()}
            CELLS.write_text(json.dumps(counted, indent=2) + "\n", encoding="utf-8")
        print(f"written: {options.output}")
    return int(any(row[-1] for row in bar_table(results).rows))


def with_progress(items: Iterable[Item], total: int) -> Iterable[Item]:
    """Return the items, with a bar on stderr if that is a terminal."""
    console = Console(stderr=True)
    return track(items, "measuring", total, console=console, transient=True, disable=not console.is_terminal)


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    try:
        return run(arguments(words))
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
