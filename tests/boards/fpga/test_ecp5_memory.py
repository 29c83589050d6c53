"""Registers behind block RAMs, in netlists as Yosys writes them."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from tachometry.boards.fpga.boards import BOARDS
from tachometry.boards.fpga.ecp5_memory import main, use_output_registers

PLAIN = {"CEMUX": "1 ", "CLKMUX": "CLK", "GSR": "DISABLED", "LSRMUX": "LSR", "REGSET": "RESET"}


def cell(kind: str, ways: dict[str, str], inputs: dict[str, Any], outputs: dict[str, Any]) -> dict[str, Any]:
    directions = dict.fromkeys(inputs, "input") | dict.fromkeys(outputs, "output")
    wires = {name: [bit] for name, bit in (inputs | outputs).items()}
    return {"type": kind, "parameters": ways, "port_directions": directions, "connections": wires}


def register(data: int, out: int, **other: str) -> dict[str, Any]:
    return cell("TRELLIS_FF", dict(PLAIN), {"CLK": 2, "DI": data, "LSR": "0"} | other, {"Q": out})


def netlist() -> dict[str, Any]:
    """Return a block RAM of which three bits are read, their registers, and a gate behind these."""
    ways = {"REGMODE_A": "NOREG", "REGMODE_B": "NOREG"}
    memory = cell(
        "DP16KD",
        ways,
        {"CLKA": "0", "CLKB": 2, "OCEA": "0", "OCEB": "1", "ADB0": 3},
        {"DOA0": 10, "DOA1": 11, "DOB0": 12, "DOB1": 13},
    )
    cells = {"memory": memory} | {f"register{k}": register(10 + k, 20 + k) for k in range(3)}
    cells["gate"] = cell("LUT4", {}, {"A": 20, "B": 21, "C": 22}, {"Z": 30})
    ports = {"clk": {"direction": "input", "bits": [2]}, "out": {"direction": "output", "bits": [30]}}
    return {"modules": {"top": {"ports": ports, "cells": cells}}}


def test_registers_move_into_the_block_ram() -> None:
    found = netlist()
    assert use_output_registers(found) == 3
    cells = found["modules"]["top"]["cells"]
    assert [*cells] == ["memory", "gate"]
    memory = cells["memory"]
    assert memory["parameters"] == {"REGMODE_A": "OUTREG", "REGMODE_B": "OUTREG"}
    assert {name: memory["connections"][name] for name in ("DOA0", "DOA1", "DOB0", "DOB1", "OCEA", "OCEB")} == {
        "DOA0": [20],
        "DOA1": [21],
        "DOB0": [22],
        "DOB1": [13],
        "OCEA": ["1"],
        "OCEB": ["1"],
    }
    assert cells["gate"] == netlist()["modules"]["top"]["cells"]["gate"]
    # It has them now.
    assert use_output_registers(found) == 0


OTHERS = {
    "enabled": lambda cells, ports: cells["register1"]["parameters"].update(CEMUX="CE"),
    "reset": lambda cells, ports: cells["register1"]["connections"].update(LSR=[5]),
    "set at first": lambda cells, ports: cells["register1"]["parameters"].update(REGSET="SET"),
    "another clock": lambda cells, ports: cells["register1"]["connections"].update(CLK=[6]),
    "the other edge": lambda cells, ports: cells["register1"]["parameters"].update(CLKMUX="INV"),
    "read elsewhere": lambda cells, ports: cells["gate"]["connections"].update(D=[11]),
    "a port": lambda cells, ports: ports["out"]["bits"].append(11),
    "no register": lambda cells, ports: cells["register1"].update(type="LUT4"),
    "an enable": lambda cells, ports: cells["register1"].update(
        cell("TRELLIS_FF", dict(PLAIN), {"CLK": 2, "DI": 7, "CE": 11}, {"Q": 21})
    ),
    "it has registers": lambda cells, ports: cells["memory"]["parameters"].update(REGMODE_B="OUTREG"),
    "two clocks": lambda cells, ports: cells["memory"]["connections"].update(CLKA=[6]),
}


@pytest.mark.parametrize("name", OTHERS)
def test_what_is_no_output_register_stays(name: str) -> None:
    found = netlist()
    top = found["modules"]["top"]
    top["cells"]["gate"]["port_directions"]["D"] = "input"
    OTHERS[name](top["cells"], top["ports"])
    before = deepcopy(found)
    assert use_output_registers(found) == 0
    assert found == before


def test_boards_of_ecp5_use_it() -> None:
    using = {name for name, board in BOARDS.items() if board.flow and board.flow.netlist is use_output_registers}
    assert using == {name for name in BOARDS if name.startswith("ulx3s")}


def test_the_script(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "top.json"
    file.write_text(json.dumps(netlist()))
    assert main([str(file)]) == 0
    assert capsys.readouterr().out == "3 flip-flops are output registers of block RAMs now\n"
    changed = netlist()
    use_output_registers(changed)
    assert json.loads(file.read_text()) == changed
    assert [path.name for path in tmp_path.iterdir()] == ["top.json"]


@pytest.mark.parametrize("text", [None, "{", "{}", "[]", '{"modules": {"top": {}}}'])
def test_the_script_refuses_what_is_no_netlist(
    text: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "top.json"
    if text is not None:
        file.write_text(text)
    assert main([str(file)]) == 2
    (told,) = capsys.readouterr().err.splitlines()
    assert told.startswith(f"ecp5_memory.py: error: {file} cannot be changed: ")
    assert [path.read_text() for path in tmp_path.iterdir()] == ([] if text is None else [text])
