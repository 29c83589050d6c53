"""The textbook circuit of docs/measured/size.md, bench/peers/mt_serial_divider.v, in Icarus: velocities and clocks."""

import random
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest
from support.nightly import nightly, only

CIRCUIT = Path(__file__).parents[2] / "bench" / "peers" / "mt_serial_divider.v"
WINDOW, STANDSTILL, ONE = 960, 500, 1 << 16
COUNTED = 3  # clocks from an edge to the clock from which it is counted
LATENCY = 39
BENCH = """\
module bench;
  reg clk = 0, rst = 1, a = 0, b = 0;
  wire signed [26:0] velocity;
  wire velocity_valid;
  integer file, gap, way, now = -10;
  reg [1:0] quarter = 0;
  mt_serial_divider core(clk, rst, a, b, velocity, velocity_valid);
  always @(posedge clk) if (!rst & velocity_valid) $display("%0d %0d", now, velocity);
  task clocks(input integer n);
    repeat (n) begin
      #5 clk = 1;
      #5 clk = 0;
      now = now + 1;
      rst = now < 0;
    end
  endtask
  initial begin
    file = $fopen("edges", "r");
    while ($fscanf(file, "%d %d", gap, way) == 2) begin
      clocks(gap);
      quarter = quarter + way;
      a = quarter[1] ^ quarter[0];
      b = quarter[1];
    end
    $finish;
  end
endmodule
"""


def simulated(folder: Path, edges: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Clock and value of each velocity, for gaps in clocks and ways (1, -1, or 0 for no edge)."""
    (folder / "edges").write_text("".join(f"{gap} {way}\n" for gap, way in [(10, 0), *edges]))
    (folder / "bench.v").write_text(BENCH)
    command = ["iverilog", "-g2001", "-Wall", "-s", "bench", "-o", "x.vvp", "bench.v", str(CIRCUIT)]
    built = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    assert built.stderr == ""
    done = subprocess.run(["vvp", "-n", "x.vvp"], cwd=folder, check=True, capture_output=True, text=True)
    return [(int(now), int(velocity)) for now, velocity in map(str.split, done.stdout.splitlines())]


def expected(edges: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the same by the method: edges over time between the last edges of two windows."""
    now, windows = COUNTED, dict[int, list[tuple[int, int]]]()
    for gap, way in edges:
        now += gap
        if way:
            windows.setdefault(now // WINDOW, []).append((now, way))
    given: list[tuple[int, int]] = []
    last, before = None, -1
    for window in range((now - COUNTED) // WINDOW):
        tick = (window + 1) * WINDOW - 1
        found = windows.get(window)
        if found:
            if last is not None:
                moved, took = sum(way for _, way in found), found[-1][0] - last
                velocity = abs(moved) * WINDOW * ONE // took
                given.append((tick + LATENCY, velocity if moved > 0 else -velocity))
            last, before = found[-1][0], window
        elif window - before >= STANDSTILL:
            last = None
            given.append((tick + 1, 0))
    return [one for one in given if one[0] < now - COUNTED]


# The circuit is for comparison only; a tenth of the motion has each scale both ways.
@pytest.mark.parametrize("parts", only([15], [15, 150]))
def test_random_motion_as_the_method_says(parts: int, tmp_path: Path) -> None:
    seed = random.randrange(1 << 32)
    chance = random.Random(seed)
    edges = []
    for _ in range(parts):
        scale, way = chance.choice([2, 30, 400, 5000]), chance.choice([1, -1])
        edges += [(chance.randint(1, scale), way) for _ in range(chance.randint(1, 40))]
    assert simulated(tmp_path, edges) == expected(edges), f"seed {seed}"


@nightly  # half a million clocks
def test_standstill_is_zero_until_two_windows_have_edges(tmp_path: Path) -> None:
    edges = [(100, 1)] * 30 + [(499 * WINDOW, 1)] + [(502 * WINDOW, 1)] + [(3000, -1), (WINDOW, 0)]
    found = simulated(tmp_path, edges)
    assert found == expected(edges)
    held = [velocity for _, velocity in found]
    assert held[:3] == [WINDOW * ONE // 100] * 3
    assert held[3] == WINDOW * ONE // (499 * WINDOW)
    assert held[-2:] == [0, -(WINDOW * ONE // 3000)]
