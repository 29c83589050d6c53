"""Words of Rairán 2013 about its estimates are measured on the golden model: bounds at all phases, and a lock."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tachometry.sim import golden
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.theory import rairan
from tachometry.spec import Encoder, RairanTachometer, Timing

DT = 2520  # divisible by 1 to 10: the ends of all intervals are met
SPEC = RairanTachometer(
    encoder=Encoder(250), timing=Timing(1_000_000, DT, 40), estimate="n1", frac_bits=20, bound_decay=False
)
LEVELS = np.array([0, 1, 3, 2], dtype=np.uint8)  # A + 2 B in the quarters


def pins(edges: NDArray[np.int64], n_clocks: int) -> PinTrace:
    """Return lines with an edge at each of these clocks, forward."""
    level = LEVELS[np.arange(len(edges) + 1) & 3]
    return PinTrace(np.append(0, edges), level & 1, level >> 1, n_clocks)


def settled_n1(spec: RairanTachometer, edges: NDArray[np.int64], windows: int = 8) -> NDArray[np.float64]:
    """Return n1 of all updates after so many dt or counts, whichever is longer."""
    period = int(np.diff(edges).max())
    run = golden.run(spec, pins(edges, int(edges[-1])))
    late = run.updates.clock > edges[0] + windows * max(spec.timing.tick_cycles, period)
    return run.updates.velocity[late] / 2.0**spec.widths.frac_bits


def test_bounds_are_never_exceeded_at_any_speed_and_phase() -> None:
    """Periods of a whole number of ts, so that a ts of synchronisation makes no difference."""
    rng = np.random.default_rng(1)
    ends = (DT * np.arange(1, 9)[:, np.newaxis] + [-1, 0, 1]).ravel().tolist()
    ends += [DT // k + d for k in range(2, 11) for d in (-1, 0, 1) if DT // k + d >= DT // 10]
    periods = np.unique([*ends, *np.rint(DT / rng.uniform(0.125, 10, 400)).astype(int), *rng.integers(DT, 8 * DT, 150)])
    worst: dict[tuple[str, float], float] = {}
    for period in periods.tolist():
        speed, shown = DT / period, set()
        for first in rng.integers(1, 3 * DT, 4).tolist():
            edges = first + period * np.arange(24 * max(1, DT // period + 1))
            shown |= set(np.unique(settled_n1(SPEC, edges)).tolist())
        # Velocities are rounded; what is meant is 1/Ndt1 or Nep1.
        (n1,) = {1 / math.floor(1 / n + 1e-3) if n < 1 else float(round(n)) for n in shown}
        n2 = rairan.rairan_eq05_n2(n1)
        errors = {
            "eq. (4)": (rairan.rairan_eq03_error(n1, speed, 1), rairan.rairan_eq04_max_error(n1)),
            "eq. (8)": (1 - n2 / speed, rairan.rairan_eq08_sup_error(n2)),
            "eq. (13)": (
                abs(rairan.rairan_eq11_n3(n1, n2) - speed) / speed,
                rairan.rairan_eq13_max_error(n1),
            ),
        }
        for equation, (error, bound) in errors.items():
            share = float(error / bound)
            assert share <= 1 + 1e-12, (equation, period)
            worst[equation, n1] = max(worst.get((equation, n1), 0.0), share)
    attained = {"eq. (4)": lambda n1: n1 <= 1, "eq. (8)": lambda n1: n1 >= 1, "eq. (13)": lambda n1: True}
    assert {n1 for _, n1 in worst} >= {1 / n for n in range(1, 8)} | set(range(2, 11))
    for (equation, n1), share in worst.items():
        if n1 > 1 / 7.5:  # whose interval is met as a whole
            assert share > 0.96
            # A supremum comes as near as a period that differs by one ts.
            assert (share >= 1 - 1e-12) == attained[equation](n1), (equation, n1)


@pytest.mark.parametrize("phase", [0.0, 0.13, 0.5, 0.77])
def test_the_default_does_not_lock_where_the_letter_does(phase: float) -> None:
    """A count every 1000.5 ts, dt = 1000 ts: ω = 0.9995 ω_lim. To the letter n1 = ½ for ever; by default n1 = 1."""
    timing = Timing(1_000_000, 1000, 40)
    edges = np.ceil(1000.5 * (np.arange(600) + 1 + phase)).astype(np.int64)
    letter = replace(SPEC, timing=timing, paper_exact=True)
    for spec, expected in ((letter, 0.5), (replace(letter, paper_exact=False), 1.0)):
        assert set(settled_n1(spec, edges)) == {expected}
