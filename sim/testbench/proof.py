"""Two texts of a core are proven to be the same circuit: registers and memories are paired, and what is between them.

From equal states, the next value of each register, each address, word and enable of each memory, and each output are
equal, by SAT. What SAT does not see is compared: initial values, contents of memories, clocks and their edges.
"""

import json
import subprocess
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tachometry.sim.signals.temporary import run_tool, scratch
from tachometry.spec.language.tools import complaint

LONGEST = 300.0  # seconds
_READ = """
read_verilog {side}.v
hierarchy -top {name}
proc -norom
flatten
opt_expr
opt_clean
memory_collect
opt_clean
write_json {side}.json
design -reset
"""
_PROVE = """
read_json gold.json
read_json gate.json
equiv_make gold gate both
hierarchy -top both
opt -full
equiv_struct
equiv_simple -short
equiv_simple
tee -q -o status equiv_status
equiv_status -assert
"""
_FRESH = 1 << 30  # nets beyond those of any core
_EQUAL = "SIZE WIDTH OFFSET INIT RD_PORTS WR_PORTS WR_CLK_POLARITY RD_CLK_ENABLE".split()  # settings of memories
_FREE = {"RD_CLK", "RD_EN", "RD_ARST", "RD_SRST", "RD_DATA", "WR_CLK"}  # pins of a memory that are not proven equal


@dataclass
class _Side:
    """One of the texts as Yosys reads it: a flat module of gates, registers and memories."""

    module: dict[str, Any]
    registers: dict[Any, tuple[Any, Any, str]] = field(default_factory=dict)  # by output: next, clock and edge, level
    memories: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        levels: dict[Any, str] = {}
        for net in self.module["netnames"].values():
            init = net["attributes"].get("init", "")[::-1]
            levels |= {bit: level for bit, level in zip(net["bits"], init, strict=False) if level != "x"}
        clocks = {port["bits"][0]: name for name, port in self.module["ports"].items()}
        for name, cell in [*self.module["cells"].items()]:
            pins, settings = cell["connections"], cell["parameters"]
            if cell["type"] == "$dff":
                clock = clocks.get(pins["CLK"][0]), int(settings["CLK_POLARITY"], 2)
                for output, following in zip(pins["Q"], pins["D"], strict=True):
                    self.registers[output] = following, clock, levels.get(output, "x")
            elif cell["type"] == "$mem_v2":
                cell["clocks"] = [clocks.get(bit) for bit in pins["WR_CLK"]]
                self.memories[settings["MEMID"].removeprefix("\\")] = cell
            elif "ff" in cell["type"] or "latch" in cell["type"] or "mem" in cell["type"]:
                raise ValueError(f"the Verilog must have plain registers and memories: {cell['type']}")
            else:
                continue
            del self.module["cells"][name]

    def order_reads(self, memory: Mapping[str, Any], places: Mapping[Any, int]) -> None:
        """Order the read ports of a memory by the places of the registers that take what they read."""
        readers: dict[Any, list[Any]] = defaultdict(list)
        for cell in self.module["cells"].values():
            ways = cell["port_directions"]
            made = [bit for pin, bits in cell["connections"].items() if ways[pin] == "output" for bit in bits]
            for bit in {bit for pin, bits in cell["connections"].items() if ways[pin] == "input" for bit in bits}:
                readers[bit] += made
        takers: dict[Any, list[int]] = defaultdict(list)
        for output, (following, *_) in self.registers.items():
            takers[following].append(places.get(output, -1))

        def taken_by(bit: Any) -> list[int]:
            seen, todo = {bit}, [bit]
            for at in todo:
                new = dict.fromkeys(readers[at]).keys() - seen
                seen |= new
                todo += new
            return sorted({place for at in seen for place in takers[at]})

        pins, count = memory["connections"], int(memory["parameters"]["RD_PORTS"], 2)
        parts = {pin: _split(pins[pin], count) for pin in ("RD_DATA", "RD_ADDR")}
        order = sorted(range(count), key=lambda port: taken_by(parts["RD_DATA"][port][0]))
        for pin, each in parts.items():
            pins[pin] = [bit for port in order for bit in each[port]]

    def bits(self, name: str) -> list[Any]:
        """Return the nets of a name; none if there is no such name."""
        return self.module["netnames"].get(name, {"bits": []})["bits"]


def differences(gold: str, gate: str, name: str, names: Mapping[str, str], yosys: str) -> list[str]:
    """Return how the Verilog `gate` differs from `gold`; nothing if it is proven to be the same circuit.

    `names` has paths of registers, wires and memories in `gate` by those in `gold`; it is empty if they are the same.
    """
    with scratch() as folder:
        for side, text in (("gold", gold), ("gate", gate)):
            (folder / f"{side}.v").write_text(text, encoding="utf-8")
        if said := _run("".join(_READ.format(side=side, name=name) for side in ("gold", "gate")), folder, yosys):
            return [said]
        sides = {
            side: _Side(json.loads((folder / f"{side}.json").read_text())["modules"][name]) for side in ("gold", "gate")
        }
        same = {path: path for path in (*sides["gate"].module["netnames"], *sides["gate"].memories)}
        if found := [*_paired(sides["gold"], sides["gate"], names or same)]:
            return found
        for side, made in sides.items():
            whole = {"creator": "tachometry", "modules": {side: made.module}}
            (folder / f"{side}.json").write_text(json.dumps(whole))
        said = _run(_PROVE, folder, yosys)
        status = (folder / "status").read_text() if (folder / "status").exists() else ""
        return [line.strip() for line in status.splitlines() if "Unproven" in line] or [said] if said else []


def _run(script: str, folder: Path, yosys: str) -> str:
    """Run Yosys; return its complaint, or ""."""
    (folder / "script.ys").write_text(script, encoding="utf-8")
    try:
        done = run_tool([yosys, "-q", "script.ys"], folder, seconds=LONGEST)
    except subprocess.TimeoutExpired:
        return f"Yosys found no proof in {LONGEST:.0f} s"
    return "" if done.returncode == 0 else complaint(done.stdout + done.stderr) or "Yosys fails"


def _paired(gold: _Side, gate: _Side, names: Mapping[str, str]) -> Iterator[str]:
    """Make gates of both sides with the same ports; yield what is different of registers and memories."""
    # A memory of one word is a register to Yosys.
    both = [(gold.bits(old + at), gate.bits(new + at)) for old, new in names.items() for at in ("", "[0]")]
    pairs: dict[Any, Any] = {}  # bits of registers of `gate` with those of `gold`
    for olds, news in both:
        pairs |= {
            new: old
            for old, new in zip(olds, news, strict=False)
            if new in gate.registers and old in gold.registers and new not in pairs
        }
    for bit in gate.registers.keys() - pairs.keys():
        yield f"{_name(gate, bit)} is no register of the core"
    for new, old in pairs.items():
        _, *wanted = gold.registers[old]
        _, *mine = gate.registers[new]
        for what, one, other in zip(("clock", "initial value"), mine, wanted, strict=True):
            if one != other:
                yield f"{_name(gate, new)} has the {what} {one}, not {other}"
    ports = [(gold, [*pairs.values()]), (gate, [*pairs])]
    for side, bits in ports:
        for memory in side.memories.values():
            side.order_reads(memory, {bit: place for place, bit in enumerate(bits)})
    yield from _memories(gold, gate, names)
    for side, bits in ports:
        _add(side, "state", "input", bits)
        _add(side, "following", "output", [side.registers[bit][0] for bit in bits])
    paired = set(pairs.values())
    rest = [bit for bit in gold.registers if bit not in paired]  # nothing reads them in `gate`
    rest += [bit for cell in gold.memories.values() for bit in cell["connections"]["RD_DATA"]]
    _add(gold, "rest", "input", rest)
    _add(gate, "rest", "input", range(_FRESH, _FRESH + len(rest)))
    hints = {f"hint:{old}": (gold.bits(old), gate.bits(new)) for old, new in names.items()}
    for place, side in enumerate((gold, gate)):
        side.module["netnames"] = {
            hint: {"hide_name": 0, "bits": bits[place], "attributes": {}}
            for hint, bits in hints.items()
            if bits[0] and len(bits[0]) == len(bits[1]) and not (set(bits[1]) & gate.registers.keys())
        }


def _memories(gold: _Side, gate: _Side, names: Mapping[str, str]) -> Iterator[str]:
    """Have pins of memories as ports; yield what is different of their words, sizes and clocks."""
    found = {new: old for old, new in names.items() if new in gate.memories and old in gold.memories}
    for name in gate.memories.keys() - found.keys():
        yield f"{name} is no memory of the core"
    for number, (new, old) in enumerate(found.items()):
        cells = gold.memories.pop(old), gate.memories[new]
        wanted, mine = ({key: cell["parameters"][key] for key in _EQUAL} | {"clocks": cell["clocks"]} for cell in cells)
        yield from (f"{new} has another {key}" for key in wanted if wanted[key] != mine[key])
        for side, cell in zip((gold, gate), cells, strict=True):
            for pin, bits in cell["connections"].items():
                if pin == "RD_DATA" or pin not in _FREE:
                    _add(side, f"memory{number}_{pin}", "input" if pin == "RD_DATA" else "output", bits)


def _split(bits: list[Any], count: int) -> list[list[Any]]:
    width = len(bits) // max(count, 1)
    return [bits[port * width : (port + 1) * width] for port in range(count)]


def _add(side: _Side, name: str, way: str, bits: Iterable[Any]) -> None:
    side.module["ports"][name] = {"direction": way, "bits": [*bits]}


def _name(side: _Side, bit: Any) -> str:
    return next(name for name, net in side.module["netnames"].items() if bit in net["bits"])
