"""Verilog, manifest and FuseSoC core file."""

import importlib.metadata
import json
import os
from unittest.mock import patch

from amaranth.back import verilog

from tachometry.hdl.tachometer import Tachometer
from tachometry.spec import TachometerSpec
from tachometry.spec.manifest import manifest

_HEADER = """\
// {name}: {method}-method tachometer, x{decoding} decoding, {counts_per_rev} counts per revolution,
// {tick_cycles} clocks of {clock_hz} Hz per tick, at most {max_ticks} ticks per measurement.
// Ports, widths, units and latencies: {name}.json
// Made by {generator}.
/* verilator lint_off DECLFILENAME */
/* verilator lint_off PROCASSINIT */
/* verilator lint_off UNUSEDSIGNAL */
/* verilator lint_off WIDTHEXPAND */
/* verilator lint_off WIDTHTRUNC */
"""

_CORE = """\
CAPI=2:
name: ::{name}:{version}
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
    installed. All three texts name the version of tachometry that made them.

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
    version = importlib.metadata.version("tachometry")
    described = {"generator": f"tachometry {version}", **manifest(spec, name)}
    with patch.dict(os.environ, AMARANTH_USE_YOSYS="builtin"):
        text = verilog.convert(Tachometer(spec), name=name, emit_src=False)
    return {
        f"{name}.v": _HEADER.format(**described, name=name) + text,
        f"{name}.json": json.dumps(described, indent=2) + "\n",
        f"{name}.core": _CORE.format(name=name, version=version, method=spec.method),
    }
