"""Numbers follow from the parameters of every core, found by trying or told by hand."""

import math
from fractions import Fraction
from typing import Any

import pytest

from tachometry.spec import Encoder, MTachometer, Speed, STachometer, Timing
from tachometry.spec.core.index import Index
from tachometry.spec.language.tools import complaint

UNITS = {"rad/s": 2 * Fraction(math.pi), "rev/s": Fraction(1), "rpm": Fraction(60)}  # of a revolution per second


def spec_of(tick: int = 960, **options: Any) -> STachometer:
    return STachometer(encoder=Encoder(500), timing=Timing(48_000_000, tick, 500), **options)


def per_count(unit: str) -> Fraction:
    """Return a count in 20 µs of 2000 a revolution is 25 rev/s."""
    return 25 * UNITS[unit]


@pytest.mark.parametrize("unit", UNITS)
def test_range_of_the_lsb(unit: str) -> None:
    """The greatest speed, 960 counts a tick, is an LSB at least; a count a tick is 2^22 LSB at most."""
    coarsest, finest = spec_of().velocity.frac_bits_range(unit)
    tried = range(-40, 40)
    assert coarsest == min(f for f in tried if per_count(unit) * 960 * Fraction(2) ** f > 1)
    assert finest == max(f for f in tried if per_count(unit) * Fraction(2) ** f <= 2**22)
    for f in (coarsest, 0, finest):
        spec = spec_of(unit=unit, frac_bits=f)
        # An LSB of the counts is a quarter of one of the unit at most, and they have 4 fraction bits at least.
        lsb = per_count(unit) * Fraction(2) ** f
        assert spec.velocity.native_frac_bits == min(n for n in range(4, 60) if 2**n >= 4 * lsb)
        # The output is off by an eighth at most before it is rounded.
        least, most = (math.floor(960 * lsb + Fraction(eighths, 8)) for eighths in (3, 5))
        assert spec.velocity.width == spec.velocity.needed_width
        assert least.bit_length() <= spec.velocity.width - 1 <= most.bit_length()
        assert least <= spec.velocity.full_scale <= most
        assert not spec.velocity.narrow
        assert spec.latency.tick_to_velocity == spec.latency.datapath + spec.latency.output
        assert spec.velocity.greatest_speed == pytest.approx(2 * math.pi * 25 * 960, rel=1e-3 if f > coarsest else 1)
    for f in (coarsest - 1, finest + 1):
        with pytest.raises(ValueError, match=f"^lsb must be from 2.{-finest} to 2.{-coarsest} {unit} with this"):
            spec_of(unit=unit, frac_bits=f)


def test_ports_that_have_a_sign_and_those_of_16_bits() -> None:
    spec = spec_of(index=Index(), filter_clocks=2, bounds=True, position_width=40)
    signed = [port.name for port in spec.ports if port.signed]
    assert signed == ["velocity", "pulse_count", "position", "velocity_lower", "velocity_upper", "index_position"]
    widths = {port.name: port.width for port in spec.ports}
    assert (widths["filtered_edges"], widths["index_position"], widths["position"]) == (16, 40, 40)
    assert {port.name for port in spec.ports if port.is_strobe} == set(spec.ports.strobes)


# An update takes 8 clocks and one to start over; then the reciprocal, with 16 + 21 bits behind the point, takes 38.
BUSY = 8 + 1 + 38


@pytest.mark.parametrize("width", [8, 9, 13, 20])
@pytest.mark.parametrize("unit", ["count/tick", *UNITS])
def test_what_fits_the_bits_of_the_velocity(unit: str, width: int) -> None:
    """With a greatest speed, there are as many fraction bits as show it in the bits that there are."""
    speed = Speed(Fraction(100), "rev/s")  # four counts a tick
    one = Fraction(1) if unit == "count/tick" else per_count(unit)
    spec = spec_of(unit=unit, velocity_width=20, max_speed=speed)
    fitting = [f for f in range(-30, 30) if 4 * one * Fraction(2) ** f <= 2**19 - 1]
    assert spec.velocity.frac_bits == min(max(fitting), 16 if unit == "count/tick" else 10)
    narrow = spec_of(unit=unit, velocity_width=width, frac_bits=8)
    assert narrow.velocity.fitting_frac_bits(4) == max(
        f for f in range(-30, 30) if 4 * one * Fraction(2) ** f <= 2 ** (width - 1) - 1
    )
    if unit == "count/tick" and width == 20:
        assert not narrow.velocity.narrow  # 960 counts with 8 fraction bits
        return
    assert narrow.velocity.narrow
    assert narrow.velocity.full_scale == 2 ** (width - 1) - 1
    assert narrow.velocity.greatest_speed == pytest.approx((2 ** (width - 1) - 1) / 256 / float(one) * 50 * math.pi)
    assert narrow.velocity.shown_absent == 2 ** (width - 1) - 1


def test_counts_that_are_just_the_greatest_number() -> None:
    assert [spec_of(velocity_width=8, frac_bits=4).velocity.fitting_frac_bits(counts) for counts in (127, 128)] == [
        0,
        -1,
    ]


def test_saturated_counts_per_tick_have_an_output() -> None:
    assert not spec_of(velocity_width=27).velocity.narrow
    assert spec_of(velocity_width=27).velocity.output is None
    held = spec_of(velocity_width=26)
    assert held.velocity.narrow
    assert held.velocity.output is not None
    assert held.latency.tick_to_velocity == held.latency.datapath + held.latency.output > held.latency.datapath
    wide = spec_of(velocity_width=30)
    assert not wide.velocity.narrow
    assert wide.velocity.full_scale == 960 << 16


@pytest.mark.parametrize(("max_ticks", "longest"), [(2, 255), (255, 255), (256, 511), (500, 511), (512, 1023)])
def test_ticks_that_add_up_at_the_filter(max_ticks: int, longest: int) -> None:
    timing = Timing(48_000_000, 960, max_ticks)
    spec = STachometer(encoder=Encoder(500), timing=timing, lowpass=Fraction(100))
    form = spec.velocity.low_pass
    assert (form.max_interval, form.exponent, form.native_width) == (longest, Fraction(100, 50_000), 27)
    assert spec.latency.low_pass == form.latency
    assert spec.latency.tick_to_velocity == spec.latency.datapath + form.latency


def test_external_ticks_are_two_clocks_apart_and_leave_room_for_what_is_done_step_by_step() -> None:
    def fewest(tick: int, longest: int, **options: Any) -> int:
        return spec_of(tick, external_tick=True, max_tick_cycles=longest, **options).times.min_tick_cycles

    def pipelined(tick: int) -> STachometer:
        return spec_of(tick, external_tick=True, max_tick_cycles=2 * tick)

    # N of 7680 half counts has 14 bits.
    assert spec_of(960, external_tick=True, max_tick_cycles=1920).latency.datapath == 7 + 1
    assert fewest(960, 1920) == BUSY + 1
    assert (fewest(2, 4), pipelined(2).latency.serial) == (2, False)
    in_rpm = spec_of(960, external_tick=True, max_tick_cycles=1920, unit="rad/s", frac_bits=14)
    assert in_rpm.latency.output_serial
    assert in_rpm.times.min_tick_cycles >= max(BUSY, in_rpm.latency.output)
    assert in_rpm.times.update_spacing == in_rpm.times.min_tick_cycles
    assert spec_of(960).times.update_spacing == 960
    assert spec_of(960).tick.room == 960
    assert spec_of(960, external_tick=True, max_tick_cycles=960).tick.room == 480


@pytest.mark.parametrize(("eighths", "bits"), [(0, 0), (8, 0), (4, 1), (2, 2), (6, 2), (1, 3), (7, 3)])
def test_bits_of_the_edge_error(eighths: int, bits: int) -> None:
    spec = MTachometer(encoder=Encoder(8), bounds=True, edge_error=Fraction(eighths, 8))
    assert spec.bound.error_bits == bits
    assert spec.bound.uncertainty == Fraction(8 + eighths, 8)
    assert spec.bound.max == spec.tick.max_count + (1 if not eighths else 2)


@pytest.mark.parametrize(
    ("said", "line"),
    [
        ("", ""),
        ("one\n\n  two \n", "two"),
        ("Info: no\nERROR: it is too big\nERROR: and too slow\n2 errors\n", "ERROR: it is too big"),
        ("begins\nmodel.cc:3: error: no\nmore\n", "model.cc:3: error: no"),
        ('Traceback (most recent call last):\n  File "a.py"\n    raise Error(error)\na.Error: so\n', "so"),
        (
            "Traceback (most recent call last):\nError: mmap\n\nCannot allocate memory (os error 12)",
            "Cannot allocate memory (os error 12); it needs some 5 GB of addresses, see ulimit -v",
        ),
        ("x" * 1000, "x" * 300),
    ],
)
def test_one_line_says_why(said: str, line: str) -> None:
    assert complaint(said) == line
