"""Baselines by name, with their parameters as options: `hostmot2`, `hostmot2:period=500us`, and all that a sweep tries.

What a name has in front of its options is a key of `BASELINES`.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from tachometry.sim import build
from tachometry.sim.studies.comparing import baselines, estimators, read_filters
from tachometry.sim.studies.comparing.baselines import Estimate, Steps
from tachometry.sim.studies.comparing.compare import Curve
from tachometry.sim.studies.comparing.edge_filters import edge_kalman
from tachometry.spec.language.option import ParameterError, parse_flag, parse_whole
from tachometry.spec.language.units import FREQUENCY, TIME, parse_bandwidth, read_nearest, short_time


def _time(what: str, text: str) -> float:
    return read_nearest(what, text, TIME)


def _frequency(what: str, text: str) -> float:
    return read_nearest(what, text, FREQUENCY, "Hz")


def _bandwidth(what: str, text: str) -> float:
    return float(parse_bandwidth(what, text))


def _number(what: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ParameterError(what, f"must be a number, not {text!r}")
    return value


@dataclass(frozen=True)
class Parameter:
    """Describes an option of a baseline."""

    argument: str  # of the model
    read: Callable[[str, str], Any]  # makes its value from the option's name and the text


_PERIOD = Parameter("period_s", _time)
_FILTER = Parameter("filter_s", _time)
_ORDER = Parameter("order", parse_whole)
_NOISE = Parameter("process_noise", _number)
_BOUND = {"bound": Parameter("bound", _number)}
_PLACES = {"edge-noise": Parameter("edge_noise", _number), **_BOUND}


@dataclass(frozen=True)
class Baseline:
    """Describes a float model of what others do."""

    title: str  # what it is
    # the settings that it has without options, in words: for the first four those that their projects come with
    usual: str
    model: Callable[..., Estimate]  # takes `Steps` and the arguments of the parameters
    parameters: Mapping[str, Parameter]  # by the names of the options
    # what is tried for the best: in each, the product of all values, separated by spaces
    swept: tuple[Mapping[str, str], ...]
    # values of arguments that are left out, where they are not those of the model
    fixed: Mapping[str, Any] = field(default_factory=dict)

    @property
    def missing(self) -> str:
        """Reason why it does not run on this machine: the filters on edges need a C++ compiler."""
        return "it needs a C++ compiler" if "edge-noise" in self.parameters and not build.find_compiler() else ""


def _simplefoc(steps: Steps, period_s: float, filter_s: float) -> Estimate:
    raw = baselines.mixed_method(steps, period_s)
    return Estimate(raw.time, baselines.low_pass(raw.velocity, period_s, filter_s))


def _moteus(steps: Steps, period_s: float, pll_filter_hz: float) -> Estimate:
    natural = 2 * math.pi * pll_filter_hz / baselines.MOTEUS_3DB_RATIO
    return baselines.tracking_loop(steps, period_s, natural, whole_counts=False)


_PERIODS = "33us 100us 250us 500us 1ms 2ms 4ms 8ms"
_FILTERS = "0us 500us 1ms 2ms 5ms 10ms 20ms 50ms"
_EDGES = "4 6 8 12 16 24 32 48 64 96 128 192 256 512 1024 2048 4096 8192"
_NOISES = "0.01 0.03 0.1 0.3 1 3 10 30 100 300 1e3 3e3"

BASELINES: dict[str, Baseline] = {
    "difference": Baseline(
        "counts in a period, low-pass filter",
        "1 ms, 5 ms",
        baselines.finite_difference,
        {"period": _PERIOD, "filter": _FILTER},
        ({"period": _PERIODS, "filter": _FILTERS},),
        {"period_s": 1e-3},
    ),
    "hostmot2": Baseline(
        "LinuxCNC: timestamps",
        "1 ms",
        baselines.timestamp_method,
        {"period": _PERIOD},
        ({"period": _PERIODS},),
        {"period_s": 1e-3},
    ),
    "simplefoc": Baseline(
        "SimpleFOC: mixed time and frequency, low-pass filter",
        "1 ms, 5 ms",
        _simplefoc,
        {"period": _PERIOD, "filter": _FILTER},
        ({"period": _PERIODS, "filter": _FILTERS},),
        {"period_s": 1e-3, "filter_s": 5e-3},
    ),
    "odrive": Baseline(
        "ODrive: tracking loop",
        "1000 rad/s, 125 us",
        baselines.tracking_loop,
        {"period": _PERIOD, "bandwidth": Parameter("bandwidth_rad_s", _bandwidth)},
        (
            {
                "period": "33us 125us",
                "bandwidth": "50rad/s 100rad/s 200rad/s 350rad/s 500rad/s 700rad/s 1000rad/s 1400rad/s 2000rad/s "
                "2800rad/s 4000rad/s 8000rad/s 12000rad/s",
            },
        ),
        {"period_s": 125e-6},
    ),
    "moteus": Baseline(
        "moteus: tracking loop",
        "400 Hz, 33 us",
        _moteus,
        {"period": _PERIOD, "pll-filter": Parameter("pll_filter_hz", _frequency)},
        (
            {
                "period": "33us 100us",
                "pll-filter": "20Hz 40Hz 80Hz 140Hz 200Hz 280Hz 400Hz 560Hz 800Hz 1120Hz 1600Hz 3200Hz 4500Hz",
            },
        ),
        {"period_s": 1 / 30e3, "pll_filter_hz": 400.0},
    ),
    "least-squares": Baseline(
        "polynomial through the latest edges (Brown 1992, Merry 2010)",
        "16 edges, order 2",
        estimators.least_squares,
        {"period": _PERIOD, "edges": Parameter("edges", parse_whole), "order": _ORDER, **_BOUND},
        ({"edges": "2 3", "order": "1", "bound": "1 2"}, {"edges": _EDGES, "order": "1 2 3", "bound": "1 2"}),
        {"period_s": None},
    ),
    "foaw": Baseline(
        "adaptive window (Janabi-Sharifi 2000)",
        "best-fit, d = 1 count, at most 100 periods of 100 us",
        estimators.adaptive_window,
        {
            "period": _PERIOD,
            "noise-bound": Parameter("noise_bound", _number),
            "longest": Parameter("longest", parse_whole),
            "best-fit": Parameter("best_fit", parse_flag),
        },
        ({"period": "100us 250us 500us 1ms", "noise-bound": "0.5 0.75 1 1.25 1.5 2 3", "best-fit": "yes no"},),
        {"period_s": 100e-6},
    ),
    "kalman": Baseline(
        "Kalman filter in its steady state",
        "position and speed, process noise 300 rad/s^2, 100 us",
        estimators.kalman,
        {"period": _PERIOD, "process-noise": Parameter("process_noise", _number), "order": _ORDER},
        (
            {"period": "33us 100us", "process-noise": "1 2 4 8 15 30 60 120 250 500 1e3 2e3 4e3 8e3 2e4", "order": "2"},
            {
                "period": "33us 100us",
                "process-noise": "1e2 3e2 1e3 3e3 1e4 2e4 4e4 8e4 2e5 4e5 8e5 2e6 4e6 1e7 3e7 1e8",
                "order": "3",
            },
        ),
        {"period_s": 100e-6},
    ),
    "kf-cv": Baseline(
        "Kalman filter on time-stamped edges, constant velocity",
        "process noise 10 rad/s^1.5",
        partial(edge_kalman, order=2),
        {"process-noise": _NOISE, **_PLACES},
        ({"process-noise": f"0 1e-4 3e-4 1e-3 3e-3 {_NOISES} 1e4", "bound": "1 2"},),
        {"process_noise": 10.0},
    ),
    "kf-ca": Baseline(
        "Kalman filter on time-stamped edges, constant acceleration",
        "process noise 1e3 rad/s^2.5",
        edge_kalman,
        {"process-noise": _NOISE, **_PLACES},
        ({"process-noise": f"0 {_NOISES} 50 200 500 2e3 5e3 1e4 2e4 3e4 5e4 1e5 2e5 3e5 5e5 1e6 3e6", "bound": "1 2"},),
        {"process_noise": 1e3},
    ),
    "imm": Baseline(
        "two Kalman filters as kf-ca, as interacting multiple model",
        "process noise 3 and 3e4 rad/s^2.5, dwell 100 ms",
        edge_kalman,
        {"calm": _NOISE, "agile": Parameter("agile", _number), "dwell": Parameter("dwell_s", _time), **_PLACES},
        (
            {"calm": "0 3 300", "agile": "10 1e3 3e4 1e6", "dwell": "10ms 100ms 1s", "edge-noise": "0.05 0.15"}
            | {"bound": "1 2"},
        ),
        {"process_noise": 3.0, "agile": 3e4},
    ),
}

_INDICES = " ".join(f"{digit}e{power}" for power in range(-9, 1) for digit in (1, 2, 5))
# On positions of an absolute encoder, in place of those on edges.
OF_READS: dict[str, Baseline] = {
    "alpha-beta": Baseline(
        "alpha-beta filter",
        "tracking index 0.01",
        read_filters.alpha_beta,
        {"index": Parameter("index", _number)},
        ({"index": _INDICES},),
    ),
    "alpha-beta-gamma": Baseline(
        "alpha-beta-gamma filter",
        "tracking index 0.01",
        partial(read_filters.alpha_beta, order=3),
        {"index": Parameter("index", _number)},
        ({"index": f"1e-12 1e-11 1e-10 {_INDICES}"},),
    ),
    "pll": Baseline(
        "phase-locked loop, critically damped",
        "1000 rad/s",
        read_filters.phase_locked_loop,
        {"bandwidth": Parameter("bandwidth_rad_s", _bandwidth)},
        ({"bandwidth": BASELINES["odrive"].swept[0]["bandwidth"]},),
    ),
    "savitzky-golay": Baseline(
        "polynomial through the latest positions (Savitzky, Golay 1964)",
        "9 reads, order 2",
        read_filters.savitzky_golay,
        {"reads": Parameter("reads", parse_whole), "order": _ORDER},
        ({"reads": "5 7 9 13 17 25 33 49 65 97 129 257", "order": "1 2 3"},),
    ),
}


def baseline_model(name: str) -> tuple[str, Callable[[Steps], Estimate]]:
    """Return what a baseline with options is in words, and its model, of a name as `kalman:order=3:process-noise=1e5`.

    It raises ValueError if there is no such baseline or option, or a text cannot be read. What is out of range is
    refused by the model.
    """
    method, *words = name.split(":")
    known = BASELINES | OF_READS
    if method not in known:
        raise ParameterError("methods", f"must be of {', '.join(known)}, not {method!r}")
    baseline = known[method]
    arguments = dict(baseline.fixed)
    for word in words:
        option, _, text = word.partition("=")
        if option not in baseline.parameters:
            raise ValueError(f"options of {method} must be of {', '.join(baseline.parameters)}, not {option!r}")
        parameter = baseline.parameters[option]
        arguments[parameter.argument] = parameter.read(option, text)
    settings = ", ".join(word.replace("=", " ", 1) for word in words) or baseline.usual
    return f"{baseline.title}: {settings}", partial(baseline.model, **arguments)


def steps_curve(name: str, steps: Steps) -> Curve:
    """Return what a baseline shows of steps; ValueError if there is none such, or not two of its periods."""
    what, model = baseline_model(name)
    estimate = model(steps)
    if len(estimate.time) < 2:
        raise ParameterError(
            "motion", f"must last at least two control periods of {name}, not {short_time(steps.duration)}"
        )
    return Curve(name, what, estimate, np.empty(0), steps.reads if len(steps.reads) else estimate.time)


def settings(method: str) -> list[str]:
    """Return names of a baseline with all settings that are tried for the best, its usual one first."""
    found = [method]
    for swept in (BASELINES | OF_READS)[method].swept:
        for values in product(*(texts.split() for texts in swept.values())):
            found.append(":".join([method, *(f"{name}={text}" for name, text in zip(swept, values, strict=True))]))
    return found
