"""Modules as Verilog-2001."""

import os
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from amaranth.back import verilog
from amaranth.back.verilog import YosysError
from amaranth.lib import wiring

from tachometry.hdl.export.render import render
from tachometry.spec.language.tools import complaint

# Yosys wakes `always @*` by giving a register its value; SystemVerilog does that too early where it is declared.
_WAKE = re.compile(r"^(  reg) (\\\$auto\$\S+)  = 0;$", re.MULTILINE)

# Amaranth's name for what it leads through the boundary of a box; viewers of waveforms show it as it stands.
_LED = re.compile(r"\\port\$(\d+)\$(\d+) ")


@contextmanager
def bundled_yosys() -> Iterator[None]:
    """Have Amaranth take the Yosys that is a package, whatever else is installed.

    It raises OSError if it fails, with the line that says why.
    """
    yosys = "javascript" if sys.platform == "emscripten" else "builtin"  # a browser runs no process
    with patch.dict(os.environ, AMARANTH_USE_YOSYS=yosys):
        try:
            yield
        except YosysError as error:
            raise OSError(f"Yosys: {complaint(str(error)) or 'it fails'}") from error


def verilog_of(top: wiring.Component, described: Mapping[str, Any]) -> str:
    """Return the text of a module; its manifest says its name, and what is said above it."""
    name = described["module"]
    with bundled_yosys():
        text = verilog.convert(top, name=name, emit_src=False)
    text = _LED.sub(r"port_\1_\2 ", _WAKE.sub(r"\1 \2 ;\n  initial \2 = 0;", text))
    return render("NAME.v", **described, name=name, verilog=text.removesuffix("\n"))
