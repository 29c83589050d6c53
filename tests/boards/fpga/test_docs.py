"""docs/guides/boards.md says which port is on which pin."""

import re

import pytest
from support import docs

from tachometry.boards.fpga.boards import BOARDS

PAGE = docs.page("guides/boards.md")


@pytest.mark.parametrize("name", BOARDS)
def test_pins_are_those_of_the_board(name: str) -> None:
    board = BOARDS[name]
    assert f"| `{name}` | {board.title} | {board.clock_hz // 10**6} MHz | " in PAGE
    (section,) = re.findall(rf"^## {board.title.split(',')[0]}$(.*?)^## ", PAGE, re.MULTILINE | re.DOTALL)
    assert dict(re.findall(r"^\| `(\w+)` \| (.+) \|$", section, re.MULTILINE)) == board.pins
