"""Cores of many axes: what they are, and what is refused."""

import json
import pickle
import re
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from tachometry.spec import AxesSpec, Encoder, ParameterError, Speed, STachometer, Timing, of_texts, with_axes
from tachometry.spec.core.index import Index
from tachometry.spec.core.timing import whole_clocks
from tachometry.spec.registers.manifest import manifest

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
    assert spec.axis.tick.max_count == ALONE.tick.max_count == 7
    assert spec_of(8, max_speed=None).axis.tick.max_count == 120
    assert spec_of(64, tick=2560, max_speed=Speed(Fraction(10**6))).axis.tick.max_count == 40
    assert spec.axis.velocity.width == ALONE.velocity.width


def test_it_is_the_same_in_another_process() -> None:
    spec = spec_of(5, parallel=True)
    again = pickle.loads(pickle.dumps(spec))
    assert (again, again.axis, hash(again)) == (spec, spec.axis, hash(spec))


def test_ports() -> None:
    assert not AxesSpec(tachometer=ALONE, axes=2).parallel
    strobed = {port.name: port.width for port in spec_of(5, index=Index()).ports}
    assert {name: strobed[name] for name in ("a", "b", "z", "axis", "decode_error_axis", "index_axis")} == {
        **dict.fromkeys(("a", "b", "z"), 5),
        **dict.fromkeys(("axis", "decode_error_axis", "index_axis"), 3),
    }
    widths = [next(port.width for port in spec_of(axes).ports if port.name == "axis") for axes in (1, 2, 8, 9)]
    assert widths == [1, 1, 3, 4]  # no port has no bits
    held = spec_of(5, index=Index(), parallel=True)
    values = {name for strobe in held.axis.ports.strobes.values() for name in strobe}
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
        "machines": 1,
        "first_tick": spec.tick_clock(0, 0),
    }
    assert told["velocity"] == manifest(ALONE)["velocity"]
    assert manifest(spec_of(8, max_speed=None))["velocity"]["full_scale"] == 120
    assert told["parameters"]["axes"] == 8
    with pytest.raises(ParameterError, match=r"^name must not be the name of a port: 'position_4'$"):
        manifest(spec_of(5, parallel=True), "position_4")


@pytest.mark.parametrize("parallel", [False, True])
def test_latencies(parallel: bool) -> None:
    """An axis is looked at last 8 clocks before the tick ends. Its count is handed over four clocks later.

    A turn takes two clocks more than there are from turn to turn, and holding the values one more.
    """
    spec = spec_of(8, parallel=parallel)
    assert [spec.look(axis, number) for axis, number in ((0, 0), (7, 0), (3, 5))] == [0, 7, 43]
    first, turn = 960 - 8 + 4, spec.turn_cycles
    for axis in range(8):
        for tick in (0, 3):
            clock = 960 * tick + first + axis * turn + turn + 2 + parallel
            assert spec.tick_clock(axis, tick) == clock
    assert manifest(spec)["axes"]["first_tick"] == spec.tick_clock(0, 0)
    told = manifest(spec)["latency_cycles"]
    assert told == {"pin_to_count": 2 + 8 - 1, "tick_latency": spec.tick_clock(7, 0) - 959, "tick_to_velocity": 0}


@pytest.mark.parametrize(("clocks", "looks"), [(1, 1), (2, 2), (9, 2), (10, 3), (255, 33)])
def test_a_filter_looks_once_more_than_a_shorter_glitch_can_be_seen(clocks: int, looks: int) -> None:
    """With eight clocks from look to look, a glitch of 8 clocks is seen once, and one of 9 twice."""
    spec = spec_of(8, filter_clocks=clocks)
    assert spec.axis.filter_clocks == looks
    assert spec.latency.pin_to_count == 2 + 8 - 1 + 8 * looks


def test_an_external_tick_has_turns_for_all_axes() -> None:
    spec = spec_of(8, external_tick=True)
    least, most = manifest(spec)["external_tick_cycles"].values()
    assert 8 * spec.turn_cycles + 8 <= least < 8 * spec.turn_cycles + 16
    assert most == 2 * 960
    assert manifest(spec)["latency_cycles"]["tick_in_to_window_end"] == 2 + 2 * 8 - 1


def test_a_unit_is_one_of_seconds_whatever_a_round_lasts() -> None:
    """An LSB of an axis is that of a core of its own, also where a round is no whole number of hertz."""
    for axes in (1, 7, 33):
        spec = spec_of(axes, unit="rpm", tick=9240)
        assert spec.axis.velocity.rad_per_s_per_lsb == pytest.approx(
            spec.tachometer.velocity.rad_per_s_per_lsb, rel=1e-12
        )
        assert spec.axis.velocity.lsb_per_count == spec.tachometer.velocity.lsb_per_count


def test_after_an_upset_an_axis_is_right_as_late_as_a_core_of_its_own() -> None:
    """In rounds; and two ticks and a round for what all axes share."""
    for spec in (spec_of(), spec_of(3, tick=1000), spec_of(5, tick=1000)):
        own = spec.axis.recovery.clocks
        assert own is not None
        shared = 2 * spec.timing.tick_cycles + {8: 8, 4: 4, 5: 8}[spec.slots]
        assert spec.recovery.clocks == manifest(spec, "t")["recovery_cycles"] == spec.slots * own + shared


def test_what_fits_is_accepted() -> None:
    for options in ({"external_tick": True}, {"max_ticks": 2048}, {"tick": 67 * 16}, {"unit": "rpm"}):
        assert spec_of(8, **options).axes == 8
    spec_of(8, velocity_width=22, filter_clocks=2, index=Index(reset=True))


def test_a_tick_has_a_turn_for_every_axis() -> None:
    """The ticks that a refused one is told to be are the nearest that there are."""
    fit, told = [], {}
    for tick in range(8, 200):
        try:
            spec = spec_of(8, tick=tick, max_ticks=100)
        except ParameterError as error:
            found = re.search(r" with --axes 8, not (\d+): try --tick ([\w.]+)(?: or ([\w.]+))?$", str(error))
            assert found is not None
            assert int(found[1]) == tick
            told[tick] = [whole_clocks("tick", text, 48_000_000) for text in found.groups()[1:] if text]
        else:
            assert tick % spec.slots == 0
            assert 8 * spec.turn_cycles + spec.slots <= tick
            fit.append(tick)
    assert len(fit) > 40
    for tick, near in told.items():
        if tick < fit[-1]:
            below = [one for one in fit if one < tick]
            assert near == [*below[-1:], next(one for one in fit if one > tick)]


def test_times_are_in_clocks_of_the_core() -> None:
    """Though those of an axis are rounds: an LSB of the interval is a tick, as in the manifest."""
    spec = spec_of(8)
    (interval,) = (port for port in spec.ports if port.name == "interval")
    assert interval.unit == "960 clocks"
    assert manifest(spec)["interval_unit_cycles"] == 960
    held = spec_of(3, tick=1000, parallel=True)
    assert {port.unit for port in held.ports if port.name.startswith("interval")} == {"1000 clocks"}


@pytest.mark.parametrize(("axes", "method"), [(8, "track"), (32, "track"), (64, "s")])
def test_auto_takes_tracking_where_two_machines_have_time_for_all_axes(axes: int, method: str) -> None:
    texts = {"ppr": "500", "max-speed": "1000rad/s", "tick": "100us", "max-time": "100ms"}
    assert of_texts("auto", texts, lambda spec: with_axes(spec, axes, parallel=False)).method == method


def test_a_speed_that_is_looked_at_too_seldom_is_told() -> None:
    assert spec_of(8).words.notes == spec_of(8, max_speed=None).words.notes == ()
    (note,) = spec_of(8, max_speed=Speed(Fraction(10**6))).words.notes
    assert note.startswith("greatest speed: an axis is looked at 120 times in a tick")


def test_the_reciprocal_is_that_of_a_table() -> None:
    for source in ("serial", "table"):
        spec = spec_of(8, reciprocal_source=source)
        assert spec.parameters["reciprocal_source"] == "table"
        memory = spec.words.memory
        assert memory is not None
        assert memory[0] == "table"
