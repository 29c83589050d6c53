"""The baselines: against naive transcriptions of their descriptions, and exact cases."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from support.lines import decode, record

from tachometry.sim.studies.comparing.baselines import (
    MOTEUS_3DB_RATIO,
    Estimate,
    Steps,
    delay_seconds,
    finite_difference,
    low_pass,
    mixed_method,
    timestamp_method,
    tracking_loop,
)
from tachometry.spec import Encoder

PERIOD = 1e-3
CPR = 400
COUNT = 2 * math.pi / CPR  # rad; one count per PERIOD is 15.7 rad/s

Method = Callable[[Steps, float], Estimate]


def raw_difference(steps: Steps, period: float) -> Estimate:
    return finite_difference(steps, period, filter_s=0)


def slow_loop(steps: Steps, period: float) -> Estimate:
    """Return stable at PERIOD."""
    return tracking_loop(steps, period, bandwidth_rad_s=200)


RAW: list[Method] = [raw_difference, timestamp_method, mixed_method, slow_loop]


def steps_of(motion: str, **parameters: object) -> Steps:
    return Steps.of_sensor(record(motion, pulses_per_rev=CPR // 4, **parameters).recording, Encoder(CPR // 4))


def steps_at(*times: float, signs: str = "", duration: float = 1.0) -> Steps:
    step = [-1 if sign == "-" else 1 for sign in signs or "+" * len(times)]
    return Steps(np.array(times), np.array(step, dtype=np.int64), duration, CPR)


def random_steps(seed: int) -> Steps:
    random = np.random.default_rng(seed)
    speed = random.normal(0, 1, 8) * 10 ** random.uniform(-0.5, 2.5, 8)
    motion = "+".join(f"ramp:{a:.3f}rad/s:{b:.3f}rad/s:60ms" for a, b in zip(speed[:4], speed[4:], strict=True))
    faults = {"jitter": 0.1, "nonuniformity": 0.2, "illegal": 0.02, "seed": seed, "start_angle_rad": seed / 3}
    return steps_of(
        f"{motion}+stop:90ms+sine:{speed[0]:.3f}rad/s:40Hz:150ms+constant:{-speed[1]:.3f}rad/s:80ms", **faults
    )


# --- naive transcriptions: one reading after the other, counts/s


def readings(steps: Steps, clock: float) -> list[tuple[int, int, int]]:
    """Return clock, count and clock of the latest count at each reading, after those at time 0."""
    found, seen, count, latest = [(0, 0, 0)], 0, 0, 0
    for k in range(1, round(steps.duration / PERIOD) + 1):
        while seen < len(steps.time) and steps.time[seen] <= k * PERIOD:
            count += int(steps.step[seen])
            latest = math.floor(steps.time[seen] / clock + 1e-6)
            seen += 1
        found.append((math.floor(k * PERIOD / clock + 1e-6), count, latest))
    return found


def naive_difference(steps: Steps, filter_s: float) -> list[float]:
    speeds, filtered = [], 0.0
    counts = [count for _, count, _ in readings(steps, 1e-6)]
    for before, now in pairwise(counts):
        weight = filter_s / (filter_s + PERIOD)
        filtered = weight * filtered + (1 - weight) * (now - before) / PERIOD
        speeds.append(filtered)
    return speeds


def naive_timestamp(steps: Steps, timeout: float, clock: float) -> list[float]:
    speeds, speed, moving = [], 0.0, False
    reference_count = reference_stamp = direction = 0
    for now, count, stamp in readings(steps, clock)[1:]:
        change = count - reference_count
        if change and not moving:
            moving, direction = True, 0
        elif change:
            if abs(change) == 1 and change * direction < 0:
                speed = 0.0
            elif stamp > reference_stamp:
                speed = change / ((stamp - reference_stamp) * clock)
            direction = change
        elif moving:
            silence = (now - reference_stamp) * clock
            if silence >= timeout:
                speed, moving = 0.0, False
            elif abs(speed) > 1 / silence:
                speed = math.copysign(1 / silence, speed)
        if change:
            reference_count, reference_stamp = count, stamp
        speeds.append(speed)
    return speeds


def naive_mixed(steps: Steps, timeout: float, clock: float) -> list[float]:
    speeds, speed, th_before = [], 0.0, 0.0
    found = readings(steps, clock)
    for (then, count_before, _), (now, count, stamp) in pairwise(found):
        ts, th = (now - then) * clock, (now - stamp) * clock
        window = ts + th_before - th
        if count != count_before and window > ts / 2:
            speed = (count - count_before) / window
        if th > timeout:
            speed = 0.0
        th_before = th
        speeds.append(speed)
    return speeds


def naive_odrive(steps: Steps, bandwidth: float) -> list[float]:
    speeds, position, speed = [], 0.0, 0.0
    kp = 2 * bandwidth
    ki = kp**2 / 4
    for _, count, _ in readings(steps, 1e-6)[1:]:
        position = position + PERIOD * speed
        error = count - math.floor(position)
        position = position + PERIOD * kp * error
        speed = speed + PERIOD * ki * error
        speed = 0.0 if abs(speed) < ki * PERIOD / 2 else speed
        speeds.append(speed)
    return speeds


def naive_moteus(steps: Steps, filter_hz: float) -> list[float]:
    speeds, filtered, integral = [], 0.0, 0.0
    natural = 2 * math.pi * filter_hz / MOTEUS_3DB_RATIO
    for _, count, _ in readings(steps, 1e-6)[1:]:
        error = count - filtered
        integral += PERIOD * natural**2 * error
        filtered += PERIOD * (integral + 2 * natural * error)
        speeds.append(integral)
    return speeds


@pytest.mark.parametrize("seed", range(12))
def test_every_method_is_its_description(seed: int) -> None:
    steps = random_steps(seed)
    assert len(steps.time) > 50
    moteus = 2 * math.pi * 60 / MOTEUS_3DB_RATIO
    for estimate, naive in (
        (finite_difference(steps, PERIOD), naive_difference(steps, 5e-3)),
        (raw_difference(steps, PERIOD), naive_difference(steps, 0)),
        (timestamp_method(steps, PERIOD, timeout_s=0.03), naive_timestamp(steps, 0.03, 0.5e-6)),
        (timestamp_method(steps, PERIOD, timeout_s=2e-4), naive_timestamp(steps, 2e-4, 0.5e-6)),
        (timestamp_method(steps, PERIOD, clock_s=4e-4), naive_timestamp(steps, 0.5, 4e-4)),
        (mixed_method(steps, PERIOD), naive_mixed(steps, 0.1, 1e-6)),
        (mixed_method(steps, PERIOD, timeout_s=0.01), naive_mixed(steps, 0.01, 1e-6)),
        (slow_loop(steps, PERIOD), naive_odrive(steps, 200)),
        (tracking_loop(steps, PERIOD, moteus, whole_counts=False), naive_moteus(steps, 60)),
    ):
        np.testing.assert_allclose(estimate.time, PERIOD * np.arange(1, 561))
        np.testing.assert_allclose(estimate.velocity, COUNT * np.array(naive), rtol=1e-9, atol=1e-9)


def test_steps_are_those_of_the_decoder() -> None:
    recording = record("sine:30rad/s:20Hz:200ms", pulses_per_rev=CPR // 4, illegal=0.05, index=True).recording
    for decoding in (1, 2, 4):
        steps = Steps.of_sensor(recording, Encoder(CPR // decoding, decoding))
        position, _ = decode(recording, decoding)
        counted = np.append(0, np.cumsum(steps.step))
        at = np.searchsorted(steps.time, recording.time, side="right")
        assert counted[at].tolist() == position


# --- exact cases


@pytest.mark.parametrize("method", [finite_difference, timestamp_method, mixed_method, tracking_loop])
def test_standstill_is_zero_from_the_start_and_after_each_timeout(method: Method) -> None:
    period = 125e-6
    assert not np.any(method(steps_of("stop:200ms"), period).velocity)
    moved = method(steps_of("constant:30rad/s:200ms+stop:600ms"), period)
    at_rest = {finite_difference: 0.2 + 0.15, timestamp_method: 0.2 + 0.5, mixed_method: 0.2 + 0.101}
    assert moved.at(0.2) > 20
    assert np.max(np.abs(moved.velocity[moved.time > at_rest.get(method, 0.2 + 0.02)])) < 1e-9


def test_one_count_and_then_silence() -> None:
    steps = steps_at(0.01025)
    after = np.arange(11, 1001) * PERIOD - 0.01025
    a = 5 / 6
    for method, expected in (
        (finite_difference, (1 - a) * a ** np.arange(990) / PERIOD),
        (timestamp_method, np.zeros(990)),  # nothing to measure from
        (mixed_method, np.where(after > 0.1, 0, 1 / 0.01025)),
    ):
        estimate = method(steps, PERIOD)
        assert not np.any(estimate.velocity[:10])
        np.testing.assert_allclose(estimate.velocity[10:], COUNT * expected, rtol=1e-9, err_msg=method.__name__)
    loop = slow_loop(steps, PERIOD).velocity / COUNT
    assert loop[10] == pytest.approx(PERIOD * 200**2)
    assert not np.any(loop[40:])


def test_mixed_method_leaves_out_what_is_measured_over_half_a_period() -> None:
    for second, expected in ((0.01125, 1 / 0.01075), (0.01126, 1 / 0.51e-3)):
        speed = mixed_method(steps_at(0.01075, second), PERIOD).velocity
        assert speed[10] == pytest.approx(COUNT / 0.01075)
        assert speed[11] == pytest.approx(COUNT * expected)


def test_bound_of_the_timestamp_method_decays_until_the_timeout() -> None:
    estimate = timestamp_method(steps_at(0.01025, 0.02075, signs="--"), PERIOD)
    age = estimate.time[20:] - 0.02075
    expected = np.where(age >= 0.5, 0, -1 / np.maximum(age, 0.0105))
    np.testing.assert_allclose(estimate.velocity, np.append(np.zeros(20), COUNT * expected), rtol=1e-9)


def test_estimate_holds_until_the_next() -> None:
    estimate = Estimate(np.array([1.0, 2.0]), np.array([5.0, -3.0]))
    assert estimate.at([0, 0.99, 1, 1.5, 2, 9]).tolist() == [0, 0, 5, 5, -3, -3]


def test_number_of_readings() -> None:
    assert len(raw_difference(steps_at(duration=0.3), 1e-3).time) == 300  # 0.3 / 1e-3 is less than 300
    assert len(raw_difference(steps_at(duration=0.2999), 1e-3).time) == 299
    for method in RAW:
        assert len(method(steps_at(duration=0.5e-3), 1e-3).time) == 0
    assert np.flatnonzero(raw_difference(steps_at(0.5), 0.1).velocity).tolist() == [4]  # at 0.5 s itself


# --- delay


@pytest.mark.parametrize("delay_s", [-3.3e-3, 0, 0.4e-3, 2.25e-3, 17.7e-3])
def test_delay_of_a_shifted_signal(delay_s: float) -> None:
    def signal(t: NDArray[np.float64]) -> NDArray[np.float64]:
        return 100 + 30 * np.sin(40 * t) + 20 * np.sin(97 * t + 1) + 5 * np.sin(211 * t)

    t = np.arange(1, 1001, dtype=np.float64) * PERIOD
    noise = np.random.default_rng(3).normal(0, 1, len(t))
    assert delay_seconds(t, signal(t - delay_s), signal(t)) == pytest.approx(delay_s, abs=2e-5)
    assert delay_seconds(t, signal(t - delay_s) + noise, signal(t)) == pytest.approx(delay_s, abs=2e-4)


@pytest.mark.parametrize(
    ("method", "period", "delay_ms"),
    [
        (raw_difference, 1e-3, 0.5),
        (finite_difference, 1e-3, 5.4),
        (timestamp_method, 1e-3, 0.51),
        (mixed_method, 1e-3, 0.51),
        (tracking_loop, 125e-6, 1.93),
    ],
)
def test_delay_of_each_method(method: Method, period: float, delay_ms: float) -> None:
    """Of a fine encoder, whose counts are much shorter than a period."""
    motion = "ramp:0:200rad/s:100ms+ramp:200rad/s:50rad/s:60ms+ramp:50rad/s:300rad/s:150ms"
    motion += "+ramp:300rad/s:-100rad/s:120ms+ramp:-100rad/s:120rad/s:90ms"
    encoding = record(motion, pulses_per_rev=2000)
    estimate = method(Steps.of_sensor(encoding.recording, Encoder(2000)), period)
    delay = delay_seconds(estimate.time, estimate.velocity, encoding.true_speed(estimate.time))
    assert 1e3 * delay == pytest.approx(delay_ms, abs=0.04)


# --- what is refused


def test_refusals() -> None:
    steps = steps_at(0.5)
    t = np.arange(100, dtype=np.float64) * PERIOD
    for refused, text in (
        (lambda: steps_at(0.5, signs="++"), "one for each time"),
        (lambda: Steps(np.array([0.5]), np.array([2]), 1.0, CPR), "must be \\+1 or -1"),
        (lambda: steps_at(0.5, 0.4), "must not decrease"),
        (lambda: steps_at(-0.1), "must not decrease"),
        (lambda: steps_at(1.1), "must not decrease, from 0 to the duration, 1.0 s"),
        (lambda: Steps(np.array([]), np.array([]), 1.0, 0), "counts_per_rev must be at least 1, not 0"),
        (lambda: raw_difference(steps, 0.0), "period must be more than 0 s"),
        (lambda: low_pass(t, PERIOD, -1e-3), "at least 0 s, not -1ms"),
        (lambda: timestamp_method(steps, PERIOD, clock_s=PERIOD), "shorter than the control period, not 1ms"),
        (lambda: mixed_method(steps, PERIOD, clock_s=0), "clock must be more than 0 s"),
        (lambda: tracking_loop(steps, PERIOD), "must be less than 1, not 2"),
        (lambda: tracking_loop(steps, PERIOD, 500), "must be less than 1, not 1"),
        (lambda: tracking_loop(steps, PERIOD, 0.0), "must be less than 1, not 0"),
        (lambda: delay_seconds(t[:30], t[:30], t[:30]), "more than 0.04 s long"),
        (lambda: delay_seconds(t[:1], t[:1], t[:1]), "more than 0.04 s long"),
        (lambda: delay_seconds(t**2, t, t), "evenly spaced"),
        (lambda: delay_seconds(t, t, np.ones(100)), "no delay within 0.02 s stands out"),
        (lambda: delay_seconds(t, t - 0.03, t), "no delay within 0.02 s stands out"),
    ):
        with pytest.raises(ValueError, match=text):
            refused()
