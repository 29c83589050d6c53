"""The rivals: against naive transcriptions of their descriptions, exact cases, and the weaknesses they are known for."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from support.lines import decode, record

from tachometry.sim.motion import FloatArray
from tachometry.sim.rivals import (
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

PERIOD = 1e-3
CPR = 400
COUNT = 2 * math.pi / CPR  # rad; one count per PERIOD is 15.7 rad/s

Method = Callable[[Steps, float], Estimate]
METHODS: list[Method] = [finite_difference, timestamp_method, mixed_method, tracking_loop]


def raw_difference(steps: Steps, period: float) -> Estimate:
    return finite_difference(steps, period, filter_s=0)


def slow_loop(steps: Steps, period: float) -> Estimate:
    """Stable at PERIOD."""
    return tracking_loop(steps, period, bandwidth_rad_s=200)


RAW: list[Method] = [raw_difference, timestamp_method, mixed_method, slow_loop]


def steps_of(motion: str, **parameters: object) -> Steps:
    return Steps.of_recording(record(motion, pulses_per_rev=CPR // 4, **parameters).recording, CPR)


def steps_at(*times: float, signs: str = "", duration: float = 1.0) -> Steps:
    step = [-1 if sign == "-" else 1 for sign in signs or "+" * len(times)]
    return Steps(np.array(times), np.array(step, dtype=np.int64), duration, CPR)


def random_steps(seed: int) -> Steps:
    random = np.random.default_rng(seed)
    speed = random.normal(0, 1, 8) * 10 ** random.uniform(-0.5, 2.5, 8)
    motion = "+".join(f"ramp:{a:.3f}:{b:.3f}:60ms" for a, b in zip(speed[:4], speed[4:], strict=True))
    faults = {"jitter": 0.1, "nonuniformity": 0.2, "illegal": 0.02, "seed": seed, "start_angle_rad": seed / 3}
    return steps_of(f"{motion}+stop:90ms+sine:{speed[0]:.3f}:40Hz:150ms+constant:{-speed[1]:.3f}:80ms", **faults)


def true_and_measured(motion: str, method: Method, period: float, from_s: float) -> tuple[FloatArray, FloatArray]:
    """True speed and error of the measured one at each reading after some time, rad/s."""
    encoding = record(motion, pulses_per_rev=CPR // 4)
    estimate = method(Steps.of_recording(encoding.recording, CPR), period)
    late = estimate.time > from_s
    truth = encoding.true_speed(estimate.time[late])
    return truth, estimate.velocity[late] - truth


# --- naive transcriptions: one reading after the other, counts/s


def readings(steps: Steps, clock: float) -> list[tuple[int, int, int]]:
    """Clock, count and clock of the latest count at each reading, after those at time 0."""
    found, seen, count, latest = [(0, 0, 0)], 0, 0, 0
    for k in range(1, round(steps.duration / PERIOD) + 1):
        while seen < len(steps.time) and steps.time[seen] <= k * PERIOD:
            count += int(steps.step[seen])
            latest = math.floor(steps.time[seen] / clock + 1e-6)
            seen += 1
        found.append((round(k * PERIOD / clock), count, latest))
    return found


def naive_difference(steps: Steps, filter_s: float) -> list[float]:
    speeds, filtered = [], 0.0
    counts = [count for _, count, _ in readings(steps, 1e-6)]
    for before, now in zip(counts, counts[1:], strict=False):
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
    for (then, count_before, _), (now, count, stamp) in zip(found, found[1:], strict=False):
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
        (timestamp_method(steps, PERIOD, clock_s=2e-4), naive_timestamp(steps, 0.5, 2e-4)),
        (mixed_method(steps, PERIOD), naive_mixed(steps, 0.1, 1e-6)),
        (mixed_method(steps, PERIOD, timeout_s=0.01), naive_mixed(steps, 0.01, 1e-6)),
        (slow_loop(steps, PERIOD), naive_odrive(steps, 200)),
        (tracking_loop(steps, PERIOD, moteus, whole_counts=False), naive_moteus(steps, 60)),
    ):
        np.testing.assert_allclose(estimate.time, PERIOD * np.arange(1, 561))
        np.testing.assert_allclose(estimate.velocity, COUNT * np.array(naive), rtol=1e-9, atol=1e-9)
