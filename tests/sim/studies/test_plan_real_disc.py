"""The error that is told of a real disc holds for the golden models, and is not far from what they show."""

import numpy as np
import pytest
from motions import REAL

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.studies.plan import CELLS, Plans
from tachometry.sim.theory.performance import REAL_DISC
from tachometry.spec import of_texts
from tachometry.spec.language.option import read_options

CORE = {"ppr": "500", "clock": "10MHz", "tick": "100us", "max-time": "10ms", "max-speed": "400rad/s"}
SPEEDS = (1.3, 7, 15, 30, 40, 61, 127, 200, 390)  # rad/s; a count per tick is 31.4


@pytest.mark.parametrize(
    ("method", "own", "over"),
    [
        ("s", {}, 3),
        ("s", {"decoding": "1"}, 3),
        ("m", {}, 2),
        ("t", {}, 4),
        ("mt", {}, 3),
        ("mt", {"min-time": "5ms"}, 4),
        ("rairan", {}, 2),
        ("track", {"max-memory": "40ms"}, 6),
    ],
)
def test_no_golden_model_is_worse_than_told(method: str, own: dict[str, str], over: float) -> None:
    spec = of_texts(method, CORE | own)
    worst = Plans.of(spec).worst
    assert worst is not None
    told = float(worst.resolution[0] + worst.disc[0]) + spec.scale.rad_per_s_per_lsb
    encoder = VirtualEncoder(500, seed=3, **read_options(VirtualEncoder, REAL))
    seen = []
    for speed in SPEEDS:
        recording = encoder.record(parse_motion(f"constant:{speed}rad/s:600ms")).recording
        updates = golden.run(spec, recording.place(spec.timing.clock_hz)).updates
        settled = updates.velocity[updates.clock > 0.3 * spec.timing.clock_hz]
        seen.append(np.abs(settled * spec.scale.rad_per_s_per_lsb - speed).max())
    assert told / over < max(seen) < told


def test_the_disc_is_that_of_compare() -> None:
    names = {"jitter": "jitter", "nonuniformity": "nonuniformity", "phase_error_deg": "phase-error"}
    assert {names[name]: value for name, value in REAL_DISC.items()} == {
        name: float(text) for name, text in REAL.items()
    }


def test_advice_names_what_is_much_better_and_what_it_costs() -> None:
    advice = Plans.of(of_texts("s", CORE)).advice
    assert advice is not None
    better = Plans.of(of_texts("track", CORE))
    assert (advice.method, advice.cells) == ("track", CELLS["track"] - CELLS["s"])
    errors = [
        float(plans.worst.resolution[0] + plans.worst.disc[0]) + plans.spec.scale.rounding_lsb * lsb
        for plans in (Plans.of(of_texts("s", CORE)), better)
        if plans.worst is not None and (lsb := plans.spec.scale.rad_per_s_per_lsb)
    ]
    assert advice.gain == pytest.approx(errors[0] / errors[1], rel=0.05)
    assert better.advice is None


def test_advice_names_what_is_as_good_and_much_smaller(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = of_texts("rairan", CORE | {"tick": "10us"})  # track does not fit
    monkeypatch.setitem(CELLS, "rairan", 2 * CELLS["s"])
    advice = Plans.of(spec).advice
    assert advice is not None
    assert (advice.method, advice.cells) == ("s", -CELLS["s"])
    assert 1 / 1.5 < advice.gain < 10
