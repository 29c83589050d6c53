"""Verilog, manifest, and what lies beside them."""

import json
import os
import re
from collections.abc import Mapping
from typing import Any
from unittest.mock import patch

from amaranth.back import verilog
from amaranth.lib import wiring

from tachometry.hdl.core.bus_tachometer import BusTachometer
from tachometry.hdl.core.core import core_of
from tachometry.hdl.export.kit import kit
from tachometry.hdl.export.registers.files import register_files
from tachometry.hdl.export.targets.target import TARGETS, bus_for
from tachometry.spec import ParameterError, TachometerSpec
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.language.provenance import LICENSE, generator, notice
from tachometry.spec.registers.buses import Bus, bus_of, manifest_on
from tachometry.spec.registers.loop import registers_of
from tachometry.spec.registers.manifest import manifest

_HEADER = """\
// {name}: {method}-method tachometer, x{decoding} decoding, {counts_per_rev} counts per revolution,
// {tick_cycles} clocks of {clock_hz} Hz per tick, at most {max_ticks} ticks per measurement.
// Ports, widths, units and latencies: {name}.json
{notice}/* verilator lint_off DECLFILENAME */
/* verilator lint_off PROCASSINIT */
/* verilator lint_off UNUSEDSIGNAL */
/* verilator lint_off WIDTHEXPAND */
/* verilator lint_off WIDTHTRUNC */
"""

# Yosys wakes `always @*` by giving a register its value; SystemVerilog does that too early where it is declared.
_WAKE = re.compile(r"^(  reg) (\\\$auto\$\S+)  = 0;$", re.MULTILINE)


def export(
    spec: AnySpec,
    name: str = "tachometer",
    bus: str | None = None,
    baud: int | None = None,
    target: str = "none",
) -> dict[str, str]:
    """The exported core as texts by file name: `NAME.v`, `NAME.json`, and those of `tachometry.hdl.export.kit`.

    With a bus also those of `tachometry.hdl.export.registers.files`, which describe its registers; with a target also
    those of `tachometry.hdl.export.targets`.

    Equal specs and names give equal texts on every machine: the bundled Yosys writes the Verilog, whatever else is
    installed. All texts name the version of tachometry that made them, and their licence.

    Parameters
    ----------
    spec : TachometerSpec, AxesSpec or LoopSpec
    name : str
        Name of the module and of the files.
    bus : str or None
        The bus for its registers, one of `spec.registers.buses.BUSES`, or `none`; None: `none`, or what the target
        needs.
    baud : int or None
        Bits a second of a bus that has them; None: its default.
    target : str
        The framework into which it goes, one of `hdl.export.targets.target.TARGETS`, or `none`.

    Raises
    ------
    ValueError
        If `name` cannot be the name of a Verilog module; if there is no such bus, or the clock cannot make its bits; if
        the target needs another bus or another core; if a core of many axes is to have either.
    """
    bus = bus_for(target, bus)
    on = bus_of(bus, baud)
    if not isinstance(spec, TachometerSpec) and target in TARGETS:
        other, whom = ("loop", "a tachometer alone") if isinstance(spec, LoopSpec) else ("axes", "one axis")
        raise ParameterError("target", f"must not be given together with {other}: targets are for {whom}")
    files: dict[str, str] = {}
    top: wiring.Component
    if on is None:
        described = manifest(spec, name)
        top = core_of(spec)
    else:
        registers = registers_of(spec)
        described = manifest_on(registers, on, name)
        top = BusTachometer(registers, on)
        files = register_files(registers, name)
    texts = _files(spec, name, top, described, on, files)
    if target in TARGETS and isinstance(spec, TachometerSpec):
        texts |= TARGETS[target].texts(spec, name, texts[f"{name}.v"])
    return texts


def _files(
    spec: AnySpec, name: str, top: wiring.Component, described: dict[str, Any], on: Bus | None, more: dict[str, str]
) -> dict[str, str]:
    """The core, its manifest, and what lies beside them."""
    described = {"generator": generator(), "license": LICENSE, **described}
    return {
        f"{name}.v": verilog_of(top, described),
        f"{name}.json": json.dumps(described, indent=2) + "\n",
        **kit(spec, name, on),
        **more,
    }


def verilog_of(top: wiring.Component, described: Mapping[str, Any]) -> str:
    """A module as Verilog-2001; the manifest says its name, and what is said above it."""
    name = described["module"]
    with patch.dict(os.environ, AMARANTH_USE_YOSYS="builtin"):
        text = _WAKE.sub(r"\1 \2 ;\n  initial \2 = 0;", verilog.convert(top, name=name, emit_src=False))
    return _HEADER.format(**described, name=name, notice=notice("//")) + text
