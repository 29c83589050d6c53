"""The error of the electrical angle at the instant of its use, by the golden model."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tachometry.sim import golden
from tachometry.sim.encoder.motion import FloatArray, parse_motion
from tachometry.sim.encoder.sampled import encoder_of
from tachometry.sim.encoder.virtual import MAX_UNEVEN_PULSES
from tachometry.sim.studies.comparing.baselines import Steps, read
from tachometry.sim.studies.comparing.compare import Curve, Judge
from tachometry.sim.theory.performance import REAL_DISC
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.electrical import ElectricalAngle
from tachometry.spec.formats.angles import SHOWN_BITS
from tachometry.spec.language.option import ParameterError

_SETTLES, _SEEN, _MOST = 150, 100, 10_000  # ticks until the velocity is right, ticks or counts that are seen, and ticks


def expected(extra: ElectricalAngle, spec: TachometerSpec, rad_per_s: float) -> tuple[str, str] | None:
    """Return the row of the error at a constant speed, with a real disc in quadrature; None if there can be none.

    Where the disc has its zero is not part of the error.
    """
    if spec.external_tick or spec.encoder.pulses_per_rev > MAX_UNEVEN_PULSES:
        return None
    tick_s, counts = spec.timing.tick_cycles / spec.timing.clock_hz, rad_per_s / spec.scale.unit_velocity
    seen = min(max(_SEEN, math.ceil(_SEEN / counts)), _MOST) + extra.ahead // spec.timing.tick_cycles
    moved = parse_motion(f"constant:{rad_per_s!r}rad/s:{(_SETTLES + seen) * tick_s!r}s")
    encoder = encoder_of(spec, **(REAL_DISC if spec.encoder.sensor == "quadrature" else {}))
    ticks = golden.run(spec, encoder.record(moved).recording.place(spec.timing.clock_hz).completed(spec)).ticks
    begin, end = _SETTLES * spec.timing.tick_cycles, (_SETTLES + seen) * spec.timing.tick_cycles - extra.ahead
    ticks = ticks.rows((ticks.clock > begin) & (ticks.clock < end))
    true = extra.pole_pairs * np.degrees(moved.angle((ticks.clock + extra.ahead) / spec.timing.clock_hz))
    error = np.exp(1j * np.radians(ticks.angle * 360 / 2**SHOWN_BITS - true))
    away = np.degrees(np.angle(error / np.mean(error)))
    rms, worst = np.sqrt(np.mean(away**2)), np.abs(away).max()
    lead = f"{extra.ahead / spec.timing.tick_cycles:.4g} ticks ahead"
    return "angle error", f"{rms:.2g} degrees electrical RMS, at most {worst:.2g}, {lead} at a constant {{speed}}"


def judged(
    extra: ElectricalAngle,
    spec: TachometerSpec,
    curves: Sequence[Curve],
    steps: Steps,
    true_angle: Callable[[FloatArray], FloatArray],
    judge: Judge,
) -> list[tuple[FloatArray, FloatArray]]:
    """Return instants (s) and errors there (degrees) of angles at their use: of the position alone, and of each curve.

    The zero is that of the disc, by all of its edges; halls have their own. Cores are read at their ticks. A float
    model has its latest count, interpolated as in ODrive, and is carried on with its velocity to the instant of use.
    """
    turns_per_count, lead_s = extra.pole_pairs / float(steps.counts_per_rev), extra.ahead / spec.timing.clock_hz

    def true(time: FloatArray) -> FloatArray:
        return extra.pole_pairs * true_angle(time) / math.tau

    place = np.append(0, np.cumsum(steps.step))
    middle = place[1:] - steps.step / 2
    known = spec.encoder.sensor == "hall" or not len(middle)
    zero = 0.0 if known else float(np.mean(middle * turns_per_count - true(steps.time)))

    def errors(time: FloatArray, turns: FloatArray) -> tuple[FloatArray, FloatArray]:
        kept = (time >= judge.begin) & (time < judge.end - lead_s)
        if not kept.any():
            raise ParameterError("motion", "must last longer than --lead behind the first values")
        away = turns[kept] - zero - true(time[kept] + lead_s)
        return time[kept], ((away + 0.5) % 1 - 0.5) * 360

    reads = judge.among(curves[0].reads)
    seen, counts = (steps.time, place) if steps.taken is None else (steps.reads, np.append(0, steps.taken))
    found = [errors(reads, counts[np.searchsorted(seen, reads, side="right")] * turns_per_count)]
    for curve in curves:
        at = judge.among(curve.reads)
        if curve.angle is None:
            found.append(errors(at, _carried(curve, steps, at, lead_s) * turns_per_count))
        else:
            found.append(errors(curve.angle[0], (curve.angle[1] - extra.offset) / 2**SHOWN_BITS))
    return found


def _carried(curve: Curve, steps: Steps, at: FloatArray, lead_s: float) -> FloatArray:
    """Return counts that a float model has some time (s) after these instants (s)."""
    estimate = curve.estimate
    counts, speed = read(replace(steps, reads=estimate.time), None).counts, estimate.velocity / steps.count_rad
    ahead, between, found = speed * np.diff(estimate.time, prepend=0), 0.5, list[float]()
    for moved, more in zip(np.diff(counts, prepend=0).tolist(), ahead.tolist(), strict=True):
        inside = min(max(between + more, 0.0), 1.0) if more else 0.5
        between = inside if not moved else 0.0 if moved > 0 else 1.0
        found.append(between - 0.5)
    row = np.maximum(np.searchsorted(estimate.time, at, side="right") - 1, 0)
    carried: FloatArray = (counts + found)[row] + speed[row] * (at - estimate.time[row] + lead_s)
    return carried
