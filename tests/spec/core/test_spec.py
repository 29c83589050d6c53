"""Limits of what every core is given, and times after which it is right again."""

import re
from fractions import Fraction
from typing import Any

import pytest
from support import docs

from tachometry.spec import (
    Encoder,
    MTachometer,
    RairanTachometer,
    Speed,
    STachometer,
    Timing,
    TTachometer,
    of_options,
    of_texts,
)
from tachometry.spec.core.timing import MAX_TICK_CYCLES

TIMING = Timing(48_000_000, 960, 500)


@pytest.mark.parametrize(
    ("clock", "tick", "max_time"),
    [
        ("48MHz", "20us", "10ms"),
        ("48000kHz", "20000ns", "0.01s"),
        (48_000_000, 960, 480_000),
        ("48000000Hz", "960clk", "480000clk"),
        ("4.8e7Hz", "2e-5s", "1e4us"),
    ],
)
def test_timing_in_times_or_clocks(clock: str | int, tick: str | int, max_time: str | int) -> None:
    assert Timing.parse(clock, tick, max_time) == TIMING


@pytest.mark.parametrize("decoding", [1, 2, 4])
def test_the_fewest_and_the_most_counts_of_a_revolution(decoding: int) -> None:
    assert Encoder(1, decoding).counts_per_rev == decoding
    assert Encoder(2**24 // decoding, decoding).counts_per_rev == 2**24


@pytest.mark.parametrize(
    ("text", "counts"),
    [
        # 2000 counts, 20 µs: ω_u = 50π rad/s = 25 rev/s = 1500 rpm.
        ("157.07rad/s", 1),
        ("157.08rad/s", 2),
        ("25rev/s", 1),
        ("25.0001rev/s", 2),
        ("1500rpm", 1),
        ("1000rad/s", 7),
        ("1e9rpm", 960),
    ],
)
def test_max_speed_in_counts_per_tick(text: str, counts: int) -> None:
    spec = STachometer(encoder=Encoder(500), timing=TIMING, max_speed=Speed.parse(text))
    assert spec.tick.max_count == counts


@pytest.mark.parametrize(
    ("speed", "longest", "counts"),
    [
        # As above, in an external tick that may last longer than 20 µs: until 40 µs, where nothing else is asked for.
        ("25rev/s", None, 2),
        ("25.0001rev/s", None, 3),
        ("25rev/s", "20us", 1),
        ("25rev/s", "50us", 3),
        ("1500rpm", "1ms", 50),
        ("1e9rpm", None, 1920),
        (None, None, 1920),
        (None, "1ms", 48_000),
    ],
)
def test_max_count_is_that_of_the_longest_external_tick(speed: str | None, longest: str | None, counts: int) -> None:
    texts = {"ppr": "500", "tick": "20us", "external-tick": "yes", "max-speed": speed, "max-tick-period": longest}
    for method in ("m", "s", "mt"):
        assert of_texts(method, texts).tick.max_count == counts, method


@pytest.mark.parametrize("text", ["12.5rad/s", "1.98943678864869rev/s", "119.366207318922rpm"])
def test_speed_in_rad_per_s(text: str) -> None:
    assert Speed.parse(text).rad_per_s == pytest.approx(12.5, rel=1e-14)


def test_a_unit_of_another_quantity_is_no_speed() -> None:
    with pytest.raises(ValueError, match=r"^unit of a speed must be one of rad/s, rev/s, rpm, not 'm/s'$"):
        Speed(Fraction(1), "m/s")


def spec_of(tick: int = 20, max_ticks: int = 10, **options: Any) -> MTachometer:
    return MTachometer(encoder=Encoder(8), timing=Timing(1_000_000, tick, max_ticks), **options)


RANGES = [
    ("velocity_width", 8, 64),
    ("position_width", 8, 48),
    ("filter_clocks", 0, 100_000),
    ("frac_bits", 4, 24),
    ("average", 1, 256),
]


@pytest.mark.parametrize(("name", "least", "most"), RANGES)
def test_ends_of_ranges(name: str, least: int, most: int) -> None:
    for value in (least, most):
        assert getattr(spec_of(**{name: value}), name) == value
    for value in (least - 1, most + 1):
        with pytest.raises(ValueError, match=f"^{name} must be from {least} to {most}.*, not {value}"):
            spec_of(**{name: value})


def test_a_filter_is_given_in_clocks_or_in_time() -> None:
    """A time is rounded up to clocks: at a slow clock 255 clocks may be longer than 10 ms."""
    for text, clocks in (("4", 4), ("4clk", 4), ("2ms", 96_000), ("10ms", 480_000), ("21ns", 2), ("0", 0)):
        spec = of_texts("t", {"ppr": "8", "clock": "48MHz", "filter": text})
        assert spec.filter_clocks == clocks
        assert of_options(spec.options) == spec
    assert of_texts("s", {"ppr": "8", "clock": "1kHz", "tick": "1ms", "filter": "255"}).filter_clocks == 255


def test_ends_of_timing() -> None:
    """100 GHz, 2^20 clocks and 2^20 ticks; a clock, a clock and two ticks."""
    assert Timing(10**11, 1 << 20, 1 << 20).tick_seconds == Fraction(1 << 20, 10**11)
    assert Timing(1, 1, 2).tick_seconds == 1
    for given, message in (
        ((10**11 + 1, 1, 2), "clock must be from 1 Hz to 100 GHz, not 1e+11 Hz"),
        ((0, 2, 2), "clock must be from 1 Hz to 100 GHz, not 0 Hz"),
        ((1, 0, 2), "tick_cycles must be from 1 to 1048576, 1048576s, not 0"),
        ((1, (1 << 20) + 1, 2), "tick_cycles must be from 1 to 1048576, 1048576s, not 1048577"),
        ((1, 1, (1 << 20) + 1), "max_ticks must be from 2 to 1048576, 1048576s, not 1048577"),
        ((1, 1, 1), "max_ticks must be from 2 to 1048576, 1048576s, not 1"),
    ):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            Timing(*given)


def test_the_edge_error_is_rounded_up_to_eighths() -> None:
    given = [Fraction(0), Fraction(1, 1000), Fraction(1, 8), Fraction(126, 1000), Fraction(99, 100), Fraction(1)]
    assert [8 * spec_of(bounds=True, edge_error=error).bound.edge_error for error in given] == [0, 1, 1, 2, 8, 8]


def test_ends_of_external_ticks() -> None:
    assert spec_of(2, external_tick=True, max_tick_cycles=2).tick.longest == 2
    assert spec_of(20, external_tick=True, max_tick_cycles=MAX_TICK_CYCLES).tick.longest == 1 << 20


def test_the_fastest_filter_is_2_pi_times_the_clock() -> None:
    fastest = 2 * Fraction(314159265358979323846264338327950288419716939937510, 10**50) * 10**6
    assert spec_of(1, lowpass=fastest).lowpass == fastest
    with pytest.raises(ValueError, match=r"^lowpass must be from "):
        spec_of(1, lowpass=fastest + Fraction(1, 10**40))


def silence(max_ticks: int, tick: int) -> int:
    """Return the counter of the ticks of a silence that may wrap first."""
    return (2 ** max_ticks.bit_length() + 1) * tick


def test_recovery() -> None:
    """docs/concepts/verification.md: the synchroniser, the step, the open window and a whole one, what the method
    remembers or a silence, and the tick; counters wrap first.
    """
    for tick, begun in ((1, 2), (2, 2), (3, 3), (4, 5), (20, 33)):
        spec = spec_of(tick)
        assert spec.recovery.clocks == 2 + 1 + begun + silence(10, tick) + 2
    for clocks, held in ((1, 2), (2, 2), (3, 4), (5, 8), (255, 256)):
        assert spec_of(20, filter_clocks=clocks).recovery.clocks == 2 + held + clocks + 1 + 33 + silence(10, 20) + 2
    # From 16 clocks on the tick is counted otherwise.
    assert [spec_of(tick).recovery.front for tick in (15, 16, 17)] == [2 + 1 + 1 + bits for bits in (16, 32, 32)]
    long = spec_of(20, average=200)
    assert long.recovery.clocks == 2 + 1 + 33 + 201 * 20 + long.latency.tick_to_velocity + 2
    assert spec_of(20, external_tick=True, max_tick_cycles=50).recovery.clocks == 2 + 1 + 65 + silence(10, 50) + 2
    assert spec_of(20, lowpass=Fraction(100)).recovery.clocks is None
    rairan = RairanTachometer(encoder=Encoder(8), timing=Timing(1_000_000, 20, 10), paper_exact=True)
    assert rairan.recovery.clocks is None


def test_ticks_between_a_cause_and_its_update() -> None:
    """An update that a tick causes has passed this one; one that a count causes has not."""

    def ticks(spec: STachometer | MTachometer | TTachometer) -> int:
        shortest = spec.times.shortest_tick
        whole = next(n for n in range(999) if n * shortest >= spec.latency.tick_to_velocity + spec.latency.low_pass)
        return whole - (spec.facts.update_by != "count")

    for tick in (1, 2, 3, 7, 20):
        for made in (STachometer, MTachometer, TTachometer):
            for options in ({}, {"lowpass": Fraction(1000)}, {"external_tick": True, "max_tick_cycles": 4 * tick}):
                if tick > 1 or "max_tick_cycles" not in options:
                    spec = made(encoder=Encoder(8), timing=Timing(1_000_000, tick, 10), age=True, **options)
                    assert spec.widths.stamp == ticks(spec).bit_length()
    assert spec_of(1).widths.stamp == 0


def test_options_of_the_page_of_absolute_encoders_are_taken() -> None:
    found = re.findall(r"(?:`|generate )(--sensor .*? --bits [^`\n]*)", docs.page("guides/absolute.md"))
    assert len(found) == 8
    for options in found:
        words = {name: word or "yes" for name, word in re.findall(r"--(\S+)(?: (?!-)(\S+))?", options)}
        of_texts("track", {"clock": "50MHz", "tick": "1ms"} | words)
