"""A module for LiteX: the core with its registers on the Wishbone bus of a SoC."""

import re

from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.language.provenance import notice
from tachometry.spec.registers.map import RegisterMap

_MODULE = '''\
"""The tachometer @NAME@ for LiteX; @NAME@.v lies beside this file.

    from @NAME@_litex import Tachometer

    self.tachometer = Tachometer(platform, platform.request("encoder"))
    self.tachometer.add_to(self, "tachometer")

The SoC then has a region `tachometer` with the registers of @NAME@_registers.md, which @NAME@_driver.h reads.
"""
@NOTICE@

import os

from migen import C, Cat, ClockSignal, Instance, ResetSignal, Signal

from litex.gen import LiteXModule
from litex.soc.integration.soc import SoCRegion
from litex.soc.interconnect import wishbone

CLOCK_HZ = @CLOCK_HZ@
SIZE = @SIZE@  # of the region, in bytes
# Offsets of the registers in bytes.
REGISTERS = {
@REGISTERS@
}
# Lines of the encoder, and outputs for other gateware: the width, and whether it is signed.
PINS = [@PINS@]
OUTPUTS = {
@OUTPUTS@
}


class Tachometer(LiteXModule):
    """The core, its registers on `bus`.

    `pads` has the pins of PINS as attributes; without pads other gateware drives them as attributes of this module. The
    outputs of the core are attributes, too: `velocity`, `velocity_valid` … Registers capture the core in every clock in
    which `capture` is high.
    """

    def __init__(self, platform, pads=None):
        self.bus = wishbone.Interface(data_width=32, address_width=32, addressing="word")
        self.capture = Signal()
        pins = {pin: Signal(name=pin) for pin in PINS}
        outputs = {name: Signal(shape, name=name) for name, shape in OUTPUTS.items()}
        for name, signal in (pins | outputs).items():
            setattr(self, name, signal)
        for pin in PINS if pads is not None else []:
            self.comb += pins[pin].eq(getattr(pads, pin))
        self.specials += Instance(
            "@NAME@",
            i_clk=ClockSignal("sys"),
            i_rst=ResetSignal("sys"),
            i_capture=self.capture,
            i_wb_adr_i=Cat(C(0, 2), self.bus.adr[:@WORD_ADDRESS@]),
            i_wb_dat_i=self.bus.dat_w,
            o_wb_dat_o=self.bus.dat_r,
            i_wb_sel_i=self.bus.sel,
            i_wb_we_i=self.bus.we,
            i_wb_cyc_i=self.bus.cyc,
            i_wb_stb_i=self.bus.stb,
            o_wb_ack_o=self.bus.ack,
            o_wb_err_o=self.bus.err,
            **{f"i_{name}": signal for name, signal in pins.items()},
            **{f"o_{name}": signal for name, signal in outputs.items()},
        )
        platform.add_source(os.path.join(os.path.dirname(os.path.abspath(__file__)), "@NAME@.v"))

    def add_to(self, soc, name="tachometer", origin=None):
        """Put the registers on the bus of a SoC, as a region of this name."""
        if int(soc.sys_clk_freq) != CLOCK_HZ:
            raise ValueError(f"sys_clk_freq must be {CLOCK_HZ} Hz for @NAME@, not {int(soc.sys_clk_freq)} Hz")
        # A cache would show old values, and reading has an effect.
        soc.bus.add_slave(name, self.bus, SoCRegion(origin=origin, size=SIZE, cached=False))
'''


def litex_files(name: str) -> tuple[str, ...]:
    """Names of the files."""
    return (f"{name}_litex.py",)


def litex(spec: TachometerSpec, name: str, verilog: str) -> dict[str, str]:
    """The text of `NAME_litex.py` by its name.

    Parameters
    ----------
    spec : TachometerSpec
    name : str
        Of the Verilog module.
    verilog : str
        The core, which the module reads from the file beside it.
    """
    registers = RegisterMap(spec)
    (file,) = litex_files(name)
    parts: dict[str, object] = {
        "NAME": name,
        "NOTICE": notice("#").rstrip("\n"),
        "CLOCK_HZ": spec.timing.clock_hz,
        "SIZE": 1 << registers.address_width,
        "REGISTERS": "\n".join(f'    "{one.name.lower()}": 0x{one.offset:02x},' for one in registers),
        "PINS": ", ".join(f'"{pin.name}"' for pin in spec.pins),
        "OUTPUTS": "\n".join(f'    "{port.name}": ({port.width}, {port.signed}),' for port in spec.outputs),
        "WORD_ADDRESS": registers.address_width - 2,
    }
    return {file: re.sub("@([A-Z_]+)@", lambda mark: str(parts[mark[1]]), _MODULE)}
