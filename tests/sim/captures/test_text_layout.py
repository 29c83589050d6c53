"""Names, units and rows are found among the first lines of a text, whatever is above them."""

import json
from pathlib import Path

import pytest

from tachometry.sim.captures.text_layout import sniff
from tachometry.sim.captures.time_unit import parse_time_unit, parted, rank, unit_named
from tachometry.spec.language.option import ParameterError

HEADS = json.loads(Path(__file__).with_name("heads.json").read_text(encoding="utf-8"))


# The head, rows and --time; then separator, names, units, and how many lines are above the rows.
@pytest.mark.parametrize(("head", "rows", "time", "found"), HEADS["heads"])
def test_the_head_of_a_text(head: str, rows: list[str], time: str | None, found: list[str]) -> None:
    lines = [line + "\n" for line in [*(head.split("\n") if head else []), *rows]]
    table = sniff(lines, time)
    assert table is not None
    names = None if table.names is None else ",".join(table.names)
    assert [table.separator, names, ",".join(table.units), table.start] == found
    cells = [cell for row in rows[:1] for cell in row.replace('"', "").split(None if found[0] == " " else found[0])]
    assert table.first == cells


@pytest.mark.parametrize("text", ["", "\n\n", "# only\n; comments\n", "words without end\n", "time\n", "a,b\n"])
def test_what_has_no_table(text: str) -> None:
    assert sniff(text.splitlines(keepends=True)) is None


def test_comments_are_kept_for_what_is_in_them() -> None:
    table = sniff(["; Samplerate: 4 kHz\n", "a,b\n", "#  so\n", "0,1\n", "# later\n"])
    assert table is not None
    assert table.comments == ["Samplerate: 4 kHz", "so"]


# The unit of a column of times is in its name, or is given.
@pytest.mark.parametrize(("name", "base", "unit", "likely"), HEADS["names"])
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
