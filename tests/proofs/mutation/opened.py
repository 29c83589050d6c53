"""The netlist of a group of mutants, cut at its flip-flops and at its large memories."""

import json
import re
from collections import defaultdict
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from proofs.mutation.netlist import Mutant, power_up, selected, yosys

_MAP = """\
read_rtlil flat.il
{mutants}
memory -nomap
memory_nordff
memory_map t:$mem_v2 r:SIZE>{small} {large} %i %d
dffunmap
opt_clean
write_rtlil mapped.il
write_json mapped.json
"""
_SMALL = 31  # words of the largest memory that is taken apart if it is written


def _found(pattern: str, text: str) -> str:
    match = re.search(pattern, text)
    assert match is not None
    return match[1]


@dataclass(frozen=True)
class Register:
    """A flip-flop; `init` has a character for each bit, the highest first, x where it is not known."""

    width: int
    init: str
    names: frozenset[str]


@dataclass(frozen=True)
class Memory:
    """A memory that is cut out, its first words, how many are read at a time, and whether it is written."""

    width: int
    address_width: int
    words: list[int]
    reads: int
    written: bool


@dataclass(frozen=True)
class Opened:
    """A netlist in RTLIL, cut at its flip-flops: register k comes in as `q_k` and goes out as `d_k`.

    Memory k is asked for `address_k` and answers `word_k`, which has all that are read; `data_k` goes to `place_k`, as
    far as `mask_k` is 1.
    """

    text: str
    registers: list[Register]
    memories: list[Memory]


def _known(mapped: dict[str, Any]) -> dict[str, tuple[str, frozenset[str]]]:
    """Return initial value and names of each register, by its cell."""
    (module,) = mapped["modules"].values()
    bits = power_up(module)
    names: dict[tuple[Any, ...], set[str]] = defaultdict(set)
    for name, net in module["netnames"].items():
        names[tuple(net["bits"])].add(re.sub(r"\$\d+", "", name))
    known = {}
    for name, cell in module["cells"].items():
        if cell["type"] == "$dff":
            q = cell["connections"]["Q"]
            known[name] = "".join(bits.get(bit, "x") for bit in reversed(q)), frozenset(names[tuple(q)])
    return known


def opened(flat: str, group: list[Mutant], folder: Path, large: str = "r:WR_PORTS>0") -> Opened:
    """Return the netlist of a group of mutants without its flip-flops, and without large memories of this kind; other
    memories are taken apart.
    """
    script = partial(_MAP.format, small=_SMALL, large=large)
    (folder / "flat.il").write_text(flat)
    # What drives a register's net instead of it has lost the initial value.
    yosys(script(mutants=""), folder)
    known = _known(json.loads((folder / "mapped.json").read_text()))
    unset = "setattr -unset init w:*"
    yosys(script(mutants="\n".join([*selected(group), unset])), folder)
    text = (folder / "mapped.il").read_text()
    registers: list[Register] = []
    wires: list[str] = []
    connections: list[str] = []

    def cut(cell: re.Match[str]) -> str:
        d, q, width = (_found(pattern, cell[2]) for pattern in (r"\\D (.*)", r"\\Q (.*)", r"\\WIDTH (\d+)"))
        k = len(registers)
        registers.append(Register(int(width), *known.get(cell[1].removeprefix("\\"), ("x" * int(width), frozenset()))))
        wires.append(
            f"  wire width {width} input {1000 + 2 * k} \\q_{k}\n  wire width {width} output {1001 + 2 * k} \\d_{k}\n"
        )
        connections.append(f"  connect {q} \\q_{k}\n  connect \\d_{k} {d}\n")
        return ""

    memories: list[Memory] = []

    def apart(cell: re.Match[str]) -> str:
        width, depth, bits = (int(_found(rf"\\{name} (\d+)", cell[2])) for name in ("WIDTH", "SIZE", "ABITS"))
        reads, writes = (int(_found(rf"{name}_PORTS (\d+)", cell[2])) for name in ("RD", "WR"))
        assert writes < 2
        init = _found(r"\\INIT \d+'([01]+)", cell[2])
        k = len(memories)
        words = [int(init[last - width : last], 2) for last in range(len(init), 0, -width)]
        memories.append(Memory(width, bits, words, reads, bool(writes)))
        assert len(words) == depth
        ports = {
            "word": ("RD_DATA", reads * width),
            "address": ("RD_ADDR", reads * bits),
            **({"place": ("WR_ADDR", bits), "mask": ("WR_EN", width), "data": ("WR_DATA", width)} if writes else {}),
        }
        for number, (name, (port, size)) in enumerate(ports.items()):
            way = "input" if name == "word" else "output"
            wires.append(f"  wire width {size} {way} {10_000 + 5 * k + number} \\{name}_{k}\n")
            inside = _found(rf"\\{port} (.*)", cell[2])
            connections.append(
                f"  connect {inside} \\word_{k}\n" if way == "input" else f"  connect \\{name}_{k} {inside}\n"
            )
        return ""

    text = re.sub(r"^  cell \$dff (\S+)\n(.*?)^  end\n", cut, text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"^  cell \$mem_v2 (\S+)\n(.*?)^  end\n", apart, text, flags=re.DOTALL | re.MULTILINE)
    head, body = re.split(r"(?<=^module \\top\n)", text, maxsplit=1, flags=re.MULTILINE)
    body, tail = body.rsplit("end\n", 1)
    return Opened(head + "".join(wires) + body + "".join(connections) + "end\n" + tail, registers, memories)


def written(k: int, memory: Memory, links: dict[str, list[str]], equal: list[str]) -> list[str]:
    """Return links of memory k with core and mutant, which must write the same, and read the same where the addresses
    are.
    """
    lines, all_written = [], []
    for side, link in links.items():
        lines.append(f"wire [{memory.width - 1}:0] {side}_mask_{k}, {side}_data_{k};")
        lines.append(f"wire [{memory.address_width - 1}:0] {side}_address_{k}, {side}_place_{k};")
        link += [f".{name}_{k}({side}_{name}_{k})" for name in ("address", "place", "mask", "data")]
        place = f"|{side}_mask_{k} ? {side}_place_{k} : {memory.address_width}'d0"
        all_written.append(f"{{{side}_mask_{k}, {side}_mask_{k} & {side}_data_{k}, {place}}}")
    links["core"].append(f".word_{k}(any_{k})")
    links["mutant"].append(f".word_{k}(core_address_{k} == mutant_address_{k} ? any_{k} : other_{k})")
    equal.append(" == ".join(all_written))
    return lines
