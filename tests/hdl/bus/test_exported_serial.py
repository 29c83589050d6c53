"""Registers over SPI and UART, of the exported core in Icarus, Verilator and CXXRTL, while the encoder turns."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from support.compiled import clock_by_clock, lint, read_exported
from support.nightly import nightly
from support.serial import Host, SpiHost, UartHost

from tachometry.hdl.export import export
from tachometry.hdl.export.files import top_of
from tachometry.sim import build
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.verilator import home, runtimes, verilate
from tachometry.sim.golden.registers import GoldenBank
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import Encoder, STachometer, Timing
from tachometry.spec.core.index import Index
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.map import RegisterMap

SPEC = STachometer(encoder=Encoder(100), timing=Timing(1_000_000, 64, 20), filter_clocks=1, index=Index(), age=True)
START = 30_000  # there has been an update: before, not all is defined

_VERILATOR = """
#include <cstdio>
{includes}
int main() {{
  VerilatedContext context;
  Vcore top{{&context}};
  FILE *in = fopen("pins", "rb"), *out = fopen("out", "wb");
  top.rst = 1;
  for (int k = 0; k < 3; k++) {{ top.clk = 0; top.eval(); top.clk = 1; top.eval(); }}
  top.rst = 0;
  for (int level; (level = getc(in)) != EOF;) {{
    {pins}
    top.clk = 0;
    top.eval();
    putc(top.{output}, out);
    top.clk = 1;
    top.eval();
  }}
  fclose(out);
}}
"""
# What is low for all clocks of the reset is what `pins` begins with.
_ICARUS = """
module bench;
  reg clk, rst;
  reg [{high}:0] pins;
  wire out;
  core dut (.clk(clk), .rst(rst), {connections}, .{output}(out));
  integer in, file, more, at, clock;
  reg before;
  initial begin
    in = $fopen("changes", "r");
    file = $fopen("rows", "w");
    more = $fscanf(in, "%d %d", at, pins);
    rst = 1;
    for (clock = 0; clock < 3; clock = clock + 1) begin
      #1 clk = 0;
      #1 clk = 1;
    end
    #1 rst = 0;
    more = $fscanf(in, "%d", at);
    for (clock = 0; clock < {n_clocks}; clock = clock + 1) begin
      if (more == 1 && at == clock) begin
        more = $fscanf(in, "%d", pins);
        more = $fscanf(in, "%d", at);
      end
      #1 clk = 0;
      #1 if (out !== before) $fdisplay(file, "%0d %b", clock, out);
      before = out;
      clk = 1;
      #1;
    end
    $fclose(file);
    $finish;
  end
endmodule
"""

Simulate = Callable[[str, list[str], str, NDArray[np.uint8], Path], NDArray[np.uint8]]


def in_verilator(text: str, pins: list[str], output: str, levels: NDArray[np.uint8], folder: Path) -> NDArray[np.uint8]:
    """Return what an output of the module `core` is in every clock; `levels` has a bit for each of its other inputs."""
    (folder / "core.v").write_text(text)
    lint(["core.v"], "core", folder)
    verilate(["-O3", "--cc", "--prefix", "Vcore", "--Mdir", "made", "--top-module", "core", "core.v"], folder)
    made = ["Vcore.h", *sorted(path.name for path in (folder / "made").glob("*.cpp"))]
    source = _VERILATOR.format(
        includes="\n".join(f'#include "{name}"' for name in made),
        pins=" ".join(f"top.{pin} = level >> {bit} & 1;" for bit, pin in enumerate(pins)),
        output=output,
    )
    (folder / "main.cc").write_text(source)
    header = build.precompiled(home() / "include", "verilated.h")
    paths = [f"-I{home() / 'include'}", f"-I{folder / 'made'}"]
    build.run(
        [*build.compiler(), *build.flags(), *header, *paths, "-o", "main", "main.cc", *runtimes()], "compiler", folder
    )
    levels.tofile(folder / "pins")
    subprocess.run([folder / "main"], cwd=folder, check=True)
    return np.fromfile(folder / "out", np.uint8)


def in_icarus(text: str, pins: list[str], output: str, levels: NDArray[np.uint8], folder: Path) -> NDArray[np.uint8]:
    """Return the same, as Verilog-2001 with -Wall, any warning an error."""
    (folder / "core.v").write_text(text)
    connections = ", ".join(f".{pin}(pins[{bit}])" for bit, pin in enumerate(pins))
    parts = {"high": len(pins) - 1, "connections": connections, "output": output, "n_clocks": len(levels)}
    (folder / "bench.v").write_text(_ICARUS.format(**parts))
    command = ["iverilog", "-g2001", "-Wall", "-s", "bench", "-o", "core.vvp", "core.v", "bench.v"]
    said = subprocess.run(command, cwd=folder, check=True, stderr=subprocess.PIPE, text=True).stderr
    assert said == "", f"warnings of Icarus:\n{said}"
    changed = np.append(0, np.flatnonzero(np.diff(levels)) + 1)
    np.savetxt(folder / "changes", np.stack([changed, levels[changed]], axis=1), fmt="%d")
    subprocess.run(["vvp", "-n", "core.vvp"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    clock, level = np.loadtxt(folder / "rows", dtype=np.int64, ndmin=2).T  # fails on x
    return level[np.searchsorted(clock, np.arange(len(levels)), side="right") - 1].astype(np.uint8)


def motion(n_clocks: int, seed: int) -> PinTrace:
    """Return to and fro at several speeds, over the index, with jitter and glitches, for so many clocks."""
    duration = n_clocks / SPEC.timing.clock_hz
    part = duration / 4
    speeds = f"sine:60rad/s:{7 / part}Hz:{part}s+constant:-9rad/s:{part}s+ramp:-9rad/s:90rad/s:{part}s"
    encoder = VirtualEncoder(100, jitter=0.2, illegal=0.01, seed=seed, index=True)
    recording = encoder.record(parse_motion(f"constant:40rad/s:{part / 2}s+stop:{part / 2}s+{speeds}")).recording
    trace = recording.place(SPEC.timing.clock_hz)
    return PinTrace(trace.clock, trace.a, trace.b, n_clocks, trace.z)


def check(simulate: Simulate | None, host: Host, bus: str, output: str, folder: Path, baud: int | None = None) -> None:
    """Let a host play on the exported core while the encoder turns; what comes back must be the golden registers."""
    assert {access.address for access in host.accesses if access.data is None} >= set(range(N_WORDS))
    n_clocks = int(host.time) + 100
    trace = motion(n_clocks, seed=len(host.accesses))
    captures = np.flatnonzero(host.rng.random(n_clocks) < 0.0005)
    captures = captures[captures >= START]
    lines = {**host.lines(n_clocks), "capture": np.zeros(n_clocks, np.uint8)}
    lines["capture"][captures] = 1
    for pin in SPEC.ports.pins:
        rows = np.searchsorted(trace.clock, np.arange(n_clocks), side="right") - 1
        lines[pin.name] = trace.lines[pin.name][rows]
    levels = np.zeros(n_clocks, np.uint8)
    for bit, level in enumerate(lines.values()):
        levels |= level << np.uint8(bit)
    if simulate is None:
        inputs = [dict(zip(lines, at, strict=True)) for at in np.stack([*lines.values()], axis=1).tolist()]
        with pytest.MonkeyPatch.context() as patch:
            read_exported(patch)
            played = clock_by_clock(top_of(SPEC, bus_of(bus, baud)), inputs, [output])
        seen = np.array([row[output] for row in played], np.uint8)
    else:
        seen = simulate(export(SPEC, "core", bus, baud)["core.v"], list(lines), output, levels, folder)
    answers = GoldenBank(RegisterMap(SPEC), trace).answers(host.accesses, captures.tolist())
    assert not any(data is None for data, _ in answers)
    host.check(seen, answers)


REGISTERS = RegisterMap(SPEC)
WORDS = REGISTERS.address_width - 2
N_WORDS = len(REGISTERS.registers)
CONTROL, VELOCITY = (REGISTERS[name].offset // 4 for name in ("CONTROL", "VELOCITY"))
ALL = (CONTROL, VELOCITY, N_WORDS, N_WORDS - VELOCITY)
BIT_CYCLES = 8
BAUD = SPEC.timing.clock_hz // BIT_CYCLES
SIMULATORS = [*(pytest.param(*one, marks=nightly) for one in ((in_verilator, 10_000), (None, 1000))), (in_icarus, 250)]


@pytest.mark.parametrize(("simulate", "n_accesses"), SIMULATORS)
def test_over_spi(simulate: Simulate | None, n_accesses: int, tmp_path: Path) -> None:
    host = SpiHost(np.random.default_rng(n_accesses), START, WORDS)
    while len(host.accesses) < n_accesses:
        host.random_frame(*ALL)
    check(simulate, host, "spi", "spi_miso", tmp_path)


# The exported core is the same as over SPI, and tests/hdl/bus/test_uart.py has the line.
@nightly
@pytest.mark.parametrize(("simulate", "n_accesses"), SIMULATORS)
def test_over_uart(simulate: Simulate | None, n_accesses: int, tmp_path: Path) -> None:
    host = UartHost(np.random.default_rng(n_accesses), START, WORDS, BIT_CYCLES)
    while len(host.accesses) < n_accesses:
        host.random_exchange(*ALL)
        if host.rng.random() < 0.3:
            host.random_damage(*ALL)
    check(simulate, host, "uart", "uart_tx", tmp_path, BAUD)
