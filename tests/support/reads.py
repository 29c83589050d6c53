"""The master of absolute encoders, compiled, at a line that is given."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from support.compiled import build
from tachometry.hdl.core.sampled_tachometer import master_of
from tachometry.sim.build import run
from tachometry.sim.golden.encoder_read import Records
from tachometry.spec.core.reads import Reads

Clocks = NDArray[np.int64]

# Rows in: clock, and the inputs from it on. Rows out: clock of a strobe and the record; or clock of a change, −1 and
# the levels of the outputs to the encoder, the first lowest.
_PLAYER = """
#include <cstdio>
int main(int, char **argv) {
  cxxrtl_design::p_top top;
  FILE *in = fopen(argv[1], "rb"), *out = fopen(argv[2], "wb");
  const int64_t clocks = strtoll(argv[3], nullptr, 10);
  int64_t next[3], pins = -1;
  bool more = fread(next, sizeof next, 1, in) == 1;
  for (int64_t clock = 0; clock < clocks; clock++) {
    for (; more && next[0] == clock; more = fread(next, sizeof next, 1, in) == 1) {
      top.p_start.set<bool>(next[1]);
      top.LINE.set<bool>(next[2]);
    }
    top.p_clk.set<bool>(false);
    top.step();
    const int64_t now = PINS;
    if (now != pins) {
      const int64_t row[] = {clock, -1, pins = now, 0, 0};
      fwrite(row, sizeof row, 1, out);
    }
    if (top.p_sample__valid.get<bool>()) {
      const int64_t ok = top.p_sample__ok.get<bool>(), reason = top.p_reason.get<uint64_t>();
      const int64_t row[] = {clock, int64_t(top.p_sample.get<uint64_t>()), int64_t(top.p_sample__age.get<uint64_t>()),
                             ok == (reason == 0) ? reason : -1, top.p_sample__warning.get<bool>()};
      fwrite(row, sizeof row, 1, out);
    }
    top.p_clk.set<bool>(true);
    top.step();
  }
  return fclose(out);
}
"""


def play(reads: Reads, start: Clocks, line: tuple[Clocks, NDArray[np.uint8]], clocks: int) -> tuple[Records, Clocks]:
    """Return the records of a master, and the clocks in which its outputs to the encoder change, with their levels."""
    read, *driven = ("p_" + port.name.replace("_", "__") for port in reads.ports)
    pins = " | ".join(f"top.{name}.get<bool>() << {place}" for place, name in enumerate(driven))
    player = _PLAYER.replace("LINE", read).replace("PINS", pins)
    clock = np.unique(np.concatenate([[0], start, start + 1, line[0]]))
    level = line[1][np.searchsorted(line[0], clock, side="right") - 1]
    rows = np.stack([clock, np.isin(clock, start), level], axis=1).astype(np.int64)
    with TemporaryDirectory() as folder:
        played, seen = Path(folder) / "in", Path(folder) / "out"
        rows.tofile(played)
        run([build(master_of(reads), player), played, seen, str(clocks)], "simulation")
        found = np.fromfile(seen, dtype=np.int64).reshape(-1, 5)
    changes = found[found[:, 1] == -1][:, [0, 2]]
    at, sample, age, reason, warning = found[found[:, 1] != -1].T
    return Records(at, sample, age, reason, warning == 1), changes
