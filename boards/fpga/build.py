"""A component becomes a bitstream, or an archive for the vendor's tools."""

import importlib.util
import io
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tachometry.boards.fpga.board import Board
from tachometry.boards.fpga.flow import REPORT, ROUTE_LOG, SYNTHESIS, Flow
from tachometry.boards.fpga.timing import TimingError, check_hold, slowest_clock
from tachometry.boards.fpga.tools import EXTRA, ToolError, find, run, versions
from tachometry.hdl.export.verilog import bundled_yosys
from tachometry.sim.signals.temporary import scratch

if TYPE_CHECKING:
    from amaranth.lib import wiring

TOP = "top"
SEEDS = range(1, 9)
_PLATFORMS = ("amaranth", "amaranth-boards")


@dataclass(frozen=True)
class Built:
    """Holds the outcome of a build."""

    content: bytes  # the bitstream, or the archive
    suffix: str  # of its file
    tools: Mapping[str, str]  # versions of the packages that have made it
    cells: Mapping[str, tuple[int, int]]  # cells that are used, and that there are, by what people call them
    fmax: float | None  # greatest frequency of the clock in MHz; None of an archive
    seed: int | None  # of place and route


def check_tools(board: Board) -> None:
    """Check that all is installed that a board needs; ToolError if something is missing."""
    if importlib.util.find_spec("amaranth_boards") is None:
        raise ToolError(f"amaranth-boards is needed for boards and not installed: {EXTRA}")
    for tool in board.flow.tools if board.flow is not None else ():
        find(tool)


def prepared(core: "wiring.Component", board: Board) -> Any:
    """Return Amaranth's build plan of a component on a board: equal components give equal files with equal tools."""
    from tachometry.boards.fpga.top import BoardTop

    options = "" if board.flow is None else board.flow.synthesis
    with bundled_yosys():
        return board.platform().prepare(BoardTop(core, board), TOP, emit_src=False, synth_opts=options)


def build(core: "wiring.Component", board: Board, say: Callable[[str], None]) -> Built:
    """Build a component for a board; `say` is told what is being done.

    It raises ToolError if a tool is missing or fails, and TimingError if no seed of place and route meets the timing.
    """
    check_tools(board)
    say("elaborating")
    plan = prepared(core, board)
    if board.flow is None:
        archive = io.BytesIO()
        plan.archive(archive)
        return Built(archive.getvalue(), ".zip", versions(_PLATFORMS), {}, None, None)
    with scratch() as folder:
        for file, content in plan.files.items():
            (folder / file).write_bytes(content.encode() if isinstance(content, str) else content)
        return _open(board.flow, board.clock_hz, folder, say)


def _open(flow: Flow, clock_hz: int, folder: Path, say: Callable[[str], None]) -> Built:
    """Return the bitstream of what the platform has written to a folder."""
    say("synthesising")
    run(SYNTHESIS, folder)
    if flow.netlist is not None:
        file = folder / flow.route[flow.route.index("--json") + 1]
        flow.netlist(netlist := json.loads(file.read_text(encoding="utf-8")))
        file.write_text(json.dumps(netlist), encoding="utf-8")
    fmax, seed = _routed(flow, clock_hz, folder, say)
    say("packing")
    run(flow.pack, folder)
    used = json.loads((folder / REPORT).read_text(encoding="utf-8"))["utilization"]
    cells = {name: (used[cell]["used"], used[cell]["available"]) for name, cell in flow.cells.items()}
    content = (folder / f"{TOP}{flow.suffix}").read_bytes()
    return Built(content, flow.suffix, versions((*_PLATFORMS, *flow.packages)), cells, fmax, seed)


def _routed(flow: Flow, clock_hz: int, folder: Path, say: Callable[[str], None]) -> tuple[float, int]:
    """Place and route with one seed after the other until the timing is met: Fmax and seed."""
    failures: list[TimingError] = []
    for seed in SEEDS:
        say("placing and routing" + (f", seed {seed}" if failures else ""))
        run(flow.routing(clock_hz, seed), folder)
        try:
            fmax = slowest_clock(json.loads((folder / REPORT).read_text(encoding="utf-8")), clock_hz)
            check_hold((folder / ROUTE_LOG).read_text(encoding="utf-8", errors="replace"))
        except TimingError as error:
            failures.append(error)
        else:
            return fmax, seed
    raise TimingError(f"{failures[0]} (nor with seeds {SEEDS[1]} to {SEEDS[-1]})") from failures[0]
