"""ECP5: flip-flops behind a block RAM become its output register.

Yosys maps a memory to a block RAM whose output comes straight from its cells, 5 to 6 ns after the clock, and a register
behind it to flip-flops. The block RAM has such a register itself, which is ready in 1 ns; vendors' tools use it.

As a script, `python ecp5_memory.py NETLIST` changes a netlist in its file, and says how many bits have moved.
"""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

_MEMORY, _FLIP_FLOP = "DP16KD", "TRELLIS_FF"
_WITHOUT, _WITH = "NOREG", "OUTREG"
_LOW = ("0", "x")


def use_output_registers(netlist: Mapping[str, Any]) -> int:
    """Move registers into the block RAMs of a netlist that `synth_ecp5` has written as JSON, and return how many bits.

    A block RAM takes its registers if each bit that is read goes to one flip-flop and nowhere else, of the clock of the
    port, without reset and always enabled.
    """
    moved = 0
    for module in netlist["modules"].values():
        readers: dict[int, list[tuple[str, str]]] = {}
        for port in module["ports"].values():
            for bit in port["bits"] if port["direction"] == "output" else ():
                readers.setdefault(bit, []).append(("", ""))
        for name, cell in module["cells"].items():
            for port_name, bits in cell["connections"].items():
                if cell["port_directions"][port_name] == "input":
                    for bit in bits:
                        readers.setdefault(bit, []).append((name, port_name))
        for memory in [cell for cell in module["cells"].values() if cell["type"] == _MEMORY]:
            taken = _registers(module["cells"], memory, readers)
            for port_name, name in taken.items():
                memory["connections"][port_name] = module["cells"].pop(name)["connections"]["Q"]
            if taken:
                for side in "AB":
                    memory["parameters"][f"REGMODE_{side}"] = _WITH
                    memory["connections"][f"OCE{side}"] = ["1"]
            moved += len(taken)
    return moved


def _registers(
    cells: Mapping[str, Any], memory: Mapping[str, Any], readers: Mapping[int, list[tuple[str, str]]]
) -> dict[str, str]:
    """Return the flip-flop behind each output of a block RAM; none if a single one cannot be moved."""
    if any(memory["parameters"].get(f"REGMODE_{side}", _WITHOUT) != _WITHOUT for side in "AB"):
        return {}
    clocks = [memory["connections"].get(f"CLK{side}", ["0"])[0] for side in "AB"]
    clocks = [clock for clock in clocks if clock not in _LOW]
    found = {}
    for port, bits in memory["connections"].items():
        if not port.startswith(("DOA", "DOB")) or not bits or bits[0] not in readers:
            continue
        (name, at), *others = readers[bits[0]]
        cell = cells.get(name)
        if others or cell is None or cell["type"] != _FLIP_FLOP or at not in ("DI", "M"):
            return {}
        wires, ways = cell["connections"], cell["parameters"]
        plain = wires.get("LSR", ["0"])[0] in _LOW and ways["CEMUX"].strip() == "1" and ways["CLKMUX"] == "CLK"
        if not plain or ways["REGSET"] != "RESET" or clocks != [wires["CLK"][0]] * len(clocks):
            return {}
        found[port] = name
    return found


def main(words: Sequence[str]) -> int:
    """Change a netlist in its file; 2 if it cannot be. It needs nothing else of tachometry: `make size` runs a copy."""
    parser = argparse.ArgumentParser(
        prog="ecp5_memory.py", description="Use the output registers of the block RAMs of a netlist for ECP5."
    )
    parser.add_argument("netlist", type=Path, metavar="NETLIST", help="JSON that synth_ecp5 has written; it is changed")
    path = parser.parse_args(words).netlist
    try:
        netlist = json.loads(path.read_text(encoding="utf-8"))
        moved = use_output_registers(netlist)
        beside = path.with_name(f"{path.name}.new")
        try:
            beside.write_text(json.dumps(netlist), encoding="utf-8")
            beside.replace(path)
        finally:
            beside.unlink(missing_ok=True)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        wrong = error.strerror if isinstance(error, OSError) else "it is no netlist that synth_ecp5 has written as JSON"
        print(f"ecp5_memory.py: error: {path} cannot be changed: {wrong}", file=sys.stderr)
        return 2
    print(f"{moved} flip-flops are output registers of block RAMs now")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
