"""The golden model of the tracking method beside the same recursion in double precision: within one LSB.

The recursion decides at thresholds, whether an error is large, for instance. Where a number lies on a threshold but for
rounding, both may decide differently, and go different ways from there. Then the recursion is run again with this
decision turned over; it must have been closer than `CLOSE`.
"""

import math
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import only

from tachometry.sim import golden
from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.golden.front_end import decoded
from tachometry.sim.golden.sampling import windows
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.theory.tracking import Recursion, Tuning, track
from tachometry.spec import Encoder, Timing, TrackTachometer

REAL: dict[str, object] = {"jitter": 0.05, "nonuniformity": 0.1, "phase_error_deg": 10}
BAD: dict[str, object] = {"jitter": 0.1, "nonuniformity": 0.2, "phase_error_deg": 20}
UP_AND_DOWN = "ramp:0:200rad/s:50ms+constant:200rad/s:50ms+ramp:200rad/s:0:50ms+stop:50ms"
MOTIONS: dict[str, tuple[str, dict[str, object], float]] = {
    "ramp": ("ramp:0:100rad/s:400ms", {}, 0.4),
    "ramp, real": ("ramp:0:100rad/s:400ms", REAL, 0.4),
    "very slow": ("constant:0.4rad/s:1s", {"jitter": 0.05}, 0.4),
    "slow, real": ("constant:1.3rad/s:1s", REAL, 0.4),
    "fast": ("constant:217rad/s:400ms", {"jitter": 0.05}, 0.4),
    "fast, bad": ("constant:217rad/s:400ms", BAD, 0.6),
    "vibration": ("ramp:31rad/s:32rad/s:400ms", {"vibration": Vibration(2e-4, 170.0), "nonuniformity": 0.1}, 0.4),
    "reversals, real": ("sine:50rad/s:5Hz:400ms", REAL, 0.4),
    "reversals, bad": ("sine:50rad/s:5Hz:400ms", BAD, 0.6),
    "slow sine, real": ("sine:3rad/s:2Hz:1s", REAL, 0.4),
    "fast sine, real": ("sine:100rad/s:50Hz:300ms", REAL, 0.4),
    "trapezoid, real": (UP_AND_DOWN, REAL, 0.4),
    "stop": ("constant:20rad/s:200ms+stop:100ms", {}, 0.4),
}
CORES: list[dict[str, object]] = [
    {},
    {"unit": "rad/s"},
    {"bandwidth": Fraction(300), "agile": False},
    {"bandwidth": Fraction(4000), "fine_bits": 12},
    {"growing_memory": False, "least_memory": Fraction(9, 10), "unit": "rpm"},
]
CLOSE = 1e-3  # of the threshold


@dataclass
class Decisions(Recursion):
    """The recursion, with some decisions turned over; it remembers how close all were."""

    turned: frozenset[int] = frozenset()
    ticks: int = 0
    closeness: list[tuple[float, int, int]] = field(default_factory=list)  # and the tick, and the decision

    def tick(self, length: float, ages: list[float], steps: list[int], offsets: list[float] | None = None) -> None:
        """Take a tick."""
        super().tick(length, ages, steps, offsets)
        self.ticks += 1

    def reaches(self, value: float, limit: float) -> bool:
        """Return decide."""
        number = len(self.closeness)
        self.closeness.append((abs(value - limit) / limit if limit else math.inf, self.ticks, number))
        return super().reaches(value, limit) != (number in self.turned)


def deviations(spec: TrackTachometer, trace: PinTrace, recursion: Recursion) -> NDArray[np.float64]:
    """Return velocity, acceleration and fine position of the golden model less those of the recursion, in LSB: (3,
    n).
    """
    steps, (last, _) = decoded(spec, trace), windows(spec, trace)
    tables = golden.tables(spec, trace)
    ticks, updates = tables["tick"], tables["velocity_valid"]
    counted, n = steps.step != 0, len(updates.clock)
    found = track(Tuning.of(spec), steps.clock[counted], steps.step[counted], last, recursion)
    tick = float(spec.timing.tick_seconds)
    per_second = 1.0 if spec.unit == "count/tick" else tick
    velocity = found.velocity[:n] * tick * float(spec.scale.per_count) * 2.0**spec.widths.frac_bits
    acceleration = found.acceleration[:n] * tick**2 * float(spec.scale.per_count) / per_second
    fine = updates["position_fine"] - (ticks.position[:n] << spec.fine_bits)
    return np.array(
        [
            updates.velocity - velocity,
            updates["acceleration"] - acceleration * 2.0**spec.acceleration.frac_bits,
            fine - found.place[:n] * 2.0**spec.fine_bits,
        ]
    )


def greatest_deviation(spec: TrackTachometer, trace: PinTrace) -> tuple[float, int]:
    """Return the greatest of all, with as few decisions turned over as need be, and how many these are."""
    turned: frozenset[int] = frozenset()
    while True:
        recursion = Decisions(Tuning.of(spec), turned=turned)
        found = np.abs(deviations(spec, trace, recursion)).max(axis=0)
        first = int(np.argmax(found > 1))
        if found[first] <= 1:
            return float(found.max()), len(turned)
        near = [each for each in recursion.closeness if each[1] <= first and each[2] not in turned and each[0] < CLOSE]
        assert near, f"tick {first}: off by {found[first]:.3g} LSB, and no decision was close"
        # The latest one that was close began it.
        turned |= {max(near, key=lambda each: each[1:])[2]}
        assert len(turned) <= 5


@pytest.mark.parametrize("name", MOTIONS)
# Shorter ticks have fewer counts each and are five times as many; the recursion is the same.
@pytest.mark.parametrize("tick", only(["100us"], ["20us", "100us"]))
def test_within_one_lsb(name: str, tick: str) -> None:
    motion, faults, edge_error = MOTIONS[name]
    number = 2 * list(MOTIONS).index(name) + (tick == "20us")
    for options in (CORES[0], CORES[1 + number % (len(CORES) - 1)]):
        spec = TrackTachometer(
            encoder=Encoder(500),
            timing=Timing.parse("50MHz", tick, "10ms"),
            edge_error=Fraction(edge_error).limit_denominator(100),
            **options,  # type: ignore[arg-type]
        )
        encoding = VirtualEncoder(500, seed=number, **faults).record(parse_motion(motion))  # type: ignore[arg-type]
        worst, turned = greatest_deviation(spec, PinTrace.of(encoding.recording, spec))
        assert worst <= 1, (options, worst, turned)
