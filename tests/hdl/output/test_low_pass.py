"""The low-pass filter's gates against the golden one, with injected updates."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from amaranth import signed
from amaranth.lib import data
from support.simulate import clock_by_clock

from tachometry.hdl.output import low_pass
from tachometry.sim.golden.low_pass import filtered
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, STachometer, Timing


class Resting(STachometer):
    """An S tachometer whose updates that `rests` are taken as they are."""

    facts = replace(STachometer.facts, last_at_rest=True)


ONE_TABLE = Resting(encoder=Encoder(500), timing=Timing(48_000_000, 20, 60), frac_bits=6, lowpass=Fraction(100_000))
TWO_TABLES = replace(ONE_TABLE, timing=Timing(48_000_000, 20, 5000), lowpass=Fraction(2000))


LAYOUT = data.StructLayout({"velocity": signed(ONE_TABLE.velocity.native), "rests": 1, "tag": 4})
COLUMNS = ("filtered.p.velocity", "filtered.p.tag")


def check(spec: STachometer, n: int = 150) -> None:
    """Updates far apart, close together, and while another waits."""
    form = spec.velocity.low_pass
    rng = np.random.default_rng(2)
    gaps = np.where(rng.random(n) < 0.5, form.latency + rng.integers(-4, 4, n), rng.integers(1, form.latency, n))
    gaps[50] = 800  # more ticks than it can count
    came = np.cumsum(gaps)
    most = spec.tick.max_count << spec.velocity.native_frac_bits
    velocity = rng.integers(-most, most + 1, n)
    n_clocks = int(came[-1]) + 2 * form.latency
    # Many ticks, or none, or too many.
    tick = np.flatnonzero(
        rng.random(n_clocks) < np.repeat(rng.choice([0, 0.02, 0.9], n_clocks // 50 + 1), 50)[:n_clocks]
    )
    clears = rng.random(n) < 0.1
    updates = Table(came, {"velocity": velocity, "rests": clears, "tag": np.arange(n) % 16})
    wanted = filtered(spec, Table(tick, {}), updates)
    at = {clock: k for k, clock in enumerate(came.tolist())}
    ticks = set(tick.tolist())
    rows = []
    for clock in range(n_clocks):
        k = at.get(clock, 0)
        known = {"velocity": int(velocity[k]), "rests": int(clears[k]), "tag": k % 16}
        rows.append({"velocity_valid": int(clock in at), "tick": int(clock in ticks), **known})
    seen = clock_by_clock(low_pass.LowPass(form, LAYOUT, clears=True), rows, ["filtered.valid", *COLUMNS])
    got = [(k, *(row[name] for name in COLUMNS)) for k, row in enumerate(seen) if row["filtered.valid"]]
    columns = (wanted.clock, wanted.velocity, wanted["tag"])
    assert got == list(zip(*(column.tolist() for column in columns), strict=True))
    assert len(got) < n


@pytest.mark.parametrize("spec", [ONE_TABLE, TWO_TABLES], ids=["one table", "two tables"])
def test_as_the_golden_one(spec: STachometer) -> None:
    assert len(spec.velocity.low_pass.tables) == (2 if spec is TWO_TABLES else 1)
    check(spec)
