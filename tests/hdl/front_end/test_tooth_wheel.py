"""Wheels of a pattern: no gap and no extra tooth shows, wherever the shaft begins and whatever it does."""

from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from support.nightly import only
from support.verilog import run_in_icarus

from tachometry.hdl.front_end import decoder
from tachometry.hdl.front_end.tooth_wheel import ExtraDropper, GapFiller, wheel_of
from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.stress import stress
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.golden.tooth_wheel import filled
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import METHODS, TachometerSpec, of_options, of_texts
from tachometry.spec.core.tooth_wheel import ToothWheel

BASE = {"clock": "1MHz", "max-time": "40ms", "sensor": "pulses"}
WHEELS = ("4-1", "12-2", "9-3", "20-4", "60-2")
# Subaru's wheel, gaps of unequal length, and an extra tooth among them; where the index comes, in counts.
PATTERNS = {"36-2-2-2": {12}, "15-2,3-2,18-2": {36}, "44-2-2": {22}, "36-2-1": {36}, "24+1": {24}}


def spec_of(wheel: str, method: str = "t", **more: str) -> TachometerSpec:
    texts = {
        **BASE,
        "tick": "1ms" if method == "track" else "200us",
        "ppr": str(sum(int(part.replace("+", "-").split("-")[0]) for part in wheel.split(","))),
        "teeth": wheel,
    }
    return of_texts(method, texts | {name.replace("_", "-"): text for name, text in more.items()})


def turned(spec: TachometerSpec, motion: str, start: float = 0.0) -> tuple[Encoding, Run]:
    """Return what the shaft did, and what the golden model shows of it."""
    truth = VirtualEncoder.of(spec.encoder, start_angle_rad=start).record(parse_motion(motion))
    return truth, golden.run(spec, PinTrace.of(truth.recording, spec))


# Of two or more missing teeth the gap is filled more than once; Icarus has another wheel.
@pytest.mark.parametrize("wheel", only(["9-3"], WHEELS[:3]))
@pytest.mark.parametrize("wrong", only([False], [False, True]))
def test_every_bit_of_stress(wrong: bool, wheel: str) -> None:
    """Also backward, where a wheel without direction has its gap elsewhere, and is told so."""
    spec = spec_of(wheel, "s", index="yes", index_reset="yes", reverse="yes", invert="a", max_time="4ms", tick="40us")
    check(spec, stress(spec, 1, 60), wrong)


def check(spec: TachometerSpec, trace: PinTrace, wrong: bool) -> None:
    """Compare every bit of a core, which differs where it is `wrong`."""
    with patch.object(decoder, "wheel_of", _wrong if wrong else wheel_of):
        found = lockstep(spec, trace, PySim())
    assert bool(found.n_mismatches) == wrong, found.first
    assert wrong or len(found.actual.errors)
    assert wrong or len(found.actual.index) > 3
    assert wrong or 0 < np.count_nonzero(found.actual.ticks.synced) < len(found.actual.ticks)


def _wrong(wheel: ToothWheel) -> GapFiller | ExtraDropper:
    """Return the box of a wheel with a longer gap, or with another tooth before the extra one."""
    gaps = (*wheel.gaps[1:], *(gap + 1 for gap in wheel.gaps[:1]))
    return wheel_of(replace(wheel, gaps=gaps, teeth=wheel.teeth + (not gaps)))


@pytest.mark.parametrize(
    "wheel", only(["5-2,8-2,3-2", "8-1,6-2", "7+1"], ["12-2", "12-1-1-2", "8-1,6-2", "5-2,8-2,3-2", "7+1"])
)
@pytest.mark.parametrize("wrong", only([False], [False, True]))
def test_every_bit_of_a_wheel_that_loses_and_gains_teeth(wrong: bool, wheel: str) -> None:
    spec = spec_of(wheel, "m", index="yes", max_time="2ms", tick="40us")
    encoder = VirtualEncoder.of(spec.encoder, jitter=0.3, lost=0.01, seed=4)
    check(spec, PinTrace.of(encoder.record(parse_motion("constant:15000rad/s:12ms")).recording, spec), wrong)


def test_before_the_first_tooth_there_is_no_period() -> None:
    assert not len(filled(ToothWheel(11, (1,), longest=255), np.array([300, 390]), 1000).index)


def test_exported_verilog_in_icarus(tmp_path: Path) -> None:
    spec = spec_of("12-2", "m", index="yes", filter="2")
    trace = stress(spec, 2, 40)
    expected, found = golden.run(spec, trace), run_in_icarus(spec, tmp_path, trace)
    for strobe, table in expected.tables.items():
        assert table.clock.tolist() == found.tables[strobe].clock.tolist()
        for name, column in table.columns.items():
            if name != "cause":
                assert column.astype(int).tolist() == found.tables[strobe][name].astype(int).tolist(), name
    assert len(expected.index) > 3


@pytest.mark.parametrize("method", METHODS)
def test_the_gap_does_not_show_in_the_velocity(method: str) -> None:
    """A wheel with a gap is as good as a full one, from the second turn on."""
    spec = spec_of("36-1", method)
    motion = "constant:80rad/s:400ms"
    run = turned(spec, motion)[1]
    full = of_texts(method, {name: text for name, text in spec.options.items() if name not in ("method", "teeth")})
    wheel = golden.run(full, PinTrace.of(VirtualEncoder.of(full.encoder).record(parse_motion(motion)).recording, full))
    shown, wanted = (each.updates.velocity[each.updates.clock > 200_000] for each in (run, wheel))
    least = wanted.min() // 300 if method == "track" else 2  # it remembers the first gap
    assert shown.min() >= wanted.min() - least
    assert shown.max() <= wanted.max() + least
    assert np.all(run.ticks.synced[run.ticks.clock > 85_000])


@pytest.mark.parametrize("wheel", WHEELS)
def test_a_shaft_that_starts_anywhere_is_known_within_a_turn(wheel: str) -> None:
    """From standstill, in acceleration; the count is that of a full wheel, and the index always at one place."""
    spec, missing = spec_of(wheel, index="yes"), int(wheel[-1])
    rng = np.random.default_rng(5)
    for start in rng.uniform(0, 2 * np.pi, 12):
        truth, run = turned(spec, "ramp:0:160rad/s:600ms", start)
        assert len(run.errors) == 0
        assert {*np.diff(run.index.index_position)} == {spec.encoder.pulses_per_rev}
        first = (run.index.clock[0] - spec.latency.tick - spec.latency.pin_to_count) / 1e6
        counted = np.diff(truth.true_position([first, truth.motion.duration], 1))[0]
        assert abs(run.ticks.position[-1] - run.index.index_position[0] - counted) <= 1
        # A turn after so many teeth that their distances do not differ too much; it may begin in the gap.
        turn = 133.4 * first**2 * spec.encoder.pulses_per_rev / (2 * np.pi)
        assert turn <= spec.encoder.pulses_per_rev + {1: 5, 2: 6, 3: 8, 4: 11}[missing]
        # The acceleration goes on through the gap, and shows with the first tooth after it.
        late = run.updates.clock > 1e6 * first + 100_000
        speed = truth.true_speed(run.updates.clock[late] / 1e6)
        off = run.updates.velocity[late] * spec.velocity.rad_per_s_per_lsb - speed
        a_tooth = 267 * 2 * np.pi / spec.encoder.pulses_per_rev / speed  # change of the speed
        most = missing * (missing + 1) / 2 + 3
        assert np.all(np.abs(off) < 1.25 * most * a_tooth + 0.01 * speed)


@pytest.mark.parametrize("wheel", PATTERNS)
@pytest.mark.parametrize("motion", ["constant:80rad/s:600ms", "ramp:0:160rad/s:800ms"])
def test_patterns_are_known_a_turn_after_a_gap(wheel: str, motion: str) -> None:
    """A turn has the counts of a full wheel, and the index comes at the same places."""
    spec = spec_of(wheel, index="yes")
    for start in np.random.default_rng(6).uniform(0, 2 * np.pi, 8):
        truth, run = turned(spec, motion, start)
        assert len(run.errors) == 0
        assert run.ticks.synced[-1]
        assert {*np.diff(run.index.index_position)} == PATTERNS[wheel]
        ends = run.ticks.clock[np.flatnonzero(run.ticks.synced)[[0, -1]]] - spec.latency.tick - 3
        position = run.ticks.position[np.flatnonzero(run.ticks.synced)[[0, -1]]]
        counted = truth.true_position(ends / 1e6, 1)
        assert abs(np.diff(position)[0] - np.diff(counted)[0]) <= 1
        assert truth.motion.angle(ends[0] / 1e6) <= 2 * 2 * np.pi


@pytest.mark.parametrize("change", ["lost", "extra"])
def test_a_tooth_too_many_or_too_few_is_told_at_the_gap(change: str) -> None:
    wheel = ToothWheel(10, (2,), 1023)
    teeth = np.array([100 * turn * 12 + 100 * tooth for turn in range(5) for tooth in range(10)])
    place = 24  # of the third turn
    teeth = np.delete(teeth, place) if change == "lost" else np.insert(teeth, place, teeth[place] - 50)
    found = filled(wheel, teeth, 6000)
    assert found.index[:2].tolist() == [1200, 2400]
    assert len(found.errors) == 1
    assert 3300 <= found.errors[0] <= 3800
    assert found.index[-1] == 4800


def test_ports_name_the_gap() -> None:
    spec = spec_of("60-2", index="yes")
    assert of_options(spec.options) == spec
    texts = {port.name: port.help for port in spec.ports}
    assert "z" not in texts
    assert texts["index_valid"] == "One clock for every first tooth after a gap."
    assert texts["index_position"].startswith("Position at the first tooth after a gap, ")
    assert texts["decode_error"].startswith("One clock: the gap was not where it had to be")
