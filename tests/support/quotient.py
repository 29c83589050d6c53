"""The quotient of the S method, and all its answers from a compiled simulation."""

import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from amaranth import Module
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out
from numpy.typing import NDArray

from support.compiled import build
from tachometry.hdl.arithmetic.quotient import Quotient
from tachometry.spec import STachometer


class FlatQuotient(wiring.Component):
    """base + N/(2^s·m) of the S method, whose results are scalar ports; a margin of 0 lets bounds be those of N."""

    def __init__(self, spec: STachometer, *, serial: bool, towards: int = 0) -> None:
        self.box = Quotient(
            spec.reciprocal,
            quotients={"velocity": (spec.velocity_width, towards)},
            numerator_width=spec.numerator_width,
            tag=data.StructLayout({"mark": 1}),
            serial=serial,
        )
        self._inputs = ("m", "enable", "load", "start", "base", "numerator")
        results = self.box.results.p.shape().members
        super().__init__(
            {name: In(getattr(self.box, name).shape()) for name in self._inputs}
            | {"done": Out(1), "velocity": Out(results["velocity"]), "m_out": Out(results["m"])}
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.box = box = self.box
        m.d.comb += [getattr(box, name).eq(getattr(self, name)) for name in self._inputs]
        m.d.comb += [
            self.done.eq(box.results.valid),
            self.velocity.eq(box.results.p.velocity),
            self.m_out.eq(box.results.p.m),
        ]
        return m


# Every m with every numerator, start after start as fast as the scaler takes them; answers leave as 64-bit integers.
_MAIN = """
#include <cstdio>
#include <cstdint>
#include <vector>
int main(int, char **argv) {{
  cxxrtl_design::p_top top;
  std::vector<int64_t> answers;
  // All flip-flops take the rising edge: one evaluation a clock, whose outputs are those before it.
  auto clock = [&] {{
    top.prev_p_clk.set<bool>(false);
    top.p_clk.set<bool>(true);
    top.eval();
    if (top.p_done.get<bool>()) {{
      uint64_t raw = top.p_velocity.get<uint64_t>();
      answers.push_back(int64_t(raw << (64 - {width})) >> (64 - {width}));
    }}
    top.commit();
  }};
  const int numerators[] = {{{numerators}}};
  for (int m = 1; m <= {max_m}; m++) {{
    top.p_m.set<uint32_t>(m);
    top.p_enable.set<bool>(true);
    for (int n : numerators) {{
      top.p_base.set<uint32_t>(uint32_t(-(n >> {base_shift})) & {base_mask}u);
      top.p_numerator.set<uint32_t>(uint32_t(n) & {mask}u);
      top.p_load.set<bool>(true); top.p_start.set<bool>(true); clock();
      top.p_enable.set<bool>(false); top.p_load.set<bool>(false); top.p_start.set<bool>(false);
      for (int k = 1; k < {distance}; k++) clock();
    }}
  }}
  for (int k = 0; k < 100; k++) clock();
  FILE *file = fopen(argv[1], "wb");
  fwrite(answers.data(), 8, answers.size(), file);
  return fclose(file);
}}
"""


def every_quotient(
    spec: STachometer, numerators: Sequence[int], distance: int, folder: Path, towards: int = 0
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """(base, N, m, velocity) for m = 1, 2 … max_ticks with every N each, `distance` clocks apart.

    The base is one for which the ends of the window are within the range of m_e.
    """
    shift = 1 + spec.reciprocal.halvings
    main = _MAIN.format(
        width=spec.velocity_width,
        max_m=spec.timing.max_ticks,
        numerators=", ".join(map(str, numerators)),
        base_shift=shift,
        base_mask=(1 << spec.count_width) - 1,
        mask=(1 << spec.numerator_width) - 1,
        distance=distance,
    )
    answers = folder / "answers"
    subprocess.run([build(FlatQuotient(spec, serial=distance > 1, towards=towards), main, folder), answers], check=True)
    m, n = np.meshgrid(np.arange(1, spec.timing.max_ticks + 1), np.array(numerators), indexing="ij")
    return -(n.ravel() >> shift), n.ravel(), m.ravel(), np.fromfile(answers, dtype=np.int64)
