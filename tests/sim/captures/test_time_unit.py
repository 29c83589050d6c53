"""The unit of a column of times is in its name, or is given."""

import pytest

from tachometry.sim.captures.time_unit import parse_time_unit, parted, rank, unit_named
from tachometry.spec.language.option import ParameterError


@pytest.mark.parametrize(
    ("name", "base", "unit", "likely"),
    [
        ("time", "time", "", 0),
        ("TIME", "TIME", "", 0),
        ("Time [s]", "Time", "s", 0),
        ("time(us)", "time", "us", 0),
        ("Time (µs)", "Time", "µs", 0),
        ("time_ms", "time", "ms", 0),
        ("time.ns", "time", "ns", 0),
        ("time/ms", "time", "ms", 0),
        ("timems", "time", "ms", 0),
        ("tus", "t", "us", 3),
        ("time ticks", "time", "ticks", 0),
        ("timestamp_us", "timestamp", "us", 1),
        ("t", "t", "", 3),
        ("x-axis", "x-axis", "", 4),
        ("micros", "", "micros", 5),
        ("Nanoseconds", "", "Nanoseconds", 5),
        ("ticks", "", "ticks", 5),
        ("s", "", "s", 5),
        ("clock", "", "clock", None),
        ("", "", "", None),
        ("left", "left", "", None),
        ("items", "items", "", None),
        ("left_ms", "left", "ms", None),
        ("Zeit [ms]", "Zeit", "ms", None),
        ("time_left", "time_left", "", None),
    ],
)
def test_a_name_is_parted(name: str, base: str, unit: str, likely: int | None) -> None:
    assert parted(name) == (base, unit)
    assert rank(name) == likely


@pytest.mark.parametrize(
    ("words", "name", "per_second"),
    [
        ("s sec secs Second seconds", "s", 1),
        ("ms msec millis Milliseconds", "ms", 1e3),
        ("us µs μs usecs micros microsecond", "us", 1e6),
        ("ns nano nanoseconds", "ns", 1e9),
        ("ps picoseconds", "ps", 1e12),
        ("tick Ticks clocks cycles samples sequence", "ticks", 0),
    ],
)
def test_units_have_many_names(words: str, name: str, per_second: float) -> None:
    assert {unit_named(word) for word in words.split()} == {(name, per_second)}
    if per_second:
        assert {parse_time_unit("time_unit", word) for word in words.split()} == {(name, per_second)}


@pytest.mark.parametrize(
    ("text", "per_second"), [("16MHz", 16e6), ("32768Hz", 32768), ("1000Hz", 1000), ("2.5kHz", 2500), ("1GHz", 1e9)]
)
def test_the_rate_of_a_counter(text: str, per_second: float) -> None:
    assert parse_time_unit("time_unit", text) == ("ticks", per_second)


@pytest.mark.parametrize("text", ["", "ticks", "fortnight", "0Hz", "-1MHz", "mhz s", "1s"])
def test_what_is_no_unit(text: str) -> None:
    with pytest.raises(ParameterError, match=r"^time_unit must be one of s, ms, us, ns, or the rate of what counts"):
        parse_time_unit("time_unit", text)
    assert text == "ticks" or unit_named(text) is None
