"""Modules as Verilog-2001, and as netlists."""

import json
import os
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from amaranth.back import rtlil, verilog
from amaranth.back.verilog import YosysError
from amaranth.lib import wiring

from tachometry.hdl.export.modules import write
from tachometry.hdl.export.render import render
from tachometry.spec.language.port import Port
from tachometry.spec.language.tools import complaint

WRITERS = ("tachometry", "yosys")

# Yosys wakes `always @*` by giving a register its value; SystemVerilog does that too early where it is declared.
_WAKE = re.compile(r"^(  reg) (\\\$auto\$\S+)  = 0;$", re.MULTILINE)

# Passes of Yosys: what a synthesis does first, but for sums, which families make in their own way.
_GATES = """
hierarchy -auto-top
proc
flatten
opt
wreduce
opt -full
memory_collect
opt_mem
select -set kept t:$add t:$sub t:$neg t:$lt t:$le t:$ge t:$gt t:$mul t:$mem_v2
select -set rest * @kept %d
simplemap @rest
opt
opt_clean
write_json
"""

# Amaranth's name for what it leads through the boundary of a box; viewers of waveforms show it as it stands.
_LED = re.compile(r"\\port\$(\d+)\$(\d+) ")


@contextmanager
def bundled_yosys() -> Iterator[None]:
    """Have Amaranth take the Yosys that is a package, whatever else is installed.

    It raises OSError if it fails, with the line that says why.
    """
    yosys = "javascript" if sys.platform == "emscripten" else "builtin"  # a browser runs no process
    before = os.environ.get("AMARANTH_USE_YOSYS")
    os.environ["AMARANTH_USE_YOSYS"] = yosys
    try:
        yield
    except YosysError as error:
        raise OSError(f"Yosys: {complaint(str(error)) or 'it fails'}") from error
    finally:
        if before is None:
            del os.environ["AMARANTH_USE_YOSYS"]
        else:
            os.environ["AMARANTH_USE_YOSYS"] = before


def verilog_of(
    top: wiring.Component, described: Mapping[str, Any], ports: Iterable[Port] = (), writer: str = WRITERS[0]
) -> str:
    """Return the text of a module by one of `WRITERS`, with the head that its manifest, `described`, gives."""
    name = described["module"]
    text = yosys_text(top, name) if writer == "yosys" else write(top, name, ports).text
    return render("NAME.v", **described, name=name, writer=writer, verilog=text.removesuffix("\n"))


def yosys_text(top: wiring.Component, name: str) -> str:
    """Return the text of a module as Yosys writes it, with Amaranth's names."""
    with bundled_yosys():
        text = verilog.convert(top, name=name, emit_src=False)
    return _LED.sub(r"port_\1_\2 ", _WAKE.sub(r"\1 \2 ;\n  initial \2 = 0;", text))


def gates_script(top: wiring.Component) -> str:
    """Return what Yosys makes gates of a module by, see `netlist_of`."""
    return f"read_rtlil <<rtlil\n{rtlil.convert(top, name='top', emit_src=False)}\nrtlil{_GATES}"


def netlist_of(script: str) -> dict[str, Any]:
    """Return a module as JSON of Yosys, before it has cells of a family: gates and flip-flops, sums and memories."""
    with bundled_yosys():
        made = verilog.find_yosys(lambda version: True).run(["-q", "-"], script)
    module: dict[str, Any] = json.loads(made[made.index("{") :])["modules"]["top"]
    return module
