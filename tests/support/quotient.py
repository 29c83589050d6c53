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
from tachometry.spec.formats.reciprocal import DividedReciprocal, Reciprocal


class FlatQuotient(wiring.Component):
    """base + N/(2^s·m) of the S method, whose results are scalar ports; a margin of 0 lets bounds be those of N."""

    def __init__(self, spec: STachometer, *, serial: bool, towards: int = 0) -> None:
        self.box = Quotient(
            spec.form.reciprocal,
            quotients={"velocity": (spec.velocity.width, towards, 0)},
            numerator_width=spec.form.numerator_width,
            tag=data.StructLayout({"mark": 1}),
            serial=serial,
        )
        self._inputs = ("m", "moves", "load", "start", "base", "numerator")
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
# Loaded is a clock before the start.
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
  auto load = [&](int n) {{
    top.p_base.set<uint32_t>(uint32_t(-(n >> {base_shift})) & {base_mask}u);
    top.p_numerator.set<uint32_t>(uint32_t(n) & {mask}u);
    top.p_load.set<bool>(true);
  }};
  const int numerators[] = {{{numerators}}};
{loop}
  for (int k = 0; k < 100; k++) clock();
  FILE *file = fopen(argv[1], "wb");
  fwrite(answers.data(), 8, answers.size(), file);
  return fclose(file);
}}
"""


# The reciprocal has all the time that it takes.
_SERIAL = """
  for (int m = 1; m <= {max_m}; m += {every}) {{
    if (m > 1) {{
      top.p_moves.set<bool>(true); clock(); top.p_moves.set<bool>(false);
    }}
    top.p_m.set<uint32_t>(m);
    for (int k = 0; k < {wait}; k++) clock();
    for (int n : numerators) {{
      load(n); clock(); top.p_load.set<bool>(false);
      top.p_start.set<bool>(true); clock(); top.p_start.set<bool>(false);
      for (int k = 2; k < {distance}; k++) clock();
    }}
  }}
"""
# What is started has been loaded the clock before.
_PIPELINED = """
  const int each = sizeof numerators / sizeof numerators[0];
  const int64_t all = int64_t(({max_m} - 1) / {every} + 1) * each;
  for (int64_t k = 0; k <= all; k++) {{
    load(numerators[k % each]);
    top.p_start.set<bool>(k > 0);
    top.p_moves.set<bool>(k % each == 1 || each == 1);
    top.p_m.set<uint32_t>(k > 0 ? (k - 1) / each * {every} + 1 : 0);
    clock();
  }}
  top.p_start.set<bool>(false); top.p_moves.set<bool>(false);
"""


def every_quotient(
    spec: STachometer, numerators: Sequence[int], folder: Path, towards: int = 0, every: int = 1
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return (base, N, m, velocity) of each `every`-th m with every N, from start to start as fast as can be.

    The base is one for which the ends of the window are within the range of m_e.
    """
    form = spec.form.reciprocal
    serial = isinstance(form, Reciprocal)
    max_m = spec.timing.max_ticks
    wait = form.steps if isinstance(form, DividedReciprocal) else 2
    distance = form.digits + 2 if serial else 1
    shift = 1 + form.halvings
    main = _MAIN.format(
        width=spec.velocity.width,
        numerators=", ".join(map(str, numerators)),
        base_shift=shift,
        base_mask=(1 << spec.widths.count) - 1,
        mask=(1 << spec.form.numerator_width) - 1,
        loop=(_SERIAL if serial else _PIPELINED).format(max_m=max_m, every=every, wait=wait, distance=distance),
    )
    answers = folder / "answers"
    dut = FlatQuotient(spec, serial=serial, towards=towards)
    subprocess.run([build(dut, main), answers], check=True)
    m, n = np.meshgrid(np.arange(1, max_m + 1, every), np.array(numerators), indexing="ij")
    return -(n.ravel() >> shift), n.ravel(), m.ravel(), np.fromfile(answers, dtype=np.int64)
