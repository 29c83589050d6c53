"""The board that a command is for."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from tachometry.boards.fpga.board import Board
from tachometry.boards.fpga.boards import BOARDS


class _BoardChoice(click.Choice[str]):
    """Reads a board by its name."""

    name = "board"

    def __init__(self) -> None:
        super().__init__([*BOARDS], case_sensitive=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return BOARDS[super().convert(value, param, ctx)]


def board_argument(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a command: the name of a board, handed to the command as `board`."""
    return click.argument("board", type=_BoardChoice(), metavar="BOARD")(command)


def default_folder(board: Board) -> Path:
    """Return where files for a board are, if nothing else is said."""
    return Path("build") / board.name


def boards_help() -> str:
    """Return the boards in a paragraph of a help text."""
    return "\b\nBOARD is one of:\n" + "\n".join(f"  {board.name:<14}{board.title}" for board in BOARDS.values())
