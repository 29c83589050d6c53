"""The datapath of the tracking method, with injected steps and ticks."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest

import numpy as np
import pytest
from numpy.typing import NDArray
from support import compiled
from support.nightly import nightly, only
from support.simulate import Player, Resettable, clock_by_clock
from support.tracking import core, motions

from tachometry.hdl.methods import track
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods.track import Model
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, Speed, Timing, TrackTachometer

SPEC = TrackTachometer(
    encoder=Encoder(100),
    timing=Timing(1_000_000, 1000, 10),
    frac_bits=20,
    max_speed=Speed.parse("40rad/s"),
    position_width=8,
    position_fine_bits=16,
)
EXTERNAL = replace(
    SPEC, timing=Timing(1_000_000, 1400, 10), external_tick=True, max_tick_cycles=1400, multiplier="serial"
)
NAMES = ["velocity", "acceleration", "position_fine", "velocity_std", "interval", "forced", "standstill"]
REST = ("acceleration", "position_fine", "velocity_std")  # they come with `update_valid`
COMPILED = compiled.clock_by_clock
Update = tuple[int, ...]  # clock, and what the update says


def rows_of(spec: TrackTachometer, steps: Steps, last: NDArray[np.int64]) -> list[dict[str, int]]:
    """Return inputs of every clock, until the last update has come."""
    rows = [{"step": 0, "tick": 0, "rst": 0} for _ in range(int(last[-1]) + spec.latency.native_update + 1)]
    for clock, step in zip(steps.clock.tolist(), steps.step.tolist(), strict=True):
        rows[clock]["step"] = step
    through = np.append(0, np.cumsum(steps.step))[np.searchsorted(steps.clock, last, side="right")]
    half = 1 << (spec.position_width - 1)
    for clock, end in zip(last.tolist(), through.tolist(), strict=True):
        rows[clock] |= {"tick": 1, "position": (end + half) % (2 * half) - half}
    return rows


def updates_of(spec: TrackTachometer, rows: Sequence[Mapping[str, int]], play: Player = COMPILED) -> Iterator[Update]:
    """Yield all updates, with the clock of the velocity; from one to the next the outputs stay."""
    seen = play(Resettable(track.TrackMethod(spec)), rows, ["velocity_valid", "update_valid", *NAMES])
    held, later = dict.fromkeys(NAMES, 0), spec.latency.native_update - spec.latency.datapath
    for clock, (row, given) in enumerate(zip(seen, rows, strict=True)):
        if row["velocity_valid"]:
            held = held | {name: row[name] for name in NAMES if name not in REST}
        if row["update_valid"]:
            held = held | {name: row[name] for name in REST}
            yield clock - later, *held.values()
        assert given["rst"] or all(row[name] == held[name] for name in NAMES)
        held = dict.fromkeys(NAMES, 0) if given["rst"] else held


def golden(spec: TrackTachometer, steps: Steps, last: NDArray[np.int64]) -> list[Update]:
    """Return the updates of the golden model, `datapath_latency` after every tick."""
    through = np.append(0, np.cumsum(steps.step))[np.searchsorted(steps.clock, last, side="right")]
    found = Model(spec).updates(Table(last + spec.latency.tick, {"position": through}), steps, int(last[-1]) + 1)
    columns = [found[name].astype(int).tolist() for name in NAMES]
    return list(zip((last + spec.latency.datapath).tolist(), *columns, strict=True))


def regular(spec: TrackTachometer, speed: float, n_ticks: int, begin: int = 0) -> tuple[Steps, NDArray[np.int64]]:
    """Return a constant speed in counts per tick, and ticks as long as nominal."""
    cycles = spec.timing.tick_cycles
    last = (np.arange(n_ticks) + 1) * cycles - 1
    clock = np.round(begin + (0.3 + np.arange(int(abs(speed) * n_ticks) + 1)) * cycles / abs(speed)).astype(np.int64)
    clock = clock[clock <= last[-1]]
    none = np.empty(0, dtype=np.int64)
    return Steps(clock, np.full(len(clock), 1 if speed > 0 else -1), none, none, none), last


def check(spec: TrackTachometer, steps: Steps, last: NDArray[np.int64]) -> None:
    """Every update, in its clock, with every output."""
    updates = updates_of(spec, rows_of(spec, steps, last))
    for found, right in zip_longest(updates, golden(spec, steps, last)):
        assert found == right


def test_the_fine_position_wraps_as_the_position_does() -> None:
    steps, last = regular(SPEC, 3, 50)
    check(SPEC, steps, last)
    assert golden(SPEC, steps, last) != golden(replace(SPEC, position_width=16), steps, last)


# tests/test_matrix.py has external ticks and the block unit daily, which takes half a minute to be compiled here.
@pytest.mark.parametrize("spec", only([SPEC], [SPEC, EXTERNAL, replace(EXTERNAL, multiplier="block")]), ids=range(3))
def test_hostile_counts(spec: TrackTachometer) -> None:
    check(spec, *motions(spec, np.random.default_rng(3), 200))


@nightly  # tests/test_matrix.py has external ticks daily
def test_latency() -> None:
    """An update comes `datapath_latency` clocks after every tick, whatever was in it, and with the next one."""
    steps, last = motions(EXTERNAL, np.random.default_rng(5), 40)
    last = (np.arange(40) + 1) * EXTERNAL.times.min_tick_cycles - 1
    few = steps.clock <= last[-1]
    steps = Steps(steps.clock[few], steps.step[few], steps.errors, steps.index, steps.swallowed)
    check(EXTERNAL, steps, last)


@pytest.mark.parametrize("seed", only(range(2), range(6)))  # each is at another place of the program
def test_reset(seed: int) -> None:
    """A reset leaves nothing behind, wherever the program is."""
    rng = np.random.default_rng(seed)
    before = rows_of(SPEC, *motions(SPEC, rng, 10))
    before = before[: int(rng.integers(7, 10)) * 1000 + int(rng.integers(0, SPEC.latency.datapath))]
    steps, last = regular(SPEC, float(rng.choice([-1, 1]) * rng.choice([0.4, 1.3, 3.7])), 15, int(rng.integers(2000)))
    after = rows_of(SPEC, steps, last)
    reset = [{"step": 0, "tick": 0, "rst": 1}]
    found = [update for update in updates_of(SPEC, before + reset + after) if update[0] > len(before)]
    assert [(clock - len(before) - 1, *rest) for clock, *rest in found] == golden(SPEC, steps, last)


def test_reset_about_update() -> None:
    """A reset in each of the last clocks before an update: it does not come."""
    nothing = {"step": 0, "tick": 0, "rst": 0}
    rows: list[dict[str, int]] = []
    for before in range(8):
        rows += [nothing | {"tick": 1}, *[nothing] * (SPEC.latency.datapath - before - 1), nothing | {"rst": 1}]
        rows += [nothing] * 6
    # The first one is shown in the clock of the reset.
    assert [clock for clock, *_ in updates_of(SPEC, rows, clock_by_clock)] == [SPEC.latency.datapath]


@pytest.mark.parametrize("multiplier", ["serial", "block"])
def test_no_tick_falls_between_another_and_its_update(multiplier: str) -> None:
    """So the age of an update needs no stamp, however long the filter and the conversion of the widest take."""
    widest = core(age="yes", external_tick="yes", lowpass="100Hz", multiplier=multiplier, tick="50us", frac_bits="21")
    assert widest.velocity.native >= 35
    for spec in (widest, replace(widest, frac_bits=None, unit="rpm", velocity_width=60)):
        assert spec.latency.low_pass + spec.latency.output > 40
        assert not spec.widths.stamp
