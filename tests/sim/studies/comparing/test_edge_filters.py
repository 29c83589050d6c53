"""Kalman filters on edges: against a fit of all edges, and against matrices."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.lines import record

from tachometry.sim import build
from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.studies.comparing.baseline_catalogue import BASELINES
from tachometry.sim.studies.comparing.baselines import Steps
from tachometry.sim.studies.comparing.edge_filters import edge_kalman
from tachometry.spec import Encoder

CPR = 400
COUNT = 2 * math.pi / CPR


def edges_of(motion: str) -> tuple[Steps, FloatArray, FloatArray]:
    """Return the steps, and stamps (s) and places of the edges."""
    recording = record(motion, pulses_per_rev=CPR // 4, jitter=0.05, seed=3).recording
    steps = Steps.of_sensor(recording, Encoder(CPR // 4))
    stamp, place = np.floor(steps.time * 1e6 + 1e-6) * 1e-6, np.cumsum(steps.step) - steps.step / 2
    return replace(steps, reads=np.arange(2e-3, recording.duration, 2e-3), clock_s=1e-6), stamp, place


@pytest.mark.parametrize(("noises", "order"), [([30.0], 2), ([1e3], 3), ([3.0, 3e4], 3)])
def test_one_filter_or_two_are_those_of_matrices(noises: list[float], order: int) -> None:
    steps, stamp, place = edges_of("ramp:0:30rad/s:60ms+ramp:30rad/s:-20rad/s:90ms+stop:150ms+constant:-5rad/s:60ms")
    agile = noises[1] if len(noises) > 1 else None
    found = edge_kalman(steps, noises[0], order, agile, dwell_s=0.02).velocity / COUNT
    known, n, done = np.diag([0.08**2, *(np.array([1e3, 1e5]) / COUNT) ** 2][:order]), len(noises), 0
    density = (np.array(noises) / COUNT)[:, np.newaxis, np.newaxis] ** 2
    for at, speed in zip(steps.reads, found, strict=True):
        for edge in range(done, int(np.sum(steps.time <= at))):
            done, gap = edge + 1, stamp[edge] - stamp[edge - 1] if edge else math.inf
            if gap > 0.1:
                x, p, weight = (
                    np.tile(np.eye(order)[0] * place[edge], (n, 1)),
                    np.tile(known, (n, 1, 1)),
                    np.ones(n) / n,
                )
                continue
            change = (1 - math.exp(-2 * gap / 0.02)) / 2 * (n > 1)
            joint = weight * (np.eye(n) * (1 - 2 * change) + change)  # to, from
            weight = joint.sum(axis=1)
            share = joint / weight[:, np.newaxis]
            off = x - (share @ x)[:, np.newaxis]
            p = np.einsum("tf,tfij->tij", share, p + off[..., np.newaxis] * off[..., np.newaxis, :])
            move = np.array([[1, gap, gap * gap / 2], [0, 1, gap], [0, 0, 1]])[:order, :order]
            # Simpson's rule integrates the noise.
            ways = [np.array([[t * t / 2], [t], [1]])[3 - order :] for t in gap * np.linspace(0, 1, 41)]
            push = sum(w * way @ way.T for w, way in zip([1, *[4, 2] * 19, 4, 1], ways, strict=True)) * gap / 120
            x, p = share @ x @ move.T, move @ p @ move.T + push * density
            total, error, first = p[:, :1, 0] + 0.08**2, place[edge] - x[:, :1], p[:, 0]
            x, p = x + first / total * error, p - np.einsum("ni,nj->nij", first, first / total)
            weight = weight * (np.exp(-error * error / total / 2) / np.sqrt(total))[:, 0]
            weight = np.maximum(weight / weight.sum(), 1e-9)
        silence = at - stamp[done - 1] if done else 1.0
        expected = weight @ (x[:, 1] + (x[:, 2] * silence if order == 3 else 0)) if silence <= 0.1 else 0.0
        assert speed == pytest.approx(np.clip(expected, -2 / silence, 2 / silence), rel=1e-4, abs=1e-2), at
    assert np.count_nonzero(found) > 100


def test_without_a_compiler_they_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not any(one.missing for one in BASELINES.values())
    monkeypatch.setattr(build, "find_compiler", lambda: None)
    missing = {name: one.missing for name, one in BASELINES.items() if one.missing}
    assert missing == dict.fromkeys(("kf-cv", "kf-ca", "imm"), "it needs a C++ compiler")
