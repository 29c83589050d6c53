"""Ticks since the update, clock by clock."""

from pathlib import Path

import numpy as np
import pytest
from support.compiled import lint
from support.nightly import only_rows
from support.simulate import clock_by_clock

from tachometry.hdl.export import export
from tachometry.hdl.output import update_age
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import of_texts


def check(fresh_width: int = 0) -> None:
    rng = np.random.default_rng(1)
    rows = [{"tick": int(tick), "update": int(update)} for tick, update in rng.random((400, 2)) < (0.6, 0.15)]
    for row in rows:
        row |= {"fresh": int(rng.integers(8))} if fresh_width else {}
    seen = [row["age"] for row in clock_by_clock(update_age.UpdateAge(5, fresh_width), rows, ["age"])]
    wanted, ticks = [], 0
    for row in rows:
        ticks = (row.get("fresh", 0) if row["update"] else ticks) + row["tick"]
        wanted.append(min(ticks, 5))
    assert seen == wanted
    assert set(wanted) == set(range(6))


def test_counts_ticks_since_the_update() -> None:
    check()
    check(3)


def check_age(method: str, **texts: str) -> None:
    """Ticks since the count, or the tick, that caused the update; those that fall between the two count as well."""
    spec = of_texts(method, {"ppr": "1", "clock": "1MHz", "age": "yes", "frac-bits": "4", "max-time": "40clk"} | texts)
    found = lockstep(spec, stress(spec, 1, 40), PySim())
    assert found.n_mismatches == 0, found.first
    run, ticks = found.actual, found.actual.ticks.clock
    # Of an update without a filter the cause is always as long ago.
    cause = np.append(-1, run.updates.clock - spec.latency.tick_to_velocity)
    last = cause[np.searchsorted(run.updates.clock, ticks, side="right")]
    since = [np.count_nonzero((ticks > then) & (ticks <= now)) for then, now in zip(last, ticks, strict=True)]
    assert run.ticks["age"].tolist() == np.minimum(since, spec.timing.max_ticks).tolist()
    inside = [((ticks > now - spec.latency.tick_to_velocity) & (ticks < now)).any() for now in run.updates.clock]
    assert any(inside)


SHORT = [
    ("s", {"tick": "1clk"}),
    ("m", {"tick": "2clk", "average": "3", "velocity-width": "8"}),
    ("t", {"tick": "4clk"}),
    ("mt", {"tick": "4clk", "min-time": "8clk", "timer": "tick"}),
    ("t", {"tick": "40clk", "max-time": "400clk"}),
    ("rairan", {"tick": "1clk", "velocity-width": "8"}),
]


# One of those that wait for ticks, and one that does not.
@pytest.mark.parametrize(("method", "texts"), only_rows([SHORT[0], SHORT[-1]], SHORT))
def test_a_tick_between_cause_and_update_counts(method: str, texts: dict[str, str]) -> None:
    check_age(method, **texts)


def test_with_a_filter_that_is_slower_than_a_tick() -> None:
    spec = of_texts(
        "s", {"ppr": "1", "clock": "1MHz", "tick": "4clk", "max-time": "40clk", "age": "yes", "lowpass": "1kHz"}
    )
    found = lockstep(spec, stress(spec, 1, 40), PySim())
    assert found.n_mismatches == 0, found.first
    assert found.actual.ticks["age"].max() > spec.latency.low_pass // 4


def test_verilator_has_no_warning_where_the_greatest_age_fills_its_bits(tmp_path: Path) -> None:
    spec = of_texts("rairan", {"ppr": "500", "clock": "48MHz", "tick": "1clk", "max-time": "3clk", "age": "yes"})
    (tmp_path / "core.v").write_text(export(spec, "core")["core.v"])
    lint(["core.v"], "core", tmp_path)
