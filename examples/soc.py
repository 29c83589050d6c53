"""Two encoders behind the Wishbone decoder of an Amaranth SoC: the registers of both are read in a simulation.

It needs amaranth-soc: pip install "amaranth-soc @ git+https://github.com/amaranth-lang/amaranth-soc@3e3d8b7"
"""

from typing import Any

from amaranth import Module
from amaranth.sim import Simulator
from amaranth_soc import wishbone

import tachometry as t
from tachometry.hdl import peripheral

spec = t.Tachometer(lines=500, clock="12MHz", tick="100us", max_speed="400rad/s", method="mt")
decoder = wishbone.Decoder(addr_width=12, data_width=32, granularity=8, features={"err"})
top = Module()
top.submodules.decoder = decoder
for at, name in ((0x100, "left"), (0x200, "right")):
    top.submodules[name] = encoder = peripheral(spec, "wishbone")
    decoder.add(encoder.bus, name=name, addr=at)


async def read_all(ctx: Any) -> None:
    """Read the register IDENTIFICATION of both, by the memory map of the decoder."""
    for resource in decoder.bus.memory_map.all_resources():
        if resource.path[-1] == ("identification",):
            ctx.set(decoder.bus.adr, resource.start >> 2)
            ctx.set(decoder.bus.cyc, 1)
            ctx.set(decoder.bus.stb, 1)
            (word,) = await ctx.tick().sample(decoder.bus.dat_r).until(decoder.bus.ack)
            ctx.set(decoder.bus.stb, 0)
            print(f"{resource.path[0][0]} at {resource.start:#x}: {word.to_bytes(4, 'big').decode()}")
            await ctx.tick()


simulator = Simulator(top)
simulator.add_clock(1 / spec.timing.clock_hz)
simulator.add_testbench(read_all)
simulator.run()
