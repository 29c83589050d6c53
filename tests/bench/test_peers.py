"""bench/peers.py: what it makes of other people's sources, and what it says of those that it cannot measure."""

from pathlib import Path
from typing import Any

import pytest
from support.nightly import nightly
from support.script import load

from tachometry.sim.studies.size import Measurement

pytestmark = nightly  # Yosys from PyPI compiles itself for a minute when it is first run on a machine
peers = load("peers")
COUNTER = """\
module counter #(parameter W = 8) (input clock, input up, output reg [W-1:0] count);
  always @(posedge clock) count <= up ? count + 1 : count - 1;
endmodule
"""
GHDL = """\
#!/bin/sh
[ "$1" = -a ] && exit
printf 'module chosen(input clk, input [1:0] at, output reg q);\\n  always @*\\n    case (at)\\n'
printf "      2'b10: q <= clk;\\n      2'b01: q <= 1'b0;\\n    endcase\\nendmodule\\n"
"""


@pytest.fixture
def counter(tmp_path: Path) -> str:
    file = tmp_path / "counter.v"
    file.write_text(COUNTER)
    return str(file)


def ghdl(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return a VHDL file, and a program that stands for GHDL; it writes a choice as GHDL 2.0 does."""
    program, file = tmp_path / "ghdl", tmp_path / "chosen.vhd"
    program.write_text(GHDL)
    program.chmod(0o755)
    file.write_text("entity chosen is end;")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    return str(file)


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Return what was to be measured: nextpnr is not needed."""
    asked: list[Any] = []

    def measure(*words: Any) -> Measurement:
        verilog, top, between, target, _, seeds, prepare = words
        asked.append((verilog, top, between, list(seeds), prepare, target))
        return Measurement({**dict.fromkeys(target.cells, 7), "Fmax": 99.5}, "a → b", (98.0, 101.0))

    monkeypatch.setattr(peers, "measure_verilog", measure)
    monkeypatch.setattr(peers, "versions", dict)
    return asked


def test_verilog_with_a_parameter(counter: str, measured: list[Any], capsys: pytest.CaptureFixture[str]) -> None:
    words = [counter, "--top", "counter", "--clock", "clock", "--set", "W=13", "--targets", "HX8K", "--seeds", "2"]
    assert peers.main(words) == 0
    assert "| counter | 7 | 7 | 99.5 (98–101) | a → b |" in capsys.readouterr().out
    ((verilog, top, between, seeds, prepare, _),) = measured
    assert (verilog, top, seeds, prepare) == (COUNTER, "counter", [1, 2], "chparam -set W 13 counter; ")
    assert "counter core(" in between
    for port in (".clock(clk)", ".up(feed[0 +: 1])", ".count(result[0 +: 13])"):
        assert port in between


def test_vhdl_has_no_latches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, measured: list[Any]) -> None:
    assert peers.main([ghdl(tmp_path, monkeypatch), "--top", "chosen", "--targets", "ECP5"]) == 0
    made = "always @* case (at) 2'b10: q <= clk; 2'b01: q <= 1'b0; default: q <= 'bx; endcase endmodule"
    assert " ".join(measured[0][0].split()).endswith(made)
