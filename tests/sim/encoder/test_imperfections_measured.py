"""A core measures the lines of every imperfection, by its golden model."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.lines import PITCH, record

from tachometry.sim import golden
from tachometry.sim.encoder.imperfections import Bounce
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.signals.run import Run
from tachometry.spec import Encoder, STachometer, Timing

PPR, CLOCK_HZ = 100, 200_000
CORE = STachometer(encoder=Encoder(PPR), timing=Timing(CLOCK_HZ, 80, 10))
# At top speed an edge in 25 clocks, 3.2 in a tick: to and fro, and 50 periods further.
MOTION = "constant:20rev/s:35ms+ramp:20rev/s:-20rev/s:10ms+constant:-20rev/s:10ms"


def steady(encoding: Encoding, run: Run) -> None:
    """Nothing that the position or the flags could tell."""
    assert behind(encoding, run) == 0
    assert len(run.errors) == 0


def behind(encoding: Encoding, run: Run) -> int:
    sampled = (run.ticks.clock[-1] - CORE.latency.tick - CORE.latency.pin_to_count) / CLOCK_HZ
    return int(encoding.true_position(sampled) - run.ticks.position[-1])


def steps_back(encoding: Encoding, run: Run) -> None:
    """Chatter over 10 clocks does not last from tick to tick."""
    assert abs(behind(encoding, run)) <= 1
    assert len(run.errors) == 0


def swallows(encoding: Encoding, run: Run) -> None:
    assert run.ticks.get("swallowed_edges")[-1] > 200
    assert len(run.errors) == 0


def loses(encoding: Encoding, run: Run) -> None:
    assert encoding.n_lost > 10
    assert abs(behind(encoding, run)) >= 4
    assert len(run.errors) == 0


def flags(encoding: Encoding, run: Run) -> None:
    assert len(run.errors) == encoding.n_illegal > 10


def loses_and_flags(encoding: Encoding, run: Run) -> None:
    assert encoding.n_lost > 10
    assert len(run.errors) > 10


@pytest.mark.parametrize(
    ("imperfection", "filter_clocks", "shows"),
    [
        ({"jitter": 0.1}, 0, steady),
        ({"nonuniformity": 0.2}, 0, steady),
        ({"phase_error_deg": 40.0}, 0, steady),
        ({"duty_error_deg": -40.0}, 0, steady),
        ({"bounce": Bounce(3, 50e-6)}, 0, steps_back),
        ({"bounce": Bounce(3, 50e-6)}, 11, swallows),
        ({"lost": 0.1}, 0, loses),
        ({"illegal": 0.1}, 0, flags),
        (
            {
                "jitter": 0.05,
                "nonuniformity": 0.05,
                "phase_error_deg": 20.0,
                "duty_error_deg": -20.0,
                "bounce": Bounce(2, 20e-6),
                "lost": 0.1,
                "illegal": 0.1,
                "index": True,
            },
            2,
            loses_and_flags,
        ),
    ],
    ids=lambda value: "+".join(value) if isinstance(value, dict) else None,
)
def test_it_shows_in_counts_and_flags(
    imperfection: dict[str, object], filter_clocks: int, shows: Callable[[Encoding, Run], None]
) -> None:
    spec = replace(CORE, filter_clocks=filter_clocks)
    place = {"pulses_per_rev": PPR, "start_angle_rad": 5 * PITCH}  # between two of these edges
    encoding, ideal = (record(MOTION, **place, **faults) for faults in (imperfection, {}))
    trace = encoding.recording.place(CLOCK_HZ)
    actual = golden.run(spec, trace)
    assert len(actual.updates.clock) > 20
    smooth = golden.run(spec, ideal.recording.place(CLOCK_HZ))
    assert not np.array_equal(actual.ticks.pulse_count, smooth.ticks.pulse_count)
    shows(encoding, actual)
