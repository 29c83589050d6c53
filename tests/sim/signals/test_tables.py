"""The tables of a run, on a run made by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tachometry.sim.signals.run import Index, Run, Ticks, Updates
from tachometry.sim.signals.tables import held_velocity, velocity_error, write_counts, write_trace
from tachometry.spec import Encoder, STachometer, Timing

SPEC = STachometer(encoder=Encoder(100), timing=Timing(20_000, 20, 10))
LSB = SPEC.rad_per_s_per_lsb
AFTER = SPEC.tick_to_velocity
# Ticks 0 to 4; ticks 1 and 3 cause an update; the clocks end before an update of tick 4 could come.
NONE = np.array([], dtype=np.int64)
TICK = np.array([21, 41, 61, 81, 101])
RUN = Run(
    n_clocks=101 + AFTER,
    ticks=Ticks(
        TICK,
        np.array([0, 1, 1, -2, -2]),
        np.array([0, 1, 2, 0, -2]),
        np.zeros(5, dtype=np.bool_),
        *np.zeros((2, 5), np.int64),
    ),
    updates=Updates(
        TICK[[1, 3]] + AFTER,
        np.array([3, -5]),
        np.array([2, 2]),
        np.array([False, True]),
        np.array([False, False]),
        np.array([False, False]),
    ),
    index=Index(NONE, NONE),
    errors=NONE,
    tick_errors=NONE,
)


def test_velocity_is_held_from_the_first_update_to_the_end() -> None:
    held = held_velocity(SPEC, RUN)
    assert (held.time * 20_000).round().astype(int).tolist() == [41 + AFTER, 61 + AFTER, 81 + AFTER]
    assert held.velocity_rad_s.tolist() == [3 * LSB, 3 * LSB, -5 * LSB]


def test_error_statistics() -> None:
    error = velocity_error(held_velocity(SPEC, RUN), lambda t: np.full(len(t), LSB))  # errors are 2, 2, -6 LSB
    assert error is not None
    assert error.mean == pytest.approx(-2 / 3 * LSB)
    assert error.rms == pytest.approx((44 / 3) ** 0.5 * LSB)
    assert error.max == pytest.approx(6 * LSB)


def test_no_update_no_statistics() -> None:
    flags = NONE.astype(np.bool_)
    held = held_velocity(SPEC, replace(RUN, updates=Updates(NONE, NONE, NONE, flags, flags, flags)))
    assert len(held.time) == 0
    assert velocity_error(held, np.sin) is None


def test_csv(tmp_path: Path) -> None:
    write_trace(tmp_path / "t.csv", SPEC, RUN)
    write_counts(tmp_path / "c.csv", RUN)
    assert (tmp_path / "t.csv").read_bytes().decode() == (
        "clock,tick,interval,forced,velocity_raw,velocity_rad_s\n"
        f"{41 + AFTER},1,2,0,3,{3 * LSB!r}\n{81 + AFTER},3,2,1,-5,{-5 * LSB!r}\n"
    )
    more = {"velocity_lower": np.array([-7, 8]), "bounds_valid": np.array([False, True])}
    write_trace(tmp_path / "m.csv", SPEC, replace(RUN, updates=replace(RUN.updates, more=more)))
    lines = (tmp_path / "m.csv").read_text().splitlines()
    assert [line.split(",")[6:] for line in lines] == [list(more), ["-7", "0"], ["8", "1"]]
    assert (tmp_path / "c.csv").read_bytes() == b"tick,pulse_count,position\n0,0,0\n1,1,1\n2,1,2\n3,-2,0\n4,-2,-2\n"
