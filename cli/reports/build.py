"""`build` prints what a design takes of its board."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tachometry.boards.fpga.board import Board
from tachometry.cli.reports.core import choice
from tachometry.cli.reports.terminal import print_rows
from tachometry.spec import TachometerSpec

if TYPE_CHECKING:  # Amaranth is slow to import, and --help does not need it
    from tachometry.boards.fpga.build import Built


def print_build(spec: TachometerSpec, board: Board, built: Built, seconds: float) -> None:
    """Print the method if none was named, cells, memories, and the greatest frequency."""
    rows = [*choice(spec), ("board", board.title)]
    rows += [(kind, f"{used:,} of {there:,}") for kind, (used, there) in built.cells.items() if there]
    if built.fmax is not None:
        rows.append(("Fmax", f"{built.fmax:.1f} MHz, the clock has {board.clock_hz / 1e6:g} MHz"))
    else:
        rows.append(("project", "unpack it and run build_top.sh or build_top.bat, with the vendor's tools on the PATH"))
    rows.append(("time", f"{seconds:.1f} s"))
    print_rows(rows)
