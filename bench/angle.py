"""Measures the error of the electrical angle at the instant of its use, for docs/measured/angle.md.

Virtual encoders and the golden model are exact, so that the page is the same on every machine.
"""

from collections.abc import Iterator, Mapping

import numpy as np
from motions import REAL, values_of
from pages import MEASURED, Rows, measure

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.comparing.compare import Judge, core_curve
from tachometry.sim.studies.comparing.comparison import steps_beside
from tachometry.sim.studies.extras import judged_angles
from tachometry.spec import TachometerSpec, of_texts

PAGE = MEASURED / "angle.md"
FIRST_SEED = 701
LEADS = ("0tick", "0.5tick", "1tick", "1.5tick", "2tick")
BASE = {"clock": "48MHz", "tick": "100us", "max-time": "100ms", "max-speed": "6000rpm"}
ENCODERS: Mapping[str, Mapping[str, str]] = {
    "P 7 of 4000": {"lines": "1000", "electrical": "7"},
    "P 21 of 10,000": {"lines": "2500", "electrical": "21"},
    "P 7 of 512": {"lines": "128", "electrical": "7"},
    "halls, P 7": {"sensor": "hall", "pole-pairs": "7", "electrical": "7"},
}
# By what they are: the motion, and the seconds that are left out.
MOTIONS: Mapping[str, tuple[str, float]] = {
    "constant 217 rad/s": ("constant:217rad/s:400ms", 0.15),
    "constant 1.3 rad/s": ("constant:1.3rad/s:600ms", 0.3),
    "constant 0.05 rad/s": ("constant:0.05rad/s:1200ms", 0.6),
    "ramp to 300 rad/s in 75 ms": ("ramp:0:300rad/s:75ms+constant:300rad/s:75ms", 0.03),
    "sine 300 rad/s, 20 Hz": ("sine:300rad/s:20Hz:150ms", 0.02),
    "sine 50 rad/s, 5 Hz": ("sine:50rad/s:5Hz:500ms", 0.1),
    "stop at once from 20 rad/s": ("constant:20rad/s:200ms+stop:200ms", 0.1),
    "200 rad/s and to rest": ("ramp:0:200rad/s:50ms+constant:200rad/s:50ms+ramp:200rad/s:0:50ms+stop:50ms", 0.01),
}


def core(encoder: str, method: str = "track", lead: str = "1.5tick") -> TachometerSpec:
    """Return a core with an angle."""
    return of_texts(method, {**BASE, **ENCODERS[encoder], "lead": lead})


def errors(spec: TachometerSpec, motion: str, seed: int) -> tuple[float, float]:
    """Return RMS and greatest error in electrical degrees, at the instant of use, on a real disc."""
    words, begin = MOTIONS[motion]
    values = {} if spec.encoder.sensor == "hall" else values_of(REAL, seed)
    truth = VirtualEncoder.of_core(spec, **values).record(parse_motion(words))
    curves = [core_curve("", spec, PinTrace.of(truth.recording, spec))]
    judge = Judge(truth.true_speed, begin, truth.recording.duration)
    steps = steps_beside(spec, truth.recording)
    _, (_, error) = judged_angles(spec, curves, steps, truth.true_angle, judge)
    return float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())


def rows(encoder: str, method: str, leads: tuple[str, ...], seeds: int) -> Iterator[list[str]]:
    """Yield a row a motion: RMS and greatest error at each of these leads."""
    for motion in MOTIONS:
        found = [
            [errors(core(encoder, method, lead), motion, FIRST_SEED + seed) for seed in range(seeds)] for lead in leads
        ]
        cells = [f"{np.mean([rms for rms, _ in each]):.2g} / {max(most for _, most in each):.2g}" for each in found]
        yield [encoder, method, motion, *cells]


def table(seeds: int) -> Rows:
    """Return errors of all encoders, and of other methods on the first."""
    every = [row for encoder in ENCODERS for row in rows(encoder, "track", LEADS, seeds)]
    every += [row for method in ("mt",) for row in rows("P 7 of 4000", method, LEADS, seeds)]
    return [["encoder", "method", "motion", *LEADS], *every]


if __name__ == "__main__":
    measure(PAGE, {"angle": table}, seeds=1)
