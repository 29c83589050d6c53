"""Modules as Verilog-2001."""

import os
import re
from collections.abc import Mapping
from typing import Any
from unittest.mock import patch

from amaranth.back import verilog
from amaranth.lib import wiring

from tachometry.hdl.export.render import render

# Yosys wakes `always @*` by giving a register its value; SystemVerilog does that too early where it is declared.
_WAKE = re.compile(r"^(  reg) (\\\$auto\$\S+)  = 0;$", re.MULTILINE)


def verilog_of(top: wiring.Component, described: Mapping[str, Any]) -> str:
    """Return the text of a module; its manifest says its name, and what is said above it."""
    name = described["module"]
    with patch.dict(os.environ, AMARANTH_USE_YOSYS="builtin"):
        text = verilog.convert(top, name=name, emit_src=False)
    text = _WAKE.sub(r"\1 \2 ;\n  initial \2 = 0;", text)
    return render("NAME.v", **described, name=name, verilog=text.removesuffix("\n"))
