"""Whatever `tachometry verify` prints of an engine is a row of the page."""

from support.script import load

SAID = """\
method  engine   configurations  motions
s       pysim                28       36
track   cxxrtl               15       34

PASS: pysim, cxxrtl and golden models agree in every bit of 4 updates and 5 ticks
"""


def test_rows_are_those_that_were_printed() -> None:
    assert load("verify").table(SAID) == [
        ["method", "engine", "configurations", "motions"],
        ["s", "pysim", "28", "36"],
        ["track", "cxxrtl", "15", "34"],
    ]
