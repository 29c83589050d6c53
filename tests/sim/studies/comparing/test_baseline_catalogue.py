"""Baselines by name: their options, and the settings that are tried for the best."""

from dataclasses import replace

import numpy as np
import pytest
from support.lines import record

from tachometry.sim.studies.comparing.baseline_catalogue import BASELINES, baseline_model, settings, steps_curve
from tachometry.sim.studies.comparing.baselines import Steps, low_pass, mixed_method, tracking_loop
from tachometry.sim.studies.comparing.estimators import kalman
from tachometry.spec import Encoder

STEPS = Steps.of_sensor(record("ramp:0:100rad/s:60ms", pulses_per_rev=100).recording, Encoder(100))
READ = replace(STEPS, reads=np.arange(1e-3, 60e-3, 1e-3))


def test_options_are_those_of_the_model() -> None:
    def speed(name: str) -> np.ndarray:
        return steps_curve(name, STEPS).estimate.velocity

    np.testing.assert_array_equal(
        speed("kalman:order=3:process-noise=1e5:period=1ms"), kalman(STEPS, 1e-3, 1e5, 3).velocity
    )
    np.testing.assert_array_equal(
        speed("odrive:bandwidth=100Hz:period=250us"), tracking_loop(STEPS, 250e-6, 200 * np.pi).velocity
    )
    np.testing.assert_array_equal(
        speed("simplefoc:filter=2ms"), low_pass(mixed_method(STEPS, 1e-3).velocity, 1e-3, 2e-3)
    )
    assert len(speed("foaw:best-fit=no:longest=7:noise-bound=1.5")) == 600
    assert steps_curve("hostmot2:period=2ms", STEPS).what == "LinuxCNC: timestamps: period 2ms"


@pytest.mark.parametrize("method", BASELINES)
def test_settings_are_all_different_and_of_known_options(method: str) -> None:
    names = settings(method)
    assert names[0] == method
    assert len(set(names)) == len(names) > 8
    n_refused = 0
    for name in names:
        what, model = baseline_model(name)
        assert what
        try:
            model(READ)
        except ValueError:
            n_refused += 1
    assert n_refused <= 4  # loops that are not stable


@pytest.mark.parametrize("method", BASELINES)
def test_what_is_swept_makes_a_difference(method: str) -> None:
    curves = [baseline_model(name)[1](READ).velocity for name in settings(method)[1:6]]
    assert len({curve.tobytes() for curve in curves}) > 1


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nothing", "methods must be of difference, hostmot2, "),
        ("hostmot2:bandwidth=3", "options of hostmot2 must be of period, not 'bandwidth'"),
        ("hostmot2:period=3", "period must be a number with one of the units s, ms, us, ns: type 3s"),
        ("foaw:noise-bound=x", "noise-bound must be a number, not 'x'"),
        ("foaw:best-fit=x", "best-fit must be yes or no, not 'x'"),
        ("least-squares:edges=x", "edges must be a whole number, not 'x'"),
        ("hostmot2:period=40ms", "motion must last at least two control periods of hostmot2:period=40ms, not 60ms"),
    ],
)
def test_refusals(name: str, message: str) -> None:
    with pytest.raises(ValueError, match="must") as error:
        steps_curve(name, STEPS)
    assert str(error.value).startswith(message)
