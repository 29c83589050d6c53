import re
from fractions import Fraction

import pytest

from tachometry.spec import Encoder, Speed, STachometer, Timing, of_texts
from tachometry.spec.language.units import parse_frequency

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


ERRORS = [
    (lambda: Encoder(0), "pulses_per_rev must be from 1 to 4194304 with x4 decoding, not 0"),
    (lambda: Encoder(1 << 24, 2), "pulses_per_rev must be from 1 to 8388608 with x2 decoding, not 16777216"),
    (lambda: Encoder((1 << 24) + 1, 1), "pulses_per_rev must be from 1 to 16777216 with x1 decoding, not 16777217"),
    (lambda: Encoder(500, 3), "decoding must be 1, 2 or 4, or x1, x2 or x4, not 3"),
    (
        lambda: Timing.parse("1MHz", "20us", "1us"),
        "max_time must be a whole number of ticks, not 1us (0.05); nearest: 2 ticks (40us)",
    ),
    (
        lambda: Timing.parse("1MHz", "20us", "45us"),
        "max_time must be a whole number of ticks, not 45us (2.25); nearest: 2 ticks (40us) and 3 ticks (60us)",
    ),
    (
        lambda: Timing.parse("48 m", "20us", "10ms"),
        "clock must be a number with one of the units Hz, kHz, MHz, GHz, not '48 m'",
    ),
    (lambda: Timing.parse("0.5Hz", "20us", "10ms"), "clock must be a positive whole number of Hz, not '0.5Hz'"),
    (
        lambda: Timing.parse("48MHz", "20us", "10 m"),
        "max_time must be a number with one of the units s, ms, us, ns, clk, not '10 m'",
    ),
    (
        lambda: Timing.parse("48MHz", "20.01us", "10ms"),
        "tick must be a whole number of clocks, not 20.01us (960.48); nearest: 960clk (20us) and 961clk (20.0208333us)",
    ),
    (
        lambda: Timing.parse("48MHz", "1ns", "10ms"),
        "tick must be a whole number of clocks, not 1ns (0.048); nearest: 1clk (20.8333333ns)",
    ),
    (
        lambda: Timing.parse("48MHz", "20us", "10.01ms"),
        "max_time must be a whole number of ticks, not 10.01ms (500.5); nearest: "
        "500 ticks (10ms) and 501 ticks (10.02ms)",
    ),
    (lambda: Timing.parse("48MHz", "0us", "10ms"), "tick must be longer than 0, not 0us"),
    (lambda: Timing.parse("48MHz", "-20us", "10ms"), "tick must be longer than 0, not -20us"),
    (
        lambda: Speed.parse("400"),
        "max_speed must be a number with one of the units rad/s, rev/s, rpm: type 400rad/s, 400rev/s or 400rpm, "
        "not '400'",
    ),
    (lambda: Speed.parse("0rpm"), "max_speed must be greater than 0, not 0rpm"),
    (lambda: Speed(Fraction(1), "m/s"), "unit of a speed must be one of rad/s, rev/s, rpm, not 'm/s'"),
    (lambda: parse_frequency("clock", -5), "clock must be a positive whole number of Hz, not -5"),
]


@pytest.mark.parametrize(("make", "message"), ERRORS, ids=[message[:40] for _, message in ERRORS])
def test_errors_say_what_is_wrong_and_what_is_allowed(make: object, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        make()  # type: ignore[operator]


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
