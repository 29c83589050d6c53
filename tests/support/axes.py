"""Small cores of many axes, with motions that are short enough for Amaranth's simulator."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import AxesSpec, Encoder, Speed, STachometer, Timing

CLOCK_HZ = 1_000_000
TICK_CYCLES = 40
MAX_TICKS = 4


def small(
    axes: int = 3, *, parallel: bool = False, most: int | None = 2, tick: int = TICK_CYCLES, **options: Any
) -> AxesSpec:
    """Return a tick of 40 clocks if nothing else is said, in which `most` counts are the most that are measured."""
    timing = Timing(CLOCK_HZ, tick, MAX_TICKS)
    speed = None if most is None else Speed(Fraction(most * CLOCK_HZ, 100 * tick), "rev/s")
    alone = STachometer(encoder=Encoder(25), timing=timing, max_speed=speed, **({"frac_bits": 8} | options))
    return AxesSpec(tachometer=alone, axes=axes, parallel=parallel)


def motions(spec: AxesSpec, n_clocks: int = 2000) -> AxesTrace:
    """Return another motion for each axis: counts, reversals, both lines at once, standstill; index lines are high at
    first.
    """
    each = [stress(spec.tachometer, seed=7 + axis, n_edges=5 + 3 * axis) for axis in range(spec.axes)]
    high = [replace(trace, z=None if trace.z is None else 1 - trace.z) for trace in each]
    if spec.tachometer.external_tick:
        # Early ones, late ones, some that come much too early or not at all.
        cycles = spec.timing.tick_cycles
        apart = np.random.default_rng(8).choice([2, cycles - 9, cycles, cycles + 7, 5 * cycles], n_clocks // cycles)
        high = [replace(trace, tick_in=None).with_tick_in(np.cumsum(apart)) for trace in high]
    return AxesTrace.of(high).until(n_clocks)


def check(spec: AxesSpec, trace: AxesTrace | None = None) -> None:
    """Hold the core against its golden model."""
    found = lockstep(spec, motions(spec) if trace is None else trace, PySim())
    assert found.n_mismatches == 0, found.first
