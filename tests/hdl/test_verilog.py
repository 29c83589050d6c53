"""The exported Verilog in Verilator: a simulator that shares nothing with Amaranth's."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from support.compiled import verilate
from support.lockstep import CLOCK_HZ, random_case

from tachometry.hdl import export
from tachometry.sim import golden
from tachometry.sim.results import Run, Ticks, Updates, compare
from tachometry.spec import TachometerSpec

# Reads (clock, a, b) triples, writes (clock, tick, valid, error and the values of all outputs) of clocks with a strobe.
_MAIN = """
#include <cstdio>
#include <cstdint>
#include "Vcore.h"
int64_t get(uint64_t raw, int width, bool is_signed) {
  return is_signed ? int64_t(raw << (64 - width)) >> (64 - width) : int64_t(raw);
}
int main(int argc, char **argv) {
  Vcore top;
  FILE *in = fopen(argv[1], "rb"), *out = fopen(argv[2], "wb");
  int64_t n_clocks, change[3];
  fread(&n_clocks, 8, 1, in);
  bool more = fread(change, 8, 3, in) == 3;
  top.rst = true;
  for (int k = 0; k < 3; k++) {
    top.clk = false; top.eval(); top.clk = true; top.eval();
  }
  top.rst = false;
  for (int64_t clock = 0; clock < n_clocks; clock++) {
    if (more && change[0] == clock) {
      top.a = change[1]; top.b = change[2];
      more = fread(change, 8, 3, in) == 3;
    }
    top.clk = false; top.eval();
    int64_t row[] = {clock, @OUTPUTS@};
    if (top.tick || top.velocity_valid || top.decode_error)
      fwrite(row, sizeof row, 1, out);
    top.clk = true; top.eval();
  }
  return fclose(out);
}
"""


def run_verilog(spec: TachometerSpec, folder: Path, changes: np.ndarray, n_clocks: int) -> Run:
    """Compile the exported Verilog and play changes (clock, a, b) on it."""
    ports = [port for port in spec.ports if port.direction == "output"]
    reads = (f"get(top.{port.name}, {port.width}, {str(port.signed).lower()})" for port in ports)
    (folder / "core.v").write_text(export(spec)["tachometer.v"])
    program = verilate(folder / "core.v", _MAIN.replace("@OUTPUTS@", ", ".join(reads)))
    np.concatenate([[n_clocks], changes.ravel()]).astype(np.int64).tofile(folder / "pins")
    subprocess.run([program, "pins", "rows"], cwd=folder, check=True)
    rows = np.fromfile(folder / "rows", dtype=np.int64).reshape(-1, 1 + len(ports))
    column = {"clock": rows[:, 0]} | {port.name: rows[:, k + 1] for k, port in enumerate(ports)}

    column.setdefault("swallowed_edges", np.zeros(len(rows), dtype=np.int64))

    def at(strobe: str, *names: str) -> list[np.ndarray]:
        return [column[name][column[strobe] == 1] for name in ("clock", *names)]

    return Run(
        n_clocks,
        Ticks(*at("tick", "pulse_count", "position", "overflow", "swallowed_edges")),
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
