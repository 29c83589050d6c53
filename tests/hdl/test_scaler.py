"""Exactness of base + N/(2^s·m) through the gates."""

import subprocess
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from support.compiled import build
from support.mutant import caught, mutant
from support.sequences import rounded
from support.simulate import clock_by_clock

from tachometry.hdl import scaler
from tachometry.hdl.reciprocal import Reciprocal
from tachometry.sim.golden.s_method import round_quotient
from tachometry.spec import Encoder, STachometer, Timing


class Quotient(wiring.Component):
    """Reciprocal and scaler, wired as in the S method."""

    def __init__(self, spec: STachometer, *, serial: bool) -> None:
        self._spec = spec
        self.reciprocal = Reciprocal(spec.reciprocal)
        self.scaler = (scaler.SerialScaler if serial else scaler.PipelinedScaler)(
            spec.reciprocal, base_width=spec.count_width, numerator_width=spec.numerator_width, tag_width=4
        )
        inputs = ("load", "start", "base", "numerator", "tag")
        outputs = ("done", "velocity", "tag_out")
        members: dict[str, Any] = {"m": In(spec.interval_width)}
        members |= {name: In(getattr(self.scaler, name).shape()) for name in inputs}
        members |= {name: Out(getattr(self.scaler, name).shape()) for name in outputs}
        self._wires = inputs, outputs
        super().__init__(members)

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.reciprocal, m.submodules.scaler = self.reciprocal, self.scaler
        m.d.comb += [
            self.reciprocal.m.eq(self.m),
            self.reciprocal.enable.eq(self.start),
            self.scaler.q.eq(self.reciprocal.q),
        ]
        inputs, outputs = self._wires
        m.d.comb += [getattr(self.scaler, name).eq(getattr(self, name)) for name in inputs]
        m.d.comb += [getattr(self, name).eq(getattr(self.scaler, name)) for name in outputs]
        return m


def default_spec(frac_bits: int = 16, *, cancel: bool = True) -> STachometer:
    timing = Timing.parse("48MHz", "20us", "10ms")
    return STachometer(encoder=Encoder(500), timing=timing, frac_bits=frac_bits, cancel=cancel)


# Every (N, m), start after start as fast as the scaler takes them; the answers leave as 64-bit integers.
_EXHAUSTIVE = """
#include <cstdio>
#include <cstdint>
#include <vector>
int main(int argc, char **argv) {{
  cxxrtl_design::p_top top;
  std::vector<int64_t> answers;
  auto clock = [&] {{
    top.p_clk.set<bool>(false); top.step();
    if (top.p_done.get<bool>()) {{
      uint64_t raw = top.p_velocity.get<uint64_t>();
      answers.push_back(int64_t(raw << (64 - {width})) >> (64 - {width}));
    }}
    top.p_clk.set<bool>(true); top.step();
  }};
  for (int m = 1; m <= {max_m}; m++)
    for (int n = -{max_n}; n <= {max_n}; n++) {{
      top.p_m.set<uint32_t>(m);
      top.p_base.set<uint32_t>(uint32_t(-(n >> {base_shift})) & {base_mask}u);
      top.p_numerator.set<uint32_t>(uint32_t(n) & {mask}u);
      top.p_load.set<bool>(true); top.p_start.set<bool>(true); clock();
      top.p_load.set<bool>(false); top.p_start.set<bool>(false);
      for (int k = 1; k < {distance}; k++) clock();
    }}
  for (int k = 0; k < 64; k++) clock();
  FILE *file = fopen(argv[1], "wb");
  fwrite(answers.data(), 8, answers.size(), file);
  return fclose(file);
}}
"""


@pytest.mark.parametrize("serial", [True, False])
@pytest.mark.parametrize(("frac_bits", "cancel"), [(16, True), (4, True), (4, False)])
def test_every_numerator_and_interval(tmp_path: Path, frac_bits: int, cancel: bool, serial: bool) -> None:
    spec = default_spec(frac_bits, cancel=cancel)
    top = Quotient(spec, serial=serial)
    distance = spec.tick_to_velocity if serial else 1
    main = _EXHAUSTIVE.format(
        width=spec.velocity_width,
        max_m=spec.timing.max_ticks,
        max_n=spec.max_numerator,
        base_shift=1 + spec.reciprocal.halvings,
        base_mask=(1 << spec.count_width) - 1,
        mask=(1 << spec.numerator_width) - 1,
        distance=distance,
    )
    answers = tmp_path / "answers"
    subprocess.run([build(top, main, tmp_path), answers], check=True)
    got = np.fromfile(answers, dtype=np.int64)
    m, n = np.meshgrid(
        np.arange(1, spec.timing.max_ticks + 1),
        np.arange(-spec.max_numerator, spec.max_numerator + 1),
        indexing="ij",
    )
    halvings = spec.reciprocal.halvings
    base = -(n.ravel() >> (1 + halvings))  # any for which the ends of the window are within the range of m_e
    wanted = (base << frac_bits) + round_quotient(n.ravel(), m.ravel() << halvings, frac_bits)
    ties = (n.ravel() << (frac_bits + 1)) % (m.ravel() << halvings) == 0
    ties &= (n.ravel() << frac_bits) % (m.ravel() << halvings) != 0
    assert len(got) == len(wanted)
    assert np.count_nonzero(got != wanted) == 0
    assert frac_bits != 4 or np.count_nonzero(ties) > 1000


def base(n: int) -> int:
    return n % 5 - 3


def check_ties(*, serial: bool) -> None:
    """Ties of both signs, between other values, at 4 fraction bits."""
    spec = default_spec(4)
    pairs = [(n, m) for m in (32, 96, 160, 480) for n in range(-18, 19)] + [(7, 3), (-7, 3), (1920, 1), (-3840, 500)]
    pause = spec.tick_to_velocity if serial else 1
    rows = []
    for n, m in pairs:
        rows += [{"load": 1, "start": 1, "m": m, "numerator": n, "base": base(n), "tag": n % 16}] + [
            {"load": 0, "start": 0}
        ] * (pause - 1)
    seen = clock_by_clock(
        Quotient(spec, serial=serial),
        [*rows, *({"load": 0, "start": 0} for _ in range(spec.tick_to_velocity + 1))],
        ["done", "velocity", "tag_out"],
    )
    got = [(row["velocity"], row["tag_out"]) for row in seen if row["done"]]
    assert got == [(rounded(Fraction(n, 2 * m) + base(n), 4), n % 16) for n, m in pairs]
    assert seen[spec.tick_to_velocity]["done"] == 1


@pytest.mark.parametrize("serial", [True, False])
def test_ties_base_and_tag(serial: bool) -> None:
    check_ties(serial=serial)


MUTANTS = {
    "half-even rounding": ("(total >> self._surplus)", "((total >> self._surplus) & ~~total[: self._surplus].any())"),
    "the sign bit counts positive": ("self.q ^ sign.replicate(len(self.q))", "self.q"),
    "half down": ("total.eq(self._rounding)", "total.eq(1 << (self._surplus + self._steps - 1))"),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_mutants_are_caught(name: str) -> None:
    with mutant(scaler.SerialScaler, *MUTANTS[name]), caught():
        check_ties(serial=True)
