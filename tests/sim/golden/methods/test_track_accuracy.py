"""The errors of the tracking method, beside those of an independent model in floating point."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from motions import SITUATIONS, Situation
from numpy.typing import NDArray
from support.nightly import nightly, only, only_rows
from support.script import load
from support.tracking import core

from tachometry.spec import TrackTachometer

SPEC = core(tick="100us", max_time="100ms", max_speed="1000rad/s")
ROWS = {situation.name: situation for situation in SITUATIONS}
BENCH = load("tracking")


def errors(situation: Situation, seed: int, beside: bool = False, spec: TrackTachometer = SPEC) -> tuple[float, float]:
    """Return the RMS in rad/s of the golden model at its updates, and that of the independent one."""
    found = BENCH.errors(spec, situation, seed, beside)
    return BENCH.rms(found.core), BENCH.rms(found.model)


@pytest.mark.parametrize("name", ["reversals, real", "slow sine, real", "fast sine, real"])
def test_quality_covers_the_error_in_about_two_ticks_of_three(name: str) -> None:
    assert 58 < BENCH.errors(SPEC, ROWS[name], 401).covered < 78


# One of each kind of motion; where a speed is constant and the disc ideal only the rounding is left.
QUICK = ["ramp, real", "fast, jitter", "reversals, real", "slow sine, real", "fast sine", "trapezoid, real", "stop"]
ROUNDED = ["very slow", "fast", "rest on an edge"]


@pytest.mark.parametrize("name", only(QUICK, [name for name in ROWS if name not in ROUNDED]))
def test_the_errors_are_those_of_an_independent_model(name: str) -> None:
    seeds = (401,) if name in QUICK else (401, 402, 403)
    own, other = np.mean(np.square([errors(ROWS[name], seed, beside=True) for seed in seeds]), axis=0) ** 0.5
    assert own < 1.1 * other
    if name in QUICK:  # of others few events decide, in which it may be better by chance
        assert own > 0.9 * other


@pytest.mark.parametrize(
    "faults", [{"lost": "0.001"}, {"illegal": "0.001"}, {"illegal": "0.01", "jitter": "0.05"}], ids=str
)
def test_lines_at_fault(faults: dict[str, str]) -> None:
    """Edges are lost, and so are counts where both lines change at once."""
    own, other = errors(replace(ROWS["trapezoid, real"], faults=faults), 1, beside=True)
    assert 0.85 * other < own < 1.1 * other


OTHER_CORES = [
    {"tick": "8us"}, {"tick": "1ms"}, {"clock": "12MHz"}, {"clock": "100MHz"}, {"decoding": "1"}, {"decoding": "2"},
    {"ppr": "16"}, {"ppr": "10000"},
]  # fmt: skip


@nightly
@pytest.mark.parametrize("name", ["ramp, real", "reversals, real", "slow sine, real"])
@pytest.mark.parametrize("options", OTHER_CORES, ids=str)
def test_other_cores_and_discs_are_as_good(options: dict[str, str], name: str) -> None:
    spec = core(**{"tick": "100us", "max_time": "100ms", "max_speed": "400rad/s", **options})
    situation = replace(ROWS[name], lines=spec.encoder.pulses_per_rev)
    own, other = np.mean(np.square([errors(situation, seed, True, spec) for seed in (401, 402)]), axis=0) ** 0.5
    assert own < 1.1 * other


@pytest.mark.parametrize(("lines", "seeds"), only_rows([(2000, 8)], [(2000, 8), (500, 40), (1000, 40)]))
def test_many_counts_in_the_first_events_are_forgotten(lines: int, seeds: int) -> None:
    """Their mean place and time are off by 0.4 %, which once stayed in the memory for as long as it grew."""
    spec = core(tick="1ms", max_time="100ms", max_speed="400rad/s", ppr=str(lines))
    fast = replace(ROWS["fast, real"], lines=lines)
    own, other = np.mean(np.square([errors(fast, seed, True, spec) for seed in range(401, 401 + seeds)]), axis=0)
    assert own < 1.2**2 * other


def test_a_fine_disc_is_not_limited_by_the_lsb_of_the_acceleration() -> None:
    """100,000 rad/s² of a disc of 5000 lines once had to fit its word, which doubled the error at a constant speed."""
    spec = core(max_time="100ms", max_speed="400rad/s", ppr="5000", tick="100us")
    slow = replace(ROWS["very slow, real"], lines=5000)
    own, other = np.mean(np.square([errors(slow, seed, True, spec) for seed in range(401, 405)]), axis=0)
    assert own < 1.2**2 * other


def test_a_memory_that_keeps_falling_grows_again() -> None:
    """In reversals with many counts in a tick it once fell below 0, and the velocity was off by a tenth of it."""
    spec = core(tick="1ms", max_time="100ms", max_speed="400rad/s", ppr="2000")
    own, other = errors(replace(ROWS["reversals, real"], lines=2000), 404, True, spec)
    assert own < 1.1 * other


@pytest.mark.parametrize("share", only([1, 1.001], [0.999, 1, 1.001]))
def test_the_greatest_speed_is_measured_as_well_as_others(share: float) -> None:
    """On a bad disc, whose edges are nearer to each other than at the greatest speed, and up to the full scale."""
    other, greatest = (
        errors(replace(ROWS["fast, bad"], motion=f"constant:{1000 * part}rad/s:200ms"), 401)[0] for part in (0.5, share)
    )
    assert greatest < 1.2 * other


def test_a_speed_that_begins_to_change_gently_is_followed() -> None:
    """The errors grow as slowly as the noise is learned: they are not taken for noise."""
    gentle = replace(ROWS["fast, jitter"], motion="constant:30rad/s:500ms+s-curve:30rad/s:0:1s")
    own, other = errors(gentle, 1, beside=True)
    assert own < 0.04
    assert own == pytest.approx(other, rel=0.1)


# Near the rate of the ticks early and late counts share ticks, so errors in a row are alike: there it once failed.
@pytest.mark.parametrize("rate", only([2], [0.5, 0.98, 1, 2, 2.5]))
def test_no_noise_of_a_disc_is_taken_for_a_change_of_the_speed(rate: float) -> None:
    """In a million counts whose edges are off by chance, of which a threshold of 4·D_s takes some for a change."""
    assert BENCH.steady(SPEC, rate, 0.05, 2).max() < BENCH.ALARM


def test_a_disc_off_centre_raises_no_alarm() -> None:
    """Nor an edge whose jitter is more than five times the standard deviation (seed 32); nor a swing."""
    spec = core(tick="20us", max_time="100ms", max_speed="400rad/s")
    for seed, n in ((2, 500_000), (32, 300_000)):
        assert BENCH.steady(spec, 1.5, 0.05, seed, off_centre=0.25, n=n, first=50_000).max() < BENCH.BURST
    assert BENCH.swinging(220, 60, 5, 0.25, 2).max() < BENCH.BURST


@nightly
@pytest.mark.parametrize("case", list(BENCH.alarm_cases(10)), ids=lambda case: f"{case[0]}, {case[1]}")
def test_false_alarms_are_few(case: tuple[str, str, float, int, Callable[[int], NDArray[np.float64]]]) -> None:
    """None in 10^7 counts at a constant speed or in 10 swings; at most 4 in 200 starts."""
    _, _, limit, runs, run = case
    worst = np.array([run(seed).max() for seed in range(runs)])
    assert np.sum(worst > limit) <= runs // 50
    assert worst.max() < 2.5 * limit
