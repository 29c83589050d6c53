"""Errors of the velocity with a map and without, from captures of a shaft that coasts down.

Bars are at 0.8 of the gains that are known of such discs; seeds of discs and of jitter are drawn here.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.nightly import nightly

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.calibrating.calibrate import calibrate
from tachometry.spec import of_texts

CORE = {"lines": "500", "clock": "48MHz", "tick": "20us", "max-speed": "400rad/s", "index": "yes"}
OFF_CENTRE, REAL = {"eccentricity": 0.25}, {"nonuniformity": 0.1, "phase_error_deg": 10.0}
MT = {"min-time": "20us", "max-time": "10ms"}


@pytest.mark.parametrize(
    ("method", "motion", "start", "disc", "gain"),
    [
        ("track", "constant:50rad/s:600ms", 0.3, OFF_CENTRE, 850),
        ("mt", "constant:50rad/s:300ms", 0.15, REAL, 2.5),
        ("s", "constant:50rad/s:300ms", 0.15, REAL, 1.5),
        pytest.param("track", "constant:217rad/s:400ms", 0.1, OFF_CENTRE, 2370, marks=nightly),
        pytest.param("track", "ramp:0:100rad/s:400ms", 0.1, OFF_CENTRE, 27, marks=nightly),
        pytest.param("mt", "sine:50rad/s:5Hz:400ms", 0.15, REAL, 2.5, marks=nightly),
        pytest.param("mt", "constant:217rad/s:300ms", 0.1, REAL, 1.6, marks=nightly),
        *(pytest.param("s", motion, 0.15, REAL, gain, marks=nightly) for motion, gain in (
            ("constant:5rad/s:600ms", 2.5),
            ("constant:217rad/s:300ms", 1.07),
            ("sine:50rad/s:5Hz:400ms", 1.6),
            ("sine:3rad/s:2Hz:1s", 2.0),
        )),
    ],
)  # fmt: skip
def test_a_map_makes_the_velocity_better(
    method: str, motion: str, start: float, disc: dict[str, Any], gain: float, tmp_path: Path
) -> None:
    more = {"mt": MT, "s": {"max-time": "10ms"}}.get(method, {"max-time": "100ms"})
    coasting = VirtualEncoder(500, index=True, jitter=0.05, seed=1013, **disc).record(
        parse_motion("ramp:150rad/s:60rad/s:2500ms")
    )
    found = calibrate([("coast", coasting.recording)], of_texts("s", {"lines": "500", "index": "yes"}))
    assert not found.reasons
    path = tmp_path / "disc.json"
    path.write_text(found.disc.text)
    turning = VirtualEncoder(500, index=True, jitter=0.05, seed=1013, **disc).record(parse_motion(motion))
    errors = []
    for map_of in ({}, {"disc": str(path)}):
        spec = of_texts(method, CORE | more | map_of)
        updates = golden.run(spec, PinTrace.of(turning.recording, spec).completed(spec)).updates
        at = updates.clock / 48e6
        error = updates.velocity * spec.velocity.rad_per_s_per_lsb - turning.true_speed(at)
        errors.append(float(np.sqrt(np.mean(error[(at > start) & (at < turning.recording.duration)] ** 2))))
    assert errors[0] / errors[1] > 0.8 * gain, errors
