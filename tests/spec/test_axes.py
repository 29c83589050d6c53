"""Cores of many axes: what they are, and what is refused."""

import json
import pickle
import re
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from tachometry.spec import AxesSpec, Encoder, ParameterError, Speed, STachometer, Timing
from tachometry.spec.manifest import manifest
from tachometry.spec.parameters import TWO_TICKS

ALONE = STachometer(
    encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"), max_speed=Speed.parse("1000rad/s")
)


def spec_of(axes: int = 8, *, tick: int = 960, parallel: bool = False, **options: Any) -> AxesSpec:
    timing = Timing(48_000_000, tick, options.pop("max_ticks", 500))
    return AxesSpec(tachometer=replace(ALONE, timing=timing, **options), axes=axes, parallel=parallel)


@pytest.mark.parametrize(
    ("axes", "tick", "slots"),
    [(1, 960, 4), (4, 960, 4), (7, 960, 8), (8, 960, 8), (33, 960, 40), (64, 960, 64), (5, 341, 11)],
)
def test_a_round_is_the_least_divisor_of_the_tick_that_has_a_slot_for_every_axis(
    axes: int, tick: int, slots: int
) -> None:
    spec = spec_of(axes, tick=tick)
    assert (spec.slots, spec.rounds) == (slots, tick // slots)


def test_an_axis_is_a_core_whose_clock_is_a_round() -> None:
    spec = spec_of(8)
    assert spec.axis.timing.tick_cycles == 120
    assert spec.axis.timing.max_ticks == 500
    # The greatest speed is as many counts in a tick as of a core of its own, if it can be looked at so often.
    assert spec.axis.max_count == ALONE.max_count == 7
    assert spec_of(8, max_speed=None).axis.max_count == 120
    assert spec_of(64, tick=2560, max_speed=Speed(Fraction(10**6))).axis.max_count == 40
    assert spec.axis.velocity_width == ALONE.velocity_width


def test_it_is_the_same_in_another_process() -> None:
    spec = spec_of(5, parallel=True)
    again = pickle.loads(pickle.dumps(spec))
    assert (again, again.axis, hash(again)) == (spec, spec.axis, hash(spec))


def test_ports() -> None:
    strobed = {port.name: port.width for port in spec_of(5, index=True).ports}
    assert {name: strobed[name] for name in ("a", "b", "z", "axis", "decode_error_axis", "index_axis")} == {
        **dict.fromkeys(("a", "b", "z"), 5),
        **dict.fromkeys(("axis", "decode_error_axis", "index_axis"), 3),
    }
    held = spec_of(5, index=True, parallel=True)
    values = {name for strobe in held.axis.strobes.values() for name in strobe}
    assert {port.name for port in held.ports} == {
        *strobed.keys() - values,
        *(f"{name}_{axis}" for name in values for axis in range(5)),
    }
    assert all(port.help.endswith(".") for port in held.ports)


def test_manifest() -> None:
    spec = spec_of(8)
    told = manifest(spec)
    assert json.loads(json.dumps(told)) == told
    assert told["axes"] == {
        "axes": 8,
        "parallel": False,
        "round_cycles": 8,
        "turn_cycles": spec.turn_cycles,
        "first_tick": spec.tick_clock(0, 0),
    }
    assert told["velocity"] == manifest(ALONE)["velocity"]
    assert manifest(spec_of(8, max_speed=None))["velocity"]["full_scale"] == 120
    assert told["parameters"]["axes"] == 8
    with pytest.raises(ParameterError, match=r"^name must not be that of a port, which 'position_4' is$"):
        manifest(spec_of(5, parallel=True), "position_4")


def test_after_an_upset_an_axis_is_right_as_late_as_a_core_of_its_own() -> None:
    """In rounds; and two ticks and a round for what all axes share."""
    for spec in (spec_of(), spec_of(3, tick=1000)):
        own = spec.axis.recovery_clocks
        assert own is not None
        shared = 2 * spec.timing.tick_cycles + {8: 8, 4: 4}[spec.slots]
        assert spec.recovery_clocks == manifest(spec, "t")["recovery_cycles"] == spec.slots * own + shared


@pytest.mark.parametrize(
    ("axes", "options", "told"),
    [
        (0, {}, "axes must be from 1 to 64, not 0"),
        (65, {}, "axes must be from 1 to 64, not 65"),
        (
            8,
            {"unit": "rpm"},
            "unit must not be given together with axes: the conversion of the velocity is for one axis",
        ),
        (8, {"filter_clocks": 2}, "filter_clocks must not be given together with axes: "),
        (8, {"index": True, "index_reset": True}, "index_reset must not be given together with axes: "),
        (8, {"max_tick_cycles": TWO_TICKS}, "max_tick_cycles must not be given together with axes: "),
        (8, {"age": True}, "age must not be given together with axes: "),
        (8, {"bounds": True}, "bounds must not be given together with axes: "),
        (8, {"lowpass": Fraction(100)}, "lowpass must not be given together with axes: "),
        (8, {"velocity_width": 22}, "velocity_width must not be given together with axes: "),
        (8, {"max_ticks": 4096}, "max_ticks must be at most 2048 with axes, not 4096: 1/m_s is looked up"),
        (8, {"tick": 67 * 16}, ""),
        (8, {"tick": 997}, "tick_cycles must be a multiple of a number from 8 to 64 with axes, not 997"),
        (2, {"tick": 998}, "tick_cycles must be a multiple of a number from 4 to 64 with axes, not 998"),
    ],
)
def test_what_is_refused(axes: int, options: dict[str, Any], told: str) -> None:
    if not told:
        spec_of(axes, **options)
        return
    with pytest.raises(ParameterError) as error:
        spec_of(axes, **options)
    assert str(error.value).startswith(told)


def test_a_tick_has_a_turn_for_every_axis() -> None:
    short, told = (
        0,
        r"^tick_cycles must be at least (\d+) with 8 axes, \d+ clocks for each and a round of 8, not (\d+)$",
    )
    for tick in range(8, 160, 8):
        try:
            spec = spec_of(8, tick=tick)
        except ParameterError as error:
            found = re.match(told, str(error))
            assert found is not None
            assert int(found[1]) > int(found[2]) == tick
            short += 1
        else:
            assert 8 * spec.turn_cycles + 8 <= tick
    assert 3 < short < 15
