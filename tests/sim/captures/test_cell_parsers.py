"""Cells of a text are levels, voltages and times, or are marked as none of these."""

import numpy as np
import pytest

from tachometry.sim.captures import cell_parsers
from tachometry.sim.captures.cell_parsers import BAD, HELD, Threshold, parse_threshold
from tachometry.spec.language.option import ParameterError


@pytest.mark.parametrize(
    ("cell", "level"),
    [
        *[(cell, 0) for cell in ("0", "0.0", "-0", "+0.00e+00", "False", "FALSE")],
        *[(cell, 1) for cell in ("1", "1.", "1.0", "+1", "1e0", "True", "true")],
        *[(cell, HELD) for cell in ("x", "X")],
        *[
            (cell, BAD)
            for cell in ("", "2", "-1", "0.5", "00", "01", "nan", "inf", "1_0", "١", "tall", "xx", "1 1", "1e")
        ],
    ],
)
def test_levels(cell: str, level: int) -> None:
    assert cell_parsers.levels(["0", cell, "1"]).tolist() == [0, level, 1]
    assert cell_parsers.is_value(cell) == (level != BAD or cell in ("2", "-1", "0.5", "00", "01"))


@pytest.mark.parametrize(
    ("cell", "bits"),
    [("0", (0, 0)), ("1", (1, 0)), ("2", (0, 1)), ("7", (1, 1)), ("x", (HELD, HELD)), ("999999999", (1, 1))]
    + [(cell, (BAD, BAD)) for cell in ("", "-1", "1.0", "true", "9999999999", "0x1")],
)
def test_bits(cell: str, bits: tuple[int, int]) -> None:
    assert tuple(int(cell_parsers.bits([cell], bit)[0]) for bit in (0, 1)) == bits


@pytest.mark.parametrize(
    ("text", "threshold", "levels"),
    [
        # volts of the line: 0, 1.3, 1.45, 1.5, 1.65, 1.3999, 1.7, then X, a word, 1.2
        ("1.5V", Threshold(1.5), [0, 0, 0, 1, 1, 0, 1, 1, BAD, 0]),
        ("1.5V:0.2V", Threshold(1.5, 0.2), [0, 0, 0, 0, 1, 0, 1, 1, BAD, 0]),
        ("1500mV:200mV", Threshold(1.5, 0.2), [0, 0, 0, 0, 1, 0, 1, 1, BAD, 0]),
        ("1.5:1", Threshold(1.5, 1.0), [0, 0, 0, 0, 0, 0, 0, 0, BAD, BAD]),
        ("1.5:0.5", Threshold(1.5, 0.5), [0, 0, 0, 0, 0, 0, 0, 0, BAD, 0]),
        ("-1V", Threshold(-1.0), [1, 1, 1, 1, 1, 1, 1, 1, BAD, 1]),
    ],
)
def test_voltages(text: str, threshold: Threshold, levels: list[int]) -> None:
    assert parse_threshold("threshold", text) == pytest.approx(threshold)
    column = ["0", "1.3", "1.45", "1.5", "1.65", "1.3999", "1.7", "X", "high", "1.2"]
    read = cell_parsers.compared(column, threshold, 1.0)
    assert cell_parsers.held(read, HELD).tolist() == levels
    assert (cell_parsers.compared([f"{1000 * float(cell)}" for cell in column[:7]], threshold, 1e-3) == read[:7]).all()


@pytest.mark.parametrize("text", ["", "high", "1.5V:", "1.5V:-1mV", "1.5A", "nan", "1:2:3"])
def test_what_is_no_threshold(text: str) -> None:
    with pytest.raises(ParameterError, match=r"^threshold must "):
        parse_threshold("threshold", text)


def test_what_is_held() -> None:
    row = np.array([HELD, 0, HELD, HELD, 1, HELD], np.int8)
    assert cell_parsers.held(row, HELD).tolist() == [HELD, 0, 0, 0, 1, 1]
    assert cell_parsers.held(row, 1).tolist() == [1, 0, 0, 0, 1, 1]


@pytest.mark.parametrize(
    ("cell", "nanoseconds"),
    [
        ("2025-06-01T00:00:00.5Z", 500_000_000),
        ("2025-06-01 00:00:01.000000001", 1_000_000_001),
        ("2025-06-02T00:00:00+02:00", 86_400_000_000_000),
        ("2024-02-29T00:00:00", -39_571_200_000_000_000),
        ("2025-02-29T00:00:00", None),
        ("2025-13-01T00:00:00", None),
        ("2025-06-01", None),
        ("0.5", None),
    ],
)
def test_dates(cell: str, nanoseconds: int | None) -> None:
    origin = cell_parsers.origin_of("2025-06-01T00:00:00")
    assert origin == 1_748_736_000_000_000_000
    read = cell_parsers.nanoseconds([cell], origin)
    assert np.isnan(read[0]) if nanoseconds is None else read.tolist() == [nanoseconds]
    assert (cell_parsers.origin_of(cell) is None) == (nanoseconds is None)


def test_the_zone_must_not_change() -> None:
    same, other = ["2025-06-01T00:00:00+02:00"] * 2, ["2025-06-01T00:00:00+02:00", "2025-06-01T00:00:00+01:00"]
    assert not np.isnan(cell_parsers.nanoseconds(same, 0)).any()
    assert np.isnan(cell_parsers.nanoseconds(other, 0)).all()
