"""Imperfections of the virtual encoder against their definition."""

import hashlib
import math

import numpy as np
import pytest
from numpy.typing import NDArray
from support.lines import FORWARD, GOLDEN, PITCH, PPR, decode, decoded_at, levels, record

from tachometry.sim import golden
from tachometry.sim.encoder import imperfections
from tachometry.sim.encoder.imperfections import Bounce, _log, gaussian
from tachometry.sim.encoder.motion import Vibration
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.sim.signals.run import Run
from tachometry.spec import Encoder as SpecEncoder
from tachometry.spec import STachometer, Timing


def test_nonuniformity_is_of_the_disc() -> None:
    encoding = record("constant:1rev/s:3s", nonuniformity=0.3, pulses_per_rev=64, start_angle_rad=math.pi / 256, seed=5)
    edges = encoding.recording.time[1:] * 256
    first, second, third = edges[:256], edges[256:512], edges[512:]
    np.testing.assert_allclose(second - first, 256, rtol=1e-12)
    np.testing.assert_allclose(third - second, 256, rtol=1e-12)
    offset = first - (np.arange(256) + 0.5)
    np.testing.assert_allclose(offset, np.roll(encoding.encoder.disc.offset, -1), atol=1e-10)
    assert 0.28 < np.max(np.abs(offset)) <= 0.3
    assert np.std(offset) == pytest.approx(0.3 / math.sqrt(3), rel=0.1)


def test_an_eccentric_disc_displaces_its_edges_by_a_sine_over_a_turn() -> None:
    edges = record("constant:1rev/s:2s", eccentricity=0.3, pulses_per_rev=64, start_angle_rad=math.pi / 256)
    offset = edges.recording.time[1:] * 256 - (np.arange(512) + 0.5)
    np.testing.assert_allclose(offset, 0.3 * np.sin(2 * math.pi * np.arange(1, 513) / 256), atol=1e-9)


def test_jitter_has_the_given_deviation() -> None:
    parameters = {"start_angle_rad": PITCH / 2}
    ideal = record("constant:10rev/s:5s", **parameters).recording
    shaken = record("constant:10rev/s:5s", jitter=0.05, **parameters).recording
    shift = (shaken.time - ideal.time)[2:-2] * 40 * PPR
    n = len(shift)
    assert n > 190_000
    assert np.mean(shift) == pytest.approx(0, abs=5 * 0.05 / math.sqrt(n))
    assert np.std(shift) == pytest.approx(0.05, rel=5 / math.sqrt(2 * n))
    assert np.mean((shift / np.std(shift)) ** 4) == pytest.approx(3, abs=5 * math.sqrt(24 / n))
    assert np.mean(shift[1:] * shift[:-1]) / 0.05**2 == pytest.approx(0, abs=5 / math.sqrt(n))
    assert levels(shaken) == levels(ideal)


def test_jitter_keeps_the_order_of_edges() -> None:
    motion = "sine:30rad/s:7Hz:1s"
    parameters = {"vibration": Vibration(2e-3, 333), "nonuniformity": 0.4}
    ideal, shaken = (record(motion, jitter=jitter, **parameters).recording for jitter in (0, 0.499))
    gap = np.diff(ideal.time, append=ideal.duration)
    assert len(gap) > 5000
    assert np.all(np.diff(shaken.time) > 0)
    room = np.minimum(gap[:-1], gap[1:])
    assert np.max(np.abs(shaken.time - ideal.time)[1:] / room) == pytest.approx(0.49, rel=1e-6)
    assert levels(shaken) == levels(ideal)


def test_jitter_keeps_edges_within_the_recording() -> None:
    for seed in range(20):
        shaken = record("constant:1rev/s:1ms", start_angle_rad=0.999 * PITCH, jitter=0.4, seed=seed).recording
        assert 0 < shaken.time[1] < 0.0015 / (4 * PPR)
        assert shaken.time[4] < 1e-3 - 1e-6


def test_jitter_is_no_part_of_the_truth() -> None:
    t = np.linspace(0, 1, 999)
    still, shaken = (record("constant:5rad/s:1s", jitter=jitter).true_position(t) for jitter in (0, 0.3))
    assert np.array_equal(still, shaken)


def test_a_longer_motion_begins_with_the_same_noise() -> None:
    short, long = (record(f"constant:5rad/s:{t}s", jitter=0.1, illegal=0.1).recording for t in (1, 2))
    n = len(short.time) - 3  # the end of the recording is a neighbour of the last edge
    np.testing.assert_allclose(short.time[:n], long.time[:n], rtol=1e-14)


def test_illegal_transitions_are_pairs_of_edges_at_the_instant_of_the_later() -> None:
    ideal, faulty = (record("constant:5rev/s:1s", illegal=illegal) for illegal in (0, 0.1))
    n = len(ideal.recording.time) - 1
    assert faulty.n_illegal == decode(faulty.recording, 4)[1]
    assert len(faulty.recording.time) == len(ideal.recording.time) - faulty.n_illegal
    assert faulty.n_illegal / n == pytest.approx(0.1 / 1.1, abs=5 * math.sqrt(0.1 / n))
    row = np.searchsorted(ideal.recording.time, faulty.recording.time)
    assert np.array_equal(ideal.recording.time[row], faulty.recording.time)
    assert np.array_equal(ideal.recording.a[row], faulty.recording.a)
    assert np.array_equal(ideal.recording.b[row], faulty.recording.b)
    assert set(np.diff(row).tolist()) == {1, 2}
    t = np.linspace(0, 1, 999)
    assert np.array_equal(ideal.true_position(t), faulty.true_position(t))


def test_with_certainty_edges_merge_two_by_two() -> None:
    encoding = record("constant:1rev/s:1750us", illegal=1, start_angle_rad=PITCH / 2)
    assert levels(encoding.recording) == [(0, 0), (1, 1), (0, 0), (1, 1), (0, 1)]
    assert encoding.n_illegal == 3
    np.testing.assert_allclose(encoding.recording.time[1:] * 4 * PPR, [1.5, 3.5, 5.5, 6.5], rtol=1e-12)


def test_edges_of_one_line_do_not_merge() -> None:
    encoding = record("stop:1s", vibration=Vibration(PITCH / 2, 50), illegal=1)
    assert encoding.n_illegal == 0
    assert len(encoding.recording.time) > 99
    turning = record("constant:1rev/s:625us+constant:-1rev/s:625us", illegal=1, start_angle_rad=PITCH / 2)
    # edges 1 2 | 3 . 3 reversed | 2 1 reversed: 3 and its return are of one line, its return and 2 reversed are not
    assert levels(turning.recording) == [(0, 0), (1, 1), (0, 1), (1, 0), (0, 0)]


@pytest.mark.parametrize("motion", ["stop:1s", "constant:1rev/s:300us"])
def test_with_less_than_two_edges_there_is_nothing_to_merge(motion: str) -> None:
    assert record(motion, illegal=1, jitter=0.1).n_illegal == 0


def test_disturbances_have_streams_of_their_own() -> None:
    uneven, all_on, illegal, jitter, both = (
        record("constant:1rev/s:1s", start_angle_rad=PITCH / 2, seed=3, **disturbances)
        for disturbances in (
            {"nonuniformity": 0.1},
            {"nonuniformity": 0.1, "jitter": 0.05, "illegal": 0.1},
            {"illegal": 0.1},
            {"jitter": 0.05},
            {"jitter": 0.05, "illegal": 0.1},
        )
    )
    assert np.array_equal(uneven.encoder.disc.offset, all_on.encoder.disc.offset)
    assert levels(illegal.recording) == levels(both.recording) == levels(all_on.recording)
    assert np.all(np.isin(both.recording.time, jitter.recording.time))


def test_streams_and_seeds_differ() -> None:
    streams = [imperfections.stream(seed, which) for seed in range(2) for which in range(5)]
    assert len({int(stream.random_raw()) for stream in streams}) == 10


def test_logarithm() -> None:
    x = np.concatenate([np.random.default_rng(1).random(10_000), [2.0**-53, 0.5, math.sqrt(0.5), 1.0]])
    exact = np.array([math.log(value) for value in x])
    assert np.max(np.abs(_log(x) - exact) / np.maximum(1, np.abs(exact))) < 1e-15


def test_gaussian_reaches_its_tails() -> None:
    normal = gaussian(np.random.PCG64(1), 400_000)
    for sigma in (1, 2, 3, 4):
        expected = 400_000 * math.erfc(sigma / math.sqrt(2))
        assert np.sum(np.abs(normal) > sigma) == pytest.approx(expected, abs=5 * math.sqrt(expected))


def pulses(encoding: Encoding, line: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return widths and centres of a line's pulses in electrical degrees since time 0, at 1 rev/s."""
    time, change = encoding.recording.time[1:], np.diff((encoding.recording.level & line).astype(int))
    rise, fall = time[change > 0], time[change < 0]
    rise = rise[rise < fall[-1]]
    fall = fall[-len(rise) :]
    return (fall - rise) * 360 * PPR, (fall + rise) * 180 * PPR


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(("phase", "duty"), [(30, 0), (-60, 0), (0, 40), (0, -75), (15, 50), (-20, -30), (0.5, 89.4)])
def test_phase_and_duty_as_data_sheets_measure_them(phase: float, duty: float, direction: int) -> None:
    encoding = record(
        f"constant:{direction}rev/s:1s", phase_error_deg=phase, duty_error_deg=duty, start_angle_rad=2.3 * PITCH
    )
    (width_a, centre_a), (width_b, centre_b) = (pulses(encoding, line) for line in (1, 2))
    np.testing.assert_allclose(np.append(width_a, width_b), 180 + duty, atol=1e-6)
    angle_a, angle_b = (2.3 * 90 + direction * centre for centre in (centre_a, centre_b))
    for angle, ideal in ((angle_a, 180), (angle_b, 270 + phase)):  # of a disc whose A rises at 90
        assert len(angle) >= PPR - 1
        np.testing.assert_allclose((angle - ideal + 180) % 360, 180, atol=1e-6)
    assert decode(encoding.recording, 4)[1] == 0


def test_phase_and_duty_are_of_the_disc() -> None:
    parameters = {"phase_error_deg": 40, "duty_error_deg": -25, "nonuniformity": 0.13, "seed": 4}
    encoding = record("ramp:30rad/s:-40rad/s:1s+sine:9rad/s:3Hz:1s", **parameters)
    t = np.linspace(0, 2, 9999)
    assert np.array_equal(decoded_at(encoding, t, 4), encoding.true_position(t))
    assert np.all(np.diff(encoding.recording.time) > 0)
    even = VirtualEncoder(PPR, nonuniformity=0.13, seed=4).disc.offset
    both = encoding.encoder.disc.offset
    np.testing.assert_allclose((both - even)[:8] * 90, [27.5, 12.5, 52.5, -12.5] * 2, atol=1e-12)


def test_the_narrowest_state_never_vanishes() -> None:
    for phase, duty in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        for n in (0.0, 0.24):
            room = 89.99 - 180 * n
            parameters = {"phase_error_deg": phase * room * 0.7, "duty_error_deg": duty * room * 0.3}
            encoding = record("constant:1rev/s:2s", nonuniformity=n, start_angle_rad=0.4, **parameters)
            assert np.all(np.diff(encoding.recording.time) > 0)
            assert decode(encoding.recording, 4) == (list(range(8 * PPR + 1)), 0)


def test_bounce_is_chatter_after_each_edge() -> None:
    ideal, bouncing = (record("ramp:0:30rad/s:100ms", seed=9, bounce=b) for b in (None, Bounce(3, 50e-6)))
    time, level = bouncing.recording.time, bouncing.recording.level
    assert len(time) == 1 + 7 * (len(ideal.recording.time) - 1)
    rows = np.arange(1, len(time)).reshape(-1, 7)
    assert np.array_equal(time[rows[:, 0]], ideal.recording.time[1:])
    for column, row in enumerate(rows.T):
        wanted = ideal.recording.level[1:] if column % 2 == 0 else ideal.recording.level[:-1]
        assert np.array_equal(level[row], wanted)
    room = np.diff(ideal.recording.time, append=0.1)[1:] / 2
    lasts = time[rows[:, -1]] - time[rows[:, 0]]
    assert np.all(np.diff(time) >= 0)
    assert np.all(lasts <= np.minimum(room, 50e-6) * (1 + 1e-9))
    assert np.mean(lasts[room > 50e-6]) == pytest.approx(50e-6 * 6 / 7, rel=0.02)  # the last of six moments
    assert np.count_nonzero(room < 50e-6) > 100
    t = np.append(time[rows[:, -1]], 0.1)
    assert np.array_equal(decoded_at(bouncing, t, 4), ideal.true_position(t))


def golden_run(encoding: Encoding, clock_hz: int, filter_clocks: int = 0) -> tuple[Run, NDArray[np.int64]]:
    """Return the core's golden model, and the true position that each tick should show."""
    spec = STachometer(encoder=SpecEncoder(PPR), timing=Timing(clock_hz, 100, 10), filter_clocks=filter_clocks)
    run = golden.run(spec, encoding.recording.place(clock_hz))
    sampled = (run.ticks.clock - spec.latency.tick - spec.latency.pin_to_count) / clock_hz
    return run, encoding.true_position(sampled)


def test_edges_that_come_together_do_not_bounce() -> None:
    parameters = {"illegal": 0.3, "seed": 2}
    smooth, bouncing = (record("constant:3rad/s:1s", bounce=b, **parameters) for b in (None, Bounce(2, 1e-4)))
    assert bouncing.n_illegal == smooth.n_illegal == decode(bouncing.recording, 4)[1] > 100
    assert decode(bouncing.recording, 4)[0][-1] == decode(smooth.recording, 4)[0][-1]
    assert len(bouncing.recording.time) == 5 * len(smooth.recording.time) - 4 * (1 + smooth.n_illegal)


@pytest.mark.parametrize(("line", "forward"), [("a", [(0, 0), (0, 1), (0, 0)]), ("b", [(0, 0), (1, 0), (0, 0)])])
def test_a_missed_pulse_looks_like_a_turn_to_and_fro(line: str, forward: list[tuple[int, int]]) -> None:
    found = set()
    for seed in range(40):
        encoding = record("constant:1rev/s:1ms", start_angle_rad=PITCH / 2, lost=0.5, seed=seed)
        rows = levels(encoding.recording)
        position = decode(encoding.recording, 4)[0][-1]
        found.add((tuple(rows), encoding.n_lost, position))
        assert encoding.true_position(1e-3) == 4
    assert (tuple(forward), 2, 0) in found
    assert (tuple([(0, 0)]), 4, 0) in found
    assert (tuple([*FORWARD, (0, 0)]), 0, 4) in found
    assert len(found) == 4


@pytest.mark.parametrize("speed", [7, -7])
def test_lost_pulses_are_missing_from_the_position(speed: int) -> None:
    motion, start = f"constant:{speed}rev/s:1s", {"start_angle_rad": 2.5 * PITCH, "seed": 5}
    ideal, lossy = (record(motion, lost=lost, **start) for lost in (0, 0.02))
    missing = np.setdiff1d(ideal.recording.time, lossy.recording.time)
    assert np.all(np.isin(lossy.recording.time, ideal.recording.time))
    assert lossy.n_lost == len(missing)
    assert lossy.n_lost / (2 * 14 * PPR) == pytest.approx(0.02, abs=5 * math.sqrt(0.02 / (14 * PPR)))
    assert decode(lossy.recording, 4)[1] == lossy.n_illegal == 0
    # In a period without the pulse of A, of B, or of both, an ideal decoder counts nothing.
    periods = len(np.unique(np.floor((2.5 + speed * missing * 4 * PPR - 0.5) / 4)))  # edges 1 to 4 are of period 0
    run, true = golden_run(lossy, 1_000_000)
    assert abs((run.ticks.position[-1] - true[-1]) + np.sign(speed) * 4 * periods) <= 4
    assert len(run.errors) == 0
    assert 200 < periods <= lossy.n_lost / 2


def test_with_certainty_every_pulse_is_lost_that_begins_and_ends() -> None:
    encoding = record("constant:1rev/s:10500us", start_angle_rad=1.5 * PITCH, lost=1)
    # A is high at the start and B at the end
    assert levels(encoding.recording) == [(1, 0), (0, 0), (0, 1)]
    assert encoding.n_lost == 2 * (10 + 10)


def test_lost_pulses_of_a_line_that_dithers_cost_nothing() -> None:
    encoding = record("stop:1s", vibration=Vibration(PITCH / 2, 50), start_angle_rad=PITCH, lost=0.5)
    assert 28 < encoding.n_lost < 70
    assert set(decode(encoding.recording, 4)[0]) == {-1, 0}
    assert decode(encoding.recording, 4)[0][-1] == 0


@pytest.mark.parametrize("motion", ["stop:1s", "constant:1rev/s:300us"])
def test_without_a_whole_pulse_none_is_lost(motion: str) -> None:
    encoding = record(motion, lost=1, bounce=Bounce(1, 1e-6), jitter=0.1, index=True)
    assert encoding.n_lost == 0


EVERYTHING = {
    **GOLDEN,
    "nonuniformity": 0.1,
    "phase_error_deg": 20.0,
    "duty_error_deg": -30.0,
    "bounce": Bounce(2, 5e-6),
    "lost": 0.01,
}


def test_all_together_give_equal_bytes_on_every_machine() -> None:
    recording = record(**EVERYTHING, index=True, index_state=0, pulses_per_rev=50).recording  # type: ignore[arg-type]
    text = recording.time.astype("<f8").tobytes() + recording.level.tobytes()
    assert hashlib.sha256(text).hexdigest() == "c7d0817e702e70cbdc0ed18554feb7cd717f98440883c1d9befd1eafa9c9602a"


@pytest.mark.parametrize("seed", range(8))
def test_all_together_keep_the_order_of_edges(seed: int) -> None:
    rng = np.random.default_rng(seed)
    room = 90 * rng.dirichlet([1, 1, 1, 0.2])
    encoding = record(
        "ramp:0:50rad/s:50ms+sine:20rad/s:35Hz:100ms+constant:-300rpm:80ms",
        vibration=Vibration(2e-3, 487.0),
        nonuniformity=room[0] / 180,
        phase_error_deg=room[1] * rng.choice([-1, 1]),
        duty_error_deg=room[2] * rng.choice([-1, 1]),
        jitter=rng.choice([0, 0.05, 0.49]),
        illegal=rng.choice([0, 0.05, 1]),
        bounce=Bounce(int(rng.integers(1, 5)), 10 ** rng.uniform(-7, -2)),
        lost=rng.choice([0, 0.05, 0.9]),
        pulses_per_rev=int(rng.choice([1, 3, 100])),
        seed=seed,
    )
    assert np.all(np.diff(encoding.recording.time) >= 0)
    assert np.all(np.diff(encoding.recording.level) != 0)
    position, n_illegal = decode(encoding.recording, 4)
    assert n_illegal == encoding.n_illegal
    if not (encoding.n_illegal or encoding.n_lost):
        assert position[-1] == encoding.true_position(encoding.motion.duration)
    assert (encoding.true_position(encoding.motion.duration) - position[-1] - 2 * n_illegal) % 4 == 0


def test_bounce_is_of_the_edges_that_a_motion_may_have() -> None:
    message = r"^motion must be of at most 10000000 encoder edges, start angle and bounce included, not 8e\+08$"
    with pytest.raises(ValueError, match=message):
        record("constant:1000rev/s:100s", bounce=Bounce(1000, 1e-9), pulses_per_rev=1)


def test_bounce_is_read_from_text() -> None:
    assert Bounce.parse("3:500us") == Bounce(3, 500e-6)
    assert Bounce.parse("1:0.002s") == Bounce(1, 2e-3)
