"""The tables of a run, on a run made by hand."""

from pathlib import Path

import numpy as np
import pytest

from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.signals.recording import Recording
from tachometry.sim.signals.run import Run, Table
from tachometry.sim.signals.tables import held_velocity, velocity_error, write_counts, write_events, write_trace
from tachometry.spec import AxesSpec, Encoder, STachometer, Timing, of_texts

SPEC = STachometer(encoder=Encoder(100), timing=Timing(20_000, 20, 10))
LSB = SPEC.velocity.rad_per_s_per_lsb
AFTER = SPEC.latency.tick_to_velocity
# Ticks 0 to 4; ticks 1 and 3 cause an update; the clocks end before an update of tick 4 could come.
TICK = np.array([21, 41, 61, 81, 101])
TICKS = Table(TICK, {"pulse_count": np.array([0, 1, 1, -2, -2]), "position": np.array([0, 1, 2, 0, -2])})
UPDATES = Table(
    TICK[[1, 3]] + AFTER,
    {"velocity": np.array([3, -5]), "interval": np.array([2, 2]), "forced": np.array([False, True])},
)


def run_of(updates: Table) -> Run:
    return Run(101 + AFTER, {"tick": TICKS, "velocity_valid": updates})


RUN = run_of(UPDATES)


def test_velocity_is_held_from_the_first_update_to_the_end() -> None:
    held = held_velocity(SPEC, RUN)
    assert (held.time * 20_000).round().astype(int).tolist() == [41 + AFTER, 61 + AFTER, 81 + AFTER]
    assert held.velocity_rad_s.tolist() == [3 * LSB, 3 * LSB, -5 * LSB]


def test_memory_does_not_grow_with_the_clocks() -> None:
    """Of what is as long as years, a list of ticks would not fit."""
    late = held_velocity(SPEC, Run(1 << 50, RUN.tables))
    assert late.time[:3].tolist() == held_velocity(SPEC, RUN).time.tolist()


def test_error_statistics() -> None:
    error = velocity_error(held_velocity(SPEC, RUN), lambda t: np.full(len(t), LSB))  # errors are 2, 2, -6 LSB
    assert error is not None
    assert error.mean == pytest.approx(-2 / 3 * LSB)
    assert error.rms == pytest.approx((44 / 3) ** 0.5 * LSB)
    assert error.max == pytest.approx(6 * LSB)


def test_no_update_no_statistics() -> None:
    held = held_velocity(SPEC, run_of(UPDATES.rows(slice(0))))
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
    write_trace(tmp_path / "m.csv", SPEC, run_of(UPDATES.having(**more)))
    lines = (tmp_path / "m.csv").read_text().splitlines()
    assert [line.split(",")[6:] for line in lines] == [list(more), ["-7", "0"], ["8", "1"]]
    assert (tmp_path / "c.csv").read_bytes() == b"tick,pulse_count,position\n0,0,0\n1,1,1\n2,1,2\n3,-2,0\n4,-2,-2\n"


def test_numbers_of_one_bit_are_numbers(tmp_path: Path) -> None:
    one = np.array([True, False])
    write_trace(tmp_path / "t.csv", SPEC, run_of(UPDATES.having(interval=one)))
    assert [line.split(",")[2] for line in (tmp_path / "t.csv").read_text().splitlines()] == ["interval", "1", "0"]
    write_events(tmp_path / "e.csv", Run(9, {"probe_valid_0": Table(np.array([3, 5]), {"probe_time_0": one})}))
    assert (tmp_path / "e.csv").read_text().split() == [
        "clock,event,probe_time_0",
        "3,probe_valid_0,1",
        "5,probe_valid_0,0",
    ]


def test_all_axes_together_have_as_many_ticks_as_one_may() -> None:
    alone = of_texts("s", {"ppr": "25", "clock": "20kHz", "tick": "2ms", "max-time": "8ms"})
    assert isinstance(alone, STachometer)
    low = np.zeros(1, dtype=np.uint8)
    spec = AxesSpec(tachometer=alone, axes=4)

    def placed(seconds: float) -> AxesTrace:
        return AxesTrace.placed([Recording(np.zeros(1), low, low, seconds)] * 4, spec)

    assert placed(5000).n_clocks == 100_000_000
    with pytest.raises(ValueError, match=r"^what is run must have at most 2500000 ticks of each of 4 axes, 5000s of "):
        placed(5000.002)
