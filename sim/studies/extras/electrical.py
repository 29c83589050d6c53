"""The error of the electrical angle at the instant of its use, by the golden model."""

import math

import numpy as np

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import MAX_UNEVEN_PULSES, VirtualEncoder
from tachometry.sim.theory.performance import REAL_DISC
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.electrical import ElectricalAngle
from tachometry.spec.formats.angles import SHOWN_BITS

_SETTLES, _SEEN, _MOST = 150, 100, 10_000  # ticks until the velocity is right, ticks or counts that are seen, and ticks


def expected(extra: ElectricalAngle, spec: TachometerSpec, rad_per_s: float) -> tuple[str, str] | None:
    """Return the row of the error at a constant speed, with a real disc in quadrature; None if there can be none.

    Where the disc has its zero is not part of the error.
    """
    if spec.external_tick or spec.encoder.pulses_per_rev > MAX_UNEVEN_PULSES:
        return None
    tick_s, counts = spec.timing.tick_cycles / spec.timing.clock_hz, rad_per_s / spec.scale.unit_velocity
    seen = min(max(_SEEN, math.ceil(_SEEN / counts)), _MOST) + extra.lead // spec.timing.tick_cycles
    moved = parse_motion(f"constant:{rad_per_s!r}rad/s:{(_SETTLES + seen) * tick_s!r}s")
    encoder = VirtualEncoder.of_core(spec, **(REAL_DISC if spec.encoder.sensor == "quadrature" else {}))
    ticks = golden.run(spec, encoder.record(moved).recording.place(spec.timing.clock_hz).completed(spec)).ticks
    begin, end = _SETTLES * spec.timing.tick_cycles, (_SETTLES + seen) * spec.timing.tick_cycles - extra.lead
    ticks = ticks.rows((ticks.clock > begin) & (ticks.clock < end))
    true = extra.pole_pairs * np.degrees(moved.angle((ticks.clock + extra.lead) / spec.timing.clock_hz))
    error = np.exp(1j * np.radians(ticks.angle * 360 / 2**SHOWN_BITS - true))
    away = np.degrees(np.angle(error / np.mean(error)))
    rms, worst = np.sqrt(np.mean(away**2)), np.abs(away).max()
    lead = f"{extra.lead / spec.timing.tick_cycles:.4g} ticks ahead"
    return "angle error", f"{rms:.2g} degrees electrical RMS, at most {worst:.2g}, {lead} at a constant {{speed}}"
