"""The peripheral of an Amaranth SoC: line by line the core on the same bus."""

import os
import random
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from amaranth import Module
from amaranth.sim import Simulator
from support.nightly import nightly

import tachometry as t
from tachometry.hdl import peripheral
from tachometry.hdl.core.bus_tachometer import BusTachometer
from tachometry.spec.language.option import ParameterError
from tachometry.spec.registers.buses import BUSES
from tachometry.spec.registers.map import RegisterMap

SPEC: Any = t.Tachometer(lines=500, clock="12MHz", tick="5us", max_speed="400rad/s", method="m", stream="axi:tick:2")
# By a member of the peripheral: the line of the core, as the tables of both standards have them.
WISHBONE = "adr=wb_adr_i dat_w=wb_dat_i dat_r=wb_dat_o sel=wb_sel_i we=wb_we_i cyc=wb_cyc_i stb=wb_stb_i ack=wb_ack_o "
LINES = {
    "wishbone": WISHBONE + "err=wb_err_o",
    "csr": "addr=reg_address r_stb=reg_read r_data=reg_read_data w_stb=reg_write w_data=reg_write_data",
    "axi-lite": " ".join(f"{line.name[6:]}={line.name}" for line in BUSES["axi-lite"].lines),
}


@pytest.mark.parametrize("bus", LINES)
def test_each_line_is_that_of_the_core(bus: str) -> None:
    """Random levels on all inputs of both, 300 clocks; an access of `csr` is a read or a write."""
    inner = BusTachometer(RegisterMap(SPEC, irq=True), BUSES["native" if bus == "csr" else bus])
    outer = peripheral(SPEC, bus, irq=True)
    pairs = [(getattr(outer.bus, a), getattr(inner, b)) for a, b in (one.split("=") for one in LINES[bus].split())]
    pairs += [(getattr(outer, name), getattr(inner, name)) for name in ("a", "b", "capture", "irq", "velocity", "tick")]
    records = outer.m_axis
    pairs += [(records.valid, inner.m_axis_tvalid), (records.ready, inner.m_axis_tready)]
    pairs += [(records.payload.data, inner.m_axis_tdata), (records.payload.last, inner.m_axis_tlast)]
    inputs = {name for name, member in inner.signature.members.items() if member.flow.name == "In"}
    chance = random.Random(1)
    seen: set[str] = set()

    async def compared(ctx: Any) -> None:
        for _ in range(300):
            for mine, theirs in pairs:
                if theirs.name in inputs:
                    level = chance.getrandbits(len(mine))
                    ctx.set(mine, level)
                    ctx.set(theirs, level << len(theirs) - len(mine))
            await ctx.tick()
            for mine, theirs in pairs:
                if theirs.name not in inputs:
                    assert ctx.get(mine) == ctx.get(theirs), theirs.name
                    seen.update({theirs.name} if ctx.get(theirs) else ())

    m = Module()
    m.submodules += [inner, outer]
    simulator = Simulator(m)
    simulator.add_clock(1e-6)
    simulator.add_testbench(compared)
    simulator.run()
    assert {theirs.name for _, theirs in pairs} - inputs - seen <= {"s_axi_bresp", "velocity"}


def test_another_bus_is_refused() -> None:
    with pytest.raises(ParameterError, match="must be wishbone, csr, axi-lite, not apb"):
        peripheral(SPEC, "apb")


@nightly  # amaranth-soc has no release, so it is got by its commit
def test_two_cores_behind_a_decoder(tmp_path: Path) -> None:
    example = Path(__file__).parents[3] / "examples" / "soc.py"
    (package,) = (line.split('"')[1] for line in example.read_text().splitlines() if "pip install" in line)
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", tmp_path, package], check=True
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, example], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "left at 0x100: TACH\nright at 0x200: TACH\n"
