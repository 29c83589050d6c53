"""The exported Verilog in simulators that share nothing with Amaranth's: Verilator and Icarus."""

import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from support.compiled import lint
from tachometry.hdl.export import export
from tachometry.sim.engines.compiled import Design
from tachometry.sim.engines.verilator import Verilator
from tachometry.sim.signals.axes import Trace
from tachometry.sim.signals.run import Run, observed
from tachometry.spec import Port
from tachometry.spec.control import AnySpec
from tachometry.spec.registers.buses import bus_of, ports_on

# The bench reads a line (clock, level of each pin) for every change, and writes a row (clock, value of each output) for
# every clock with a strobe.
_ICARUS = """
module bench;
  reg clk, rst;
  @DECLARATIONS@
  tachometer dut (.clk(clk), .rst(rst), @CONNECTIONS@);
  integer in, out, more, at, clock;
  initial begin
    in = $fopen("pins.txt", "r");
    out = $fopen("rows.txt", "w");
    more = $fscanf(in, "%d", at);
    rst = 1;
    for (clock = 0; clock < 3; clock = clock + 1) begin
      #1 clk = 0;
      #1 clk = 1;
    end
    #1 rst = 0;
"""
# The same of any module.
PLAY = """\
    for (clock = 0; clock < @N_CLOCKS@; clock = clock + 1) begin
      if (more == 1 && at == clock) begin
        more = $fscanf(in, "@FORMAT@", @PINS@);
        more = $fscanf(in, "%d", at);
      end
      #1 clk = 0;
      #1 if (@STROBES@) $fdisplay(out, "%0d@FORMAT_OUT@", clock, @OUTPUTS@);
      #1 clk = 1;
      #1;
    end
    $fclose(out);
    $finish;
  end
endmodule
"""


def _ports(spec: AnySpec) -> tuple[list[Port], list[Port], list[str]]:
    """Return pins, outputs and strobes."""
    return list(spec.ports.pins), list(spec.ports.outputs), list(spec.ports.strobes)


def filled(text: str, **parts: str | int) -> str:
    for name, part in parts.items():
        text = text.replace(f"@{name}@", str(part))
    return text


def _changes(pins: list[Port], trace: Trace) -> np.ndarray:
    return np.stack([trace.clock, *(trace.lines[pin.name].astype(np.int64) for pin in pins)], axis=1)


class LintingVerilator(Verilator):
    """Verilator that also reads the exported Verilog with -Wall in a folder; any warning is an error.

    `few` clocks are to be run: the compiler is to be fast rather than its code.
    """

    def __init__(self, folder: Path, *, few: bool) -> None:
        super().__init__()
        self._folder = folder
        self.more = ("-O0" if few else "-Og",)

    def text(self, design: Design) -> str:
        text = super().text(design)
        (self._folder / "tachometer.v").write_text(text)
        lint(["tachometer.v"], "tachometer", self._folder)
        return text


def smoke(spec: AnySpec, folder: Path) -> str:
    """Return what the smoke test of an exported core prints in Icarus."""
    for name, text in export(spec, "spindle").items():
        (folder / name).write_text(text)
    subprocess.run(["iverilog", "-g2012", "-o", "tb", "spindle.v", "spindle_tb.sv"], cwd=folder, check=True)
    return subprocess.run([folder / "tb"], cwd=folder, check=True, capture_output=True, text=True).stdout


def run_in_icarus(spec: AnySpec, folder: Path, trace: Trace) -> Run:
    """Compile the exported Verilog as Verilog-2001 with -Wall, any warning an error, and play a trace on it."""
    return play_in_icarus(spec, folder, _changes(list(spec.ports.pins), trace), trace.n_clocks)


def play_in_icarus(spec: AnySpec, folder: Path, changes: np.ndarray, n_clocks: int) -> Run:
    """Return the same with levels of all inputs: a row for each clock in which one changes, with the clock first."""
    rows = play(export(spec)["tachometer.v"], *_ports(spec), folder, changes, n_clocks)
    return observed(spec, n_clocks, rows)


def play_native(
    spec: AnySpec, folder: Path, rows: Sequence[Mapping[str, int]], shown: Sequence[str], *, irq: bool = False
) -> list[list[int]]:
    """Return these outputs of a core on the native bus in every clock; rows have the inputs that change in each."""
    bus = bus_of("native", irq=irq)
    ports = [port for port in ports_on(spec, bus) if port.name not in ("clk", "rst")]
    pins, outputs = ([port for port in ports if port.direction == one] for one in ("input", "output"))
    now = dict.fromkeys((port.name.removeprefix("reg_") for port in pins), 0)
    changes = []
    for clock, row in enumerate(rows):
        now |= row
        changes.append([clock, *now.values()])
    text = export(spec, bus="native", irq=irq)["tachometer.v"]
    found = play(text, pins, outputs, ["1"], folder, np.array(changes), len(rows))
    names = [port.name for port in outputs]
    columns: list[list[int]] = found[:, [1 + names.index(name) for name in shown]].tolist()
    return columns


def play(
    text: str,
    pins: list[Port],
    outputs: list[Port],
    strobes: list[str],
    folder: Path,
    changes: np.ndarray,
    n_clocks: int,
) -> np.ndarray:
    """Return outputs of a module in each clock in which there is a strobe, behind the clock."""
    bench = filled(
        _ICARUS + PLAY,
        N_CLOCKS=n_clocks,
        DECLARATIONS="\n  ".join(
            [f"reg [{pin.width - 1}:0] {pin.name};" for pin in pins]
            + [f"wire{' signed' * port.signed} [{port.width - 1}:0] {port.name};" for port in outputs]
        ),
        CONNECTIONS=", ".join(f".{port.name}({port.name})" for port in [*pins, *outputs]),
        FORMAT=" ".join(["%d"] * len(pins)),
        PINS=", ".join(pin.name for pin in pins),
        STROBES=" || ".join(strobes),
        FORMAT_OUT=" %0d" * len(outputs),
        OUTPUTS=", ".join(port.name for port in outputs),
    )
    (folder / "core.v").write_text(text)
    (folder / "bench.v").write_text(bench)
    command = ["iverilog", "-g2001", "-Wall", "-s", "bench", "-o", "core.vvp", "core.v", "bench.v"]
    said = subprocess.run(command, cwd=folder, check=True, stderr=subprocess.PIPE, text=True).stderr
    assert said == "", f"warnings of Icarus:\n{said}"
    np.savetxt(folder / "pins.txt", changes, fmt="%d")
    subprocess.run(["vvp", "-n", "core.vvp"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    wide = any(port.width > 63 for port in outputs)  # which are Python's integers
    more: dict[str, Any] = {"dtype": object, "converters": int} if wide else {"dtype": np.int64}
    rows = np.loadtxt(folder / "rows.txt", ndmin=2, **more)
    return rows.reshape(-1, 1 + len(outputs))
