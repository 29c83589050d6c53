"""Plans of all methods keep their promises, measured on the golden models with the virtual encoder."""

from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from motions import REAL
from support.nightly import only

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.sampled import encoder_of
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.plan import CELLS, Plans, plan_at
from tachometry.sim.theory.performance import REAL_DISC
from tachometry.spec import METHODS, Encoder, Speed, TachometerSpec, Timing, of_texts
from tachometry.spec.language.option import read_options

TICKS = 3000
OPTIONS: dict[str, dict[str, Any]] = {
    "m": {"average": 3},
    "adaptive": {"adaptive": Fraction(1, 20)},
    "whole cycles": {"whole_cycles": True},
    "track": {"max_memory": 500_000},
}
TIMINGS = {"track": Timing(10_000_000, 1000, 50)}  # which takes hundreds of clocks
SETTLED = {"track": 1000}  # ticks, as its memory has to grow; of the others 150
OF_METHOD = {"adaptive": "rairan", "whole cycles": "mt"}


def spec_of(method: str) -> TachometerSpec:
    return METHODS[OF_METHOD.get(method, method)](
        encoder=Encoder(500),
        timing=TIMINGS.get(method, Timing(1_000_000, 100, 50)),
        max_speed=Speed.parse("900rad/s"),
        frac_bits=20,
        **OPTIONS.get(method, {}),
    )


def speeds() -> list[float]:
    """Return speeds in counts per tick, from 1/100 to 20, none of them special, some close to multiples."""
    near = [k + d for k in (1, 2, 7) for d in (-0.013, 0.003, 0.029)]
    return [*(10 ** np.random.default_rng(5).uniform(-2, 1.3, 40)).tolist(), *near]


# Tracking and adaptive dt take ten times as many ticks to settle, and their plan uses the equations of the others.
@pytest.mark.parametrize("method", only(["s", "m", "t", "mt", "rairan"], [*METHODS, *OF_METHOD]))
def test_no_error_is_greater_than_the_resolution(method: str) -> None:
    spec = spec_of(method)
    tick = float(spec.timing.tick_seconds)
    reached = []
    for units in speeds():
        speed = units * spec.scale.unit_velocity
        encoder = VirtualEncoder(spec.encoder.pulses_per_rev, start_angle_rad=0.001)
        recording = encoder.record(parse_motion(f"constant:{speed!r}rad/s:{TICKS * tick!r}s")).recording
        updates = golden.run(spec, recording.place(spec.timing.clock_hz)).updates
        settled = updates.clock > SETTLED.get(method, 150) * spec.timing.tick_cycles
        error = np.abs(updates.velocity[settled] * spec.velocity.rad_per_s_per_lsb - speed)
        # A count's time is told to a clock. That is in the resolution of methods that measure times by the clock, and
        # not in that of Rairán's, to which the speed is a clock in dt higher or lower.
        clock = speed / spec.timing.tick_cycles if spec.method == "rairan" else 0.0
        expected = plan_at(spec, speed + clock * np.array([-1, 0, 1])).resolution.max()
        bound = expected + clock + (spec.velocity.rounding_lsb + 0.01) * spec.velocity.rad_per_s_per_lsb
        assert error.max() <= bound, units
        reached.append(error.max() / bound)
    assert max(reached) > 0.6


@pytest.mark.parametrize("method", METHODS)
def test_standstill(method: str) -> None:
    spec = spec_of(method)
    tick = float(spec.timing.tick_seconds)
    for units in (0.05, 0.9, 5.3):
        moving = 1000
        motion = f"constant:{units * spec.scale.unit_velocity!r}rad/s:{moving * tick!r}s+stop:{300 * tick!r}s"
        recording = VirtualEncoder(500).record(parse_motion(motion)).recording
        run = golden.run(spec, recording.place(spec.timing.clock_hz))
        latest = (
            (moving + spec.times.standstill_ticks + 1) * spec.timing.tick_cycles
            + spec.latency.tick
            + spec.latency.tick_to_velocity
        )
        zero = run.updates.clock > latest
        held = run.updates.velocity[~zero][-1]
        assert held == 0
        assert not run.updates.velocity[zero].any()


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
    told = float(worst.resolution[0] + worst.disc[0]) + spec.velocity.rad_per_s_per_lsb
    encoder = VirtualEncoder(500, seed=3, **read_options(VirtualEncoder, REAL))
    seen = []
    for speed in SPEEDS:
        recording = encoder.record(parse_motion(f"constant:{speed}rad/s:600ms")).recording
        updates = golden.run(spec, recording.place(spec.timing.clock_hz)).updates
        settled = updates.velocity[updates.clock > 0.3 * spec.timing.clock_hz]
        seen.append(np.abs(settled * spec.velocity.rad_per_s_per_lsb - speed).max())
    assert told / over < max(seen) < told


@pytest.mark.parametrize("bits", only(["20"], ["12", "17", "20"]))
def test_no_positions_are_worse_than_told(bits: str) -> None:
    texts = {"sensor": "sampled", "bits": bits, "clock": "20MHz", "tick": "100us", "max-time": "100ms"}
    for method, ratio in product(("track", "m"), (0.008, 0.1, 1.4, 77.7)):
        spec = of_texts(method, texts)
        speed = ratio * spec.scale.unit_velocity
        trace = PinTrace.of(encoder_of(spec).record(parse_motion(f"constant:{speed}rad/s:2s")).recording, spec)
        updates, plan = golden.run(spec, trace).updates, plan_at(spec, speed)
        settled = updates.velocity[updates.clock > 1.5 * spec.timing.clock_hz] * spec.velocity.rad_per_s_per_lsb
        told = plan.resolution[0] + spec.velocity.rad_per_s_per_lsb
        assert 0.01 * told < np.abs(settled - speed).max() < told, (method, ratio)


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
        float(plans.worst.resolution[0] + plans.worst.disc[0]) + plans.spec.velocity.rounding_lsb * lsb
        for plans in (Plans.of(of_texts("s", CORE)), better)
        if plans.worst is not None and (lsb := plans.spec.velocity.rad_per_s_per_lsb)
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
