from fractions import Fraction

import pytest

from tachometry.spec import Encoder, Speed, STachometer, Timing, of_texts

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
