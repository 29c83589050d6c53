"""The estimators of textbooks: against what NumPy's fit, Riccati's equation and naive transcriptions give."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.lines import record

from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.studies.comparing.baselines import Steps
from tachometry.sim.studies.comparing.estimators import (
    QUANTISATION,
    adaptive_window,
    kalman,
    kalman_gains,
    least_squares,
)
from tachometry.spec import Encoder

PERIOD = 1e-3
CPR = 400
COUNT = 2 * math.pi / CPR


def random_steps(seed: int) -> Steps:
    random = np.random.default_rng(seed)
    speed = random.normal(0, 1, 4) * 10 ** random.uniform(0, 2, 4)
    motion = "+".join(f"ramp:{a:.3f}rad/s:{b:.3f}rad/s:60ms" for a, b in zip(speed[:2], speed[2:], strict=True))
    recording = record(
        f"{motion}+stop:150ms+sine:{speed[0]:.3f}rad/s:20Hz:90ms", pulses_per_rev=CPR // 4, jitter=0.05, seed=seed
    ).recording
    return Steps.of_sensor(recording, Encoder(CPR // 4))


def counts_of(*per_period: int) -> Steps:
    """Return so many counts in each period, in its middle."""
    time = np.repeat((np.arange(len(per_period)) + 0.5) * PERIOD, np.abs(per_period))
    step = np.repeat(np.sign(per_period), np.abs(per_period))
    return Steps(time, step.astype(np.int64), len(per_period) * PERIOD, CPR)


# --- least squares


def naive_fit(steps: Steps, edges: int, order: int, timeout: float, clock: float) -> list[float]:
    """Return one reading after the other, by `numpy.polyfit`, counts/s."""
    position = np.cumsum(steps.step) - steps.step / 2
    stamp = np.floor(steps.time / clock + 1e-6) * clock
    speeds = []
    for k in range(1, round(steps.duration / PERIOD) + 1):
        now = math.floor(k * PERIOD / clock + 1e-6) * clock
        seen = int(np.sum(steps.time <= k * PERIOD))
        begin = seen
        while begin > max(0, seen - edges) and (begin == seen or stamp[begin] - stamp[begin - 1] <= timeout):
            begin -= 1
        silence = now - stamp[seen - 1] if seen else math.inf
        degree = min(order, seen - begin - 1)
        if degree < 1 or silence > timeout:
            speeds.append(0.0)
            continue
        time = (stamp[begin:seen] - stamp[seen - 1]) * 1e3
        line = np.polyfit(time, position[begin:seen] - position[seen - 1], degree)
        speed = 1e3 * float(np.polyval(np.polyder(line), silence * 1e3))
        speeds.append(min(max(speed, -2 / silence), 2 / silence) if silence else speed)
    return speeds


@pytest.mark.parametrize(("edges", "order"), [(2, 1), (7, 1), (8, 2), (24, 3)])
def test_least_squares_is_the_fit_of_numpy(edges: int, order: int) -> None:
    for seed in range(3):
        steps = random_steps(seed)
        assert len(steps.time) > 30
        found = least_squares(replace(steps, clock_s=1e-6), PERIOD, edges, order, timeout_s=0.03).velocity / COUNT
        expected = np.array(naive_fit(steps, edges, order, 0.03, 1e-6))
        assert np.count_nonzero(expected) > 100
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-3 * np.max(np.abs(expected)) / 100)


def test_edges_at_one_instant_tell_no_speed() -> None:
    steps = Steps(np.full(5, 2.5e-3), np.ones(5, dtype=np.int64), 0.01, CPR)
    assert not np.any(least_squares(steps, PERIOD, 4, 1).velocity)
    assert not np.any(least_squares(counts_of(0, 0, 0), PERIOD).velocity)


# --- adaptive window


def naive_window(steps: Steps, bound: float, longest: int, best_fit: bool) -> list[float]:
    count = [int(np.sum(steps.step[steps.time <= k * PERIOD])) for k in range(round(steps.duration / PERIOD) + 1)]
    speeds = []
    for k in range(1, len(count)):
        speed = 0.0
        for n in range(1, min(k, longest) + 1):
            window = np.array(count[k - n : k + 1], dtype=float)
            slope = np.polyfit(np.arange(n + 1), window, 1)[0] if best_fit else (window[-1] - window[0]) / n
            line = window[-1] - slope * np.arange(n, -1, -1)
            if np.max(np.abs(line - window)) > bound:
                break
            speed = slope
        speeds.append(speed / PERIOD)
    return speeds


@pytest.mark.parametrize("best_fit", [False, True])
@pytest.mark.parametrize("bound", [0.7712345, 1.0112345, 2.5112345])  # no distance is so by chance
def test_adaptive_window_is_its_description(bound: float, best_fit: bool) -> None:
    steps = random_steps(5)
    found = adaptive_window(steps, PERIOD, bound, 30, best_fit).velocity / COUNT
    np.testing.assert_allclose(found, naive_window(steps, bound, 30, best_fit), rtol=1e-9, atol=1e-6)


# --- Kalman


def riccati(index: float, order: int) -> FloatArray:
    """Return the gain of the filter of equal noise in a unit of time, after so long that it does not change."""
    move = np.array([[1, 1, 0.5], [0, 1, 1], [0, 0, 1]])[:order, :order]
    push = np.array([[0.5], [1], [1]])[:order]
    covariance = np.eye(order)
    gain = np.zeros(order)
    for _ in range(3000):
        covariance = move @ covariance @ move.T + push @ push.T * index**2
        gain = covariance[:, 0] / (covariance[0, 0] + 1)
        covariance = covariance - np.outer(gain, covariance[0])
    return gain


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("index", [1e-3, 0.05, 0.7, 20.0])
def test_gains_solve_the_riccati_equation(index: float, order: int) -> None:
    np.testing.assert_allclose(kalman_gains(index, order)[:order], riccati(index, order), rtol=1e-5)
    assert kalman_gains(index, 2)[2] == 0


@pytest.mark.parametrize(("order", "noise"), [(2, 60.0), (3, 2e4)])
def test_kalman_filter_in_matrices(order: int, noise: float) -> None:
    steps = random_steps(1)
    gain = riccati(noise * PERIOD**order / (COUNT * QUANTISATION), order)
    move = np.array([[1, 1, 0.5], [0, 1, 1], [0, 0, 1]])[:order, :order]
    state, expected = np.zeros(order), []
    for k in range(1, round(steps.duration / PERIOD) + 1):
        state = move @ state
        state = state + gain * (np.sum(steps.step[steps.time <= k * PERIOD]) - state[0])
        expected.append(state[1] / PERIOD * COUNT)
    np.testing.assert_allclose(kalman(steps, PERIOD, noise, order).velocity, expected, rtol=1e-4, atol=1e-4)


# --- what is refused


def test_refusals() -> None:
    steps = counts_of(1, 1, 1)
    for refused, text in (
        (lambda: least_squares(steps, PERIOD, 2, 2), "must be more than the order, 2, and at most 10000, not 2"),
        (lambda: least_squares(steps, PERIOD, 10_001), "must be more than the order, 2, and at most 10000, not 10001"),
        (lambda: least_squares(steps, PERIOD, 2, 0), "order of the polynomial must be from 1 to 5, not 0"),
        (lambda: least_squares(steps, PERIOD, 9, 6), "order of the polynomial must be from 1 to 5, not 6"),
        (lambda: adaptive_window(steps, PERIOD, -0.1), "noise bound must be at least 0 counts, not -0.1"),
        (lambda: adaptive_window(steps, PERIOD, math.nan), "noise bound must be at least 0 counts, not nan"),
        (lambda: adaptive_window(steps, PERIOD, longest=0), "longest window must be from 1 to 10000 periods, not 0"),
        (lambda: adaptive_window(steps, PERIOD, longest=10**5), "must be from 1 to 10000 periods, not 100000"),
        (lambda: kalman(steps, PERIOD, 0.0), "tracking index must be from 1e-15 to 1e\\+06, not 0"),
        (lambda: kalman(steps, PERIOD, -5.0), "tracking index must be from 1e-15 to 1e\\+06, not -0.0"),
        (lambda: kalman(steps, PERIOD, 1e99), "tracking index must be from 1e-15 to 1e\\+06, not 2.2"),
        (lambda: kalman(steps, PERIOD, order=1), "order of the filter must be 2 or 3, not 1"),
        (lambda: kalman(steps, PERIOD, order=10**30), "order of the filter must be 2 or 3, not 1000"),
        (lambda: kalman_gains(math.nan, 2), "tracking index must be from 1e-15 to 1e\\+06, not nan"),
    ):
        with pytest.raises(ValueError, match=text):
            refused()
