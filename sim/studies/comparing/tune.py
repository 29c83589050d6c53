"""The best setting of a method for a situation, and what each setting costs: error at one motion, delay at another."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from tachometry.sim.studies.comparing.compare import Curve, Judge, rms_error
from tachometry.spec.language.option import ParameterError

# Settings of cores that are tried: an option with its values. Those of `TUNED` take part where the best is looked for.
CORES: Mapping[str, tuple[str, str]] = {
    "m": ("average", "1 2 5 10 20 50 100"),
    "mt": ("min-time", "20us 50us 100us 200us 500us 1ms 2ms 5ms 10ms"),
}
TUNED = ("mt",)

SETTLED_S = 0.1
"""Length of what is left out of the motion that tells delays, in seconds."""


@dataclass(frozen=True)
class Cost:
    """Holds the cost of a setting."""

    # method and name: the method, and its name with the setting
    method: str
    name: str
    rms: float  # rad/s: error when it is read
    delay: float  # seconds: see `equivalent_delay`


def core_settings(method: str) -> list[tuple[str, dict[str, str]]]:
    """Return names of a core's method with all settings that are tried, and their options."""
    if method not in CORES:
        return [(method, {})]
    option, values = CORES[method]
    return [(f"{method}:{option}={text}", {option: text}) for text in values.split()]


def possible(curves: Iterable[Callable[[], Curve]]) -> Iterable[Curve]:
    """Return curves of all settings that can be.

    A setting can be wrong for a core or an encoder, or have periods that are too long for the motion. It raises
    ValueError if there is none: that of the last setting.
    """
    refused, n_found = None, 0
    for make in curves:
        try:
            curve = make()
        except ValueError as error:
            refused = error
        else:
            n_found += 1
            yield curve
    if not n_found:
        raise refused or ParameterError("methods", "must have settings")


def best(curves: Iterable[Curve], judge: Judge) -> Curve:
    """Return the curve with the least RMS error, what comes before its first value left out.

    It raises ValueError if no curve has a value by then.
    """
    found, least = None, np.inf
    for curve in curves:
        error = error_of(curve, judge)
        if error is not None and error < least:
            found, least = curve, error
    if found is None:
        raise ParameterError("motion", "must last until a setting of every method has a value")
    return found


def error_of(curve: Curve, judge: Judge) -> float | None:
    """Return RMS error from the first value on, rad/s; None if there is none by then."""
    instants = judge.among(curve.reads)
    instants = instants[instants >= curve.estimate.time[0]] if len(curve.estimate.time) else instants[:0]
    assert judge.true_speed is not None
    return rms_error(curve, instants, judge.true_speed(instants)) if len(instants) else None


def triangle(speed_rad_s: float) -> str:
    """Return the motion that tells delays: the speed goes to and fro between half of it and all of it, 10 times a
    second.

    It begins with `SETTLED_S` at half of the speed.
    """
    low, high = f"{speed_rad_s / 2:.6g}rad/s", f"{speed_rad_s:.6g}rad/s"
    to_and_fro = f"ramp:{low}:{high}:50ms+ramp:{high}:{low}:50ms"
    return "+".join([f"constant:{low}:{SETTLED_S:g}s", *[to_and_fro] * 3])


def equivalent_delay(curve: Curve, judge: Judge) -> float:
    """Return the delay in seconds with which an otherwise perfect method would have the curve's RMS error.

    That is the RMS error over the RMS acceleration. On a ramp it is the lag; and it is defined as well for methods that
    follow ramps without a lag, which pay where the acceleration changes. The acceleration must not be 0.
    """
    instants = judge.among(curve.reads)
    assert judge.true_speed is not None
    truth = judge.true_speed(instants)
    acceleration = np.gradient(truth, instants)
    return rms_error(curve, instants, truth) / float(np.sqrt(np.mean(acceleration * acceleration)))


def cost(method: str, still: Curve, moving: Curve, judge: Judge, judge_moving: Judge) -> Cost | None:
    """Return what a setting costs: its error in one motion, its delay in another; None if it has no value by then."""
    rms = error_of(still, judge)
    if rms is None or not len(moving.estimate.time):
        return None
    return Cost(method, still.name, rms, equivalent_delay(moving, judge_moving))


def front(costs: Iterable[Cost]) -> list[Cost]:
    """Return the settings with which no other has both less error and less delay, by their delays."""
    kept: list[Cost] = []
    for cost in sorted(costs, key=lambda cost: (cost.delay, cost.rms)):
        if not kept or cost.rms < kept[-1].rms:
            kept.append(cost)
    return kept
