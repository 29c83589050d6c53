"""The golden tracking method: its twins in C++ and in Python, and where the recursion of before did not settle."""

from collections.abc import Iterable
from copy import deepcopy
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import nightly, only
from support.tracking import core, windows

from tachometry.sim import build, golden
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods import track
from tachometry.sim.golden.methods.track_recursion import TRACKS, Recursion
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.spec import TrackTachometer
from tachometry.spec.formats.tracking import GAIN_STEPS, LOG_BITS, PLACE_BITS, WIDTH, Tracking

CORES = {
    "default": core(),
    "external": core(external_tick="yes", max_tick_period="683us", decoding="2"),
    "few lines": core(ppr="16", decoding="1", frac_bits="4"),
    "many lines": core(ppr="81000", multiplier="block"),
    "slow clock": core(clock="12MHz", tick="100us", max_speed="500rad/s"),
    "fast clock": core(clock="100MHz", max_memory="5ms", max_time="1s"),
    "long ticks": core(tick="1ms", max_speed="1000rad/s", max_time="20ms"),
}


def compiled(spec: TrackTachometer, held: track.Windows) -> NDArray[np.int64]:
    """Return what the twin in C++ shows."""
    found = track.compiled(tuple(track.constants_of(spec.form, spec.program.ahead)))
    assert found
    return found(spec.form, spec.program.ahead)(held)


@pytest.mark.parametrize("name", CORES)
def test_twins(name: str) -> None:
    """The C++ shows what the Python shows, bit by bit, and all of it changes."""
    spec = CORES[name]
    held = windows(spec, 1, 1500)
    right = track.rows(spec.form, spec.program.ahead)(held)
    assert np.array_equal(compiled(spec, held), right)
    assert all(len(np.unique(column)) > 30 for column in right.T[:4])


# Speeds and accelerations are the greatest in bursts at the shortest distance, of which the first core has many.
@pytest.mark.parametrize("name", only(["default"], CORES))
def test_what_is_shown_fits_the_ports(name: str) -> None:
    spec = CORES[name]
    velocity, _, velocity_std, acceleration, _ = np.concatenate(
        [compiled(spec, windows(spec, seed, 20_000)) for seed in range(2)]
    )[:, :5].T
    assert np.abs(velocity).max() < 1 << spec.velocity.native - 1
    assert velocity_std.min() >= 0
    assert velocity_std.max() < 1 << spec.form.std_bits
    assert 1 << spec.acceleration.width - 3 < np.abs(acceleration).max() < 1 << spec.acceleration.width - 1


@nightly
@pytest.mark.parametrize("seed", range(10))
def test_states_stay_within_their_words(seed: int) -> None:
    """In 10^5 ticks, from one to the next."""
    spec = CORES[[*CORES][seed % len(CORES)]]
    state, held = Recursion(spec.form, spec.program.ahead), windows(spec, seed, 10_000)
    words = [name for name, value in vars(state).items() if isinstance(value, int)]
    for row in held.rows():
        state.tick(*row)
        assert max(abs(value) for value in [*(getattr(state, word) for word in words), *state.offsets]) < 1 << WIDTH - 1
        assert all(abs(offset) <= spec.form.constants["count"] for offset in state.offsets)


@pytest.mark.parametrize("seed", only([1], range(12)))
def test_the_fine_position_stays_at_an_edge_that_no_count_has_shown(seed: int) -> None:
    """In ticks without a count, on all motions; the place of the edge is the one that was learned."""
    spec = CORES["default"]
    state, held = Recursion(spec.form, spec.program.ahead), 0
    for row in windows(spec, seed, 3000).rows():
        number, end = row[0], row[7]
        place = state.tick(*row)[1]
        if not number and state.phase == TRACKS:
            upper = max((1 << PLACE_BITS - 1) - state.offsets[end], 0)
            lower = min(-(1 << PLACE_BITS - 1) - state.offsets[(end - 1) & 3], 0)
            assert lower <= place <= upper
            held += place in (lower, upper)
    assert held > 100


@pytest.mark.parametrize("name", only(["external"], CORES))
def test_a_shaft_at_standstill_has_no_velocity(name: str) -> None:
    """Both come with the first tick that ends when the last count, or the reset, is the maximum time ago.

    Ticks of the first core come from outside, and their lengths differ.
    """
    spec = CORES[name]
    spec = replace(spec, timing=replace(spec.timing, max_ticks=40))
    held = windows(spec, 1, 2500)
    end = np.cumsum(held.length)
    latest = np.maximum.accumulate(np.where(held.number > 0, end - held.last, 0))
    velocity, *_, standstill = compiled(spec, held)[:, :5].T
    assert np.array_equal(standstill, (held.number == 0) & (end - latest >= spec.form.max_time))
    assert not velocity[standstill > 0].any()
    assert velocity[np.flatnonzero(np.diff(standstill) > 0)].any()


def test_gains_are_those_of_least_squares() -> None:
    """Of a parabola through n places with X = 1/n, at the last, where the table has nearly that X."""
    form = CORES["default"].form
    scale = np.array([0, form.velocity_bits, form.acceleration_bits]) - [0, PLACE_BITS, PLACE_BITS - 1]
    logs = np.array(form.gains).T / 2**LOG_BITS - scale - np.arange(3) * form.time_bits
    exact = 2 ** (2 + (np.arange(len(logs)) + 0.5) / GAIN_STEPS)
    for nth in np.flatnonzero(np.abs(exact / np.round(exact) - 1) < 0.01):
        n = round(exact[nth])
        last = np.linalg.pinv(np.vander(np.arange(1 - n, 1), 3, increasing=True))[:, -1]
        assert logs[nth] == pytest.approx(np.log2(last * float(n) ** np.arange(1, 4)), abs=0.03), n


def trace_of(clock: NDArray[np.int64], position: NDArray[np.int64]) -> PinTrace:
    """Return the lines of a shaft that is at these positions from these clocks on."""
    level = quadrature(np.append(0, position))
    return PinTrace(np.append(0, clock), level & np.uint8(1), level >> np.uint8(1), int(clock[-1]) + 10)


def test_without_a_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """The Python is used, and shows the same."""
    spec = core()
    trace = trace_of(np.arange(1, 300) ** 2 * 5, np.arange(1, 300))
    right = golden.run(spec, trace).updates
    used: list[int] = []
    python = track.rows

    def rows(form: Tracking, lead: int) -> track.Rows:
        used.append(lead)
        return python(form, lead)

    track.compiled.cache_clear()
    monkeypatch.setattr(build, "find_compiler", lambda: None)
    monkeypatch.setattr(track, "rows", rows)
    found = golden.run(spec, trace).updates
    track.compiled.cache_clear()
    assert used
    assert right.velocity.any()
    for name in ("velocity", "acceleration", "position_fine"):
        assert np.array_equal(found[name], right[name])


def test_pieces_of_a_run_are_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ticks are computed some at a time, as if at once."""
    spec = core(tick="100us", max_time="10ms")
    position = np.cumsum(np.sign(np.sin(np.arange(300) / 20)).astype(np.int64))
    trace = trace_of(np.cumsum(np.arange(300) % 60 * 300 + 500), position)
    right = golden.run(spec, trace).updates
    monkeypatch.setattr(track, "_PIECE", 7)
    found = golden.run(spec, trace).updates
    assert len(found) > 500
    assert all(np.array_equal(found[name], right[name]) for name in right.columns)


def places(start: str, gap: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return clocks and positions of counts, at last with `gap` clocks in between."""
    clock = np.round(np.arange(1, 1500) * gap).astype(np.int64)
    forward = np.arange(1, 1500)
    if start == "reversal":
        return np.append(clock, clock[-1] + clock), np.append(forward, 1499 - forward)
    slow = 2 * clock[:500]
    return np.append(slow, slow[-1] + clock), np.append(forward[:500], 500 + forward - 1)


@pytest.mark.parametrize("start", ["reversal", "doubled speed"])
def test_a_constant_speed_is_settled_upon(start: str) -> None:
    """A tick without a count at nearly a count per tick must not throw the velocity away."""
    spec = core(max_speed="1000rad/s")
    for counts_per_tick in (0.5, 0.75, 0.9, 0.95, 1.05):
        trace = trace_of(*places(start, spec.timing.tick_cycles / counts_per_tick))
        velocity = golden.run(spec, trace).updates.velocity[-300:] / 2.0**spec.velocity.frac_bits
        assert np.abs(velocity) == pytest.approx(np.full(300, counts_per_tick), rel=2e-3), counts_per_tick


def test_a_ramp_has_its_acceleration() -> None:
    spec, count = core(), np.arange(1, 1500)
    clock = np.round(spec.timing.tick_cycles * np.sqrt(750 * count)).astype(np.int64)
    run, lsb = golden.run(spec, trace_of(clock, count)), spec.acceleration.rad_per_s2_per_lsb
    shown = run.updates.acceleration[-100:] * lsb
    right = 2 / 750 / float(spec.timing.tick_seconds) ** 2 * 2 * np.pi / spec.encoder.counts_per_rev
    assert shown == pytest.approx(np.full(100, right), rel=1e-4)


def test_quality_of_the_first_velocity_is_more_than_all_of_it() -> None:
    """After a reset nothing is known of the noise, so an edge may be off by a quarter of a count."""
    spec = core()
    found = golden.run(spec, trace_of(np.arange(1, 500) * 10 * spec.timing.tick_cycles, np.arange(1, 500))).updates
    first = np.flatnonzero(found.velocity)[0]
    assert found.velocity[first] < found.velocity_std[first] < 2 * found.velocity[first]
    assert found.velocity_std[-1] == 1


def test_quality_is_the_velocity_at_least_while_the_shaft_has_stopped() -> None:
    """An LSB before, until the next edge is overdue; all of the velocity then; 0 when it is forgotten."""
    spec = core(unit="rpm", max_time="50ms")
    cycles = spec.timing.tick_cycles
    moves = trace_of(np.arange(1, 500) * 10 * cycles, np.arange(1, 500))
    found = golden.run(spec, replace(moves, n_clocks=moves.n_clocks + 7500 * cycles)).updates
    assert (found.velocity_std[2000:4990] == 1).all()
    silent = slice(5005, 7400)
    assert (found.velocity[silent] <= found.velocity_std[silent]).all()
    assert (found.velocity_std[silent] < found.velocity[silent] * 1.01).all()
    assert (found.velocity[7600:] == 0).all()
    assert found.velocity_std[9900] > 0
    assert not found.velocity_std[10_100:].any()


def test_quality_is_greater_after_counts_were_lost() -> None:
    """The place is that of one event then, which leaves an error in the velocity; this is forgotten, and so is that."""
    spec, n, lost = core(), 20_000, 12_000
    kept, at = np.r_[:lost, lost + 4 : n - 1], round(lost / 0.9)
    covered, last = [], []
    for seed in range(6):
        place = np.arange(1, n) + np.random.default_rng(seed).normal(0, 0.1, n - 1)
        clock = np.round(place * spec.timing.tick_cycles / 0.9).astype(np.int64)  # so a tick holds a count, or none
        found = golden.run(spec, trace_of(clock[kept], np.arange(1, len(kept) + 1))).updates
        wrong = np.abs(found.velocity - np.median(found.velocity))
        before, after = found.velocity_std[at - 10], found.velocity_std[at + 10 : at + 3000]
        assert wrong[at + 10 : at + 3000].max() > 20 * before
        assert after[0] > 15 * before
        covered.append(np.mean(wrong[at + 10 : at + 3000] <= after))
        last.append(found.velocity_std[-1] / before)
    assert 0.5 < np.mean(covered) < 0.9
    assert np.median(last) < 2


WORDS = ("noise", "noises", "turn", 0, 1, 2, 3)  # what outlives a rest; numbers are those of offsets
_SETTLED, _RIGHT, _END = 900, 1300, 2400  # counts until an upset, after which all is right again, that are played


def check_upsets(words: Iterable[str | int], bits: Iterable[int]) -> None:
    """Flip bits of what outlives a rest: 1,300 counts later the velocity is right to 1e-3, and it stays so."""
    spec = core(max_speed="400rad/s")
    n = _SETTLED + _END
    gap = 3 * spec.timing.tick_cycles
    disc = np.resize(np.array([0.1, -0.05, 0.02, -0.07]) * gap, n)
    clock = np.round(np.arange(1, n + 1) * gap + disc).astype(np.int64)
    none = np.empty(0, np.int64)
    steps = Steps(clock, np.ones(n, np.int8), none, none, none)
    last = np.arange(spec.timing.tick_cycles - 1, clock[-1], spec.timing.tick_cycles)
    rows = list(track.Windows.of(steps, last, spec.form.most_number).rows())
    state = Recursion(spec.form, spec.program.ahead)
    for row in rows[: 3 * _SETTLED]:
        state.tick(*row)
    right = pytest.approx(np.full(3 * (_END - _RIGHT) - 9, 2.0**spec.form.velocity_out / 3), rel=1e-3)
    for word, bit in product(words, bits):
        upset = deepcopy(state)
        if isinstance(word, int):
            upset.offsets[word] = flipped(upset.offsets[word], bit)
        else:
            setattr(upset, word, flipped(getattr(upset, word), bit))
        shown = [upset.tick(*row)[0] for row in rows[3 * _SETTLED : 3 * (_SETTLED + _END) - 9]]
        assert np.array(shown[3 * _RIGHT :]) == right, (word, bit)


def flipped(value: int, bit: int) -> int:
    """Return a word of which a bit is another."""
    word = (value ^ 1 << bit) & ((1 << WIDTH) - 1)
    return word - (word >> WIDTH - 1 << WIDTH)


def test_an_offset_that_was_upset_is_learned_anew() -> None:
    check_upsets([2], [WIDTH - 2])


@nightly  # an offset of many counts is what could not be learned away; here also those about a count, and some of all
def test_all_that_is_learned_is_right_again() -> None:
    check_upsets(WORDS, (*range(0, WIDTH, 5), *range(18, 22), WIDTH - 2, WIDTH - 1))
