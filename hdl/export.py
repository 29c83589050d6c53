"""Verilog, manifest and FuseSoC core file."""

import json
import os
from unittest.mock import patch

from amaranth.back import rtlil, verilog

from tachometry.hdl.tachometer import Tachometer
from tachometry.spec import TachometerSpec
from tachometry.spec.manifest import manifest

_HEADER = """\
// {name}: {method}-method tachometer, x{decoding} decoding, {counts_per_rev} counts per revolution,
// {tick_cycles} clocks of {clock_hz} Hz per tick, at most {max_ticks} ticks per measurement.
// Ports, widths, units and latencies: {name}.json
/* verilator lint_off DECLFILENAME */
/* verilator lint_off PROCASSINIT */
/* verilator lint_off UNUSEDSIGNAL */
/* verilator lint_off WIDTHTRUNC */
"""

_CORE = """\
CAPI=2:
name: ::{name}:0
description: {method}-method tachometer for incremental encoders

filesets:
  rtl:
    files:
      - {name}.v
    file_type: verilogSource

targets:
  default:
    filesets: [rtl]
    toplevel: {name}
"""


def export(spec: TachometerSpec, name: str = "tachometer") -> dict[str, str]:
    """The exported core as texts by file name: `NAME.v`, `NAME.json`, `NAME.core`.

    Equal specs and names give equal texts on every machine: the bundled Yosys writes the Verilog, whatever else is
    installed.

    Parameters
    ----------
    spec : TachometerSpec
    name : str
        Name of the module and of the files.

    Raises
    ------
    ValueError
        If `name` cannot be the name of a Verilog module.
    """
    described = manifest(spec, name)
    core = Tachometer(spec)
    # Amaranth writes operands as narrow as it can, and Verilator warns of each that is narrower than its result.
    whole = patch.object(rtlil.ModuleEmitter, "shorten_operand", lambda emitter, value, *, signed: value)
    with whole, patch.dict(os.environ, AMARANTH_USE_YOSYS="builtin"):
        text = verilog.convert(core, name=name, emit_src=False)
    return {
        f"{name}.v": _HEADER.format(**described, name=name) + text,
        f"{name}.json": json.dumps(described, indent=2) + "\n",
        f"{name}.core": _CORE.format(name=name, method=spec.method),
    }
