"""Builds the SoC of an example with LiteX, as `soc.v`, with its CSRs in `csr.csv`; runs as a program, beside the core.

`python litex_soc.py CLASS` takes the class from `example.py`. The SoC gets a master on its bus, whose lines are pins.
"""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

sys.path.insert(0, ".")

import example
from litex.build.generic_platform import GenericPlatform, Pins, Subsignal
from litex.gen import LiteXModule
from litex.soc.integration.export import get_csr_csv
from litex.soc.interconnect import wishbone
from litex.tools.remote.csr_builder import CSRBuilder
from migen import ClockDomain

BUS = {"adr": 30, "dat_w": 32, "dat_r": 32, "sel": 4, "cyc": 1, "stb": 1, "ack": 1, "we": 1, "err": 1}
DRIVEN = ("adr", "dat_w", "sel", "cyc", "stb", "we")


def lines(**widths: int) -> list[Any]:
    return [Subsignal(name, Pins(width)) for name, width in widths.items()]


class Clock(LiteXModule):
    def __init__(self, platform: Any) -> None:
        self.cd_sys = ClockDomain()
        self.comb += [self.cd_sys.clk.eq(platform.request("clk")), self.cd_sys.rst.eq(platform.request("rst"))]


platform = GenericPlatform(
    "any",
    [
        ("clk", 0, Pins(1)),
        ("rst", 0, Pins(1)),
        ("bus", 0, *lines(**BUS)),
        ("encoder", 0, *lines(**dict.fromkeys(example.PINS, 1))),
    ],
)
soc = getattr(example, sys.argv[1])(platform)
soc.crg = Clock(platform)
pins, master = platform.request("bus"), wishbone.Interface()
soc.bus.add_master("pins", master)
for name in BUS:
    inside, outside = getattr(master, name), getattr(pins, name)
    soc.comb += inside.eq(outside) if name in DRIVEN else outside.eq(inside)
soc.finalize()
platform.get_verilog(soc, name="soc").write("soc.v")
Path("csr.csv").write_text(get_csr_csv(soc.csr_regions, soc.constants, soc.mem_regions))
print("sources", *(Path(file).name for file, *_ in platform.sources))
print("base", CSRBuilder(comm=SimpleNamespace(read=None, write=None), csr_csv="csr.csv").mems.tachometer.base)
