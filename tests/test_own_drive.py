"""The drive of docs/guides/integration.md, as a user would: the command, one's own Verilog top, its simulation."""

import re
import subprocess
from pathlib import Path

import pytest
from support import docs
from support.command import run

from tachometry.sim.engines.verilator import verilate

PAGE = docs.page("guides/integration.md")
# 3,050 rpm forward, then 1,000 rpm backward: counts of 10,000 a revolution, and clocks of 10 ns, in a quarter period.
FORWARD, BACKWARD = 100e6 * 60 / (10_000 * 3050), 100e6 * 60 / (10_000 * 1000)

BENCH = f"""
module bench;
  reg clk = 0, rst = 1, a = 0, b = 0, pwm = 0;
  wire signed [17:0] rpm_x16;
  wire too_fast;
  reg [1:0] quarter = 0;
  integer k;
  drive dut (
    .clk(clk), .rst(rst), .encoder_a(a), .encoder_b(b), .pwm_sync(pwm), .rpm_x16(rpm_x16), .too_fast(too_fast)
  );
  always #5 clk = !clk;
  always begin #25000 pwm = 1; #25000 pwm = 0; end
  task turn(input integer forward);
    begin
      quarter = forward ? quarter + 1 : quarter - 1;
      a = quarter[1] ^ quarter[0];
      b = quarter[1];
    end
  endtask
  initial begin
    #100 rst = 0;
    for (k = 0; k < 250; k = k + 1) #{10 * FORWARD:.0f} turn(1);
    $display("forward %0d %0d", rpm_x16, too_fast);
    for (k = 0; k < 70; k = k + 1) #{10 * BACKWARD:.0f} turn(0);
    $display("backward %0d %0d", rpm_x16, too_fast);
    $finish;
  end
endmodule
"""


def test_a_core_for_a_drive_of_ones_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command = re.search(r"^tachometry (generate .*?)\n```", PAGE, re.MULTILINE | re.DOTALL)
    top = re.search(r"```verilog\n(.*?)```", PAGE, re.DOTALL)
    assert command is not None
    assert top is not None
    monkeypatch.chdir(tmp_path)
    assert run(*command[1].replace("\\\n", "").split()) == 0
    assert "rtl/speed.v" in capsys.readouterr().out
    Path("drive.v").write_text(top[1])
    Path("bench.v").write_text(BENCH)
    verilate(["--lint-only", "-Wall", "--top-module", "drive", "drive.v", "rtl/speed.v"], tmp_path)
    files = ["drive.v", "rtl/speed.v", "bench.v"]
    subprocess.run(["iverilog", "-s", "bench", "-o", "bench.vvp", *files], check=True)
    done = subprocess.run(["vvp", "-n", "bench.vvp"], check=True, capture_output=True, text=True)
    found = re.fullmatch(r"forward (-?\d+) (\d)\nbackward (-?\d+) (\d)\n", done.stdout)
    assert found is not None, done.stdout
    # Within the resolution of S near these speeds, which `plan` states.
    assert int(found[1]) / 16 == pytest.approx(3050, rel=0.01)
    assert int(found[3]) / 16 == pytest.approx(-1000, rel=0.02)
    assert (found[2], found[4]) == ("1", "0")
