"""`tachometry build`: a core on a board, as a bitstream or as a project for the vendor's tools."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tachometry.boards.fpga.board import Board
from tachometry.cli.files import Outputs
from tachometry.cli.options.board import board_argument, boards_help, default_folder
from tachometry.cli.options.core import BAUD, board_core_options
from tachometry.cli.options.loop import LOOP
from tachometry.cli.options.option import FilePath, command, option
from tachometry.cli.reports.build import print_build
from tachometry.spec import TachometerSpec
from tachometry.spec.control import LoopSpec
from tachometry.spec.registers.buses import BUSES, Bus, bus_of
from tachometry.spec.registers.demo import demo_map, demo_ports
from tachometry.spec.registers.manifest import check_module_name

if TYPE_CHECKING:  # Amaranth is slow to import, and --help does not need it
    from tachometry.boards.fpga.build import Built

_SERIAL = ("uart", "spi")  # buses that leave the FPGA over a few pins
_EDGES = "edges"


def _bus(name: str, baud: int | None, spec: TachometerSpec | LoopSpec) -> Bus:
    """Return the bus; it raises ParameterError if the clock cannot have its baud rate."""
    bus = bus_of(name, baud)
    assert bus is not None
    if bus.baud:
        bus.bit_cycles(spec.timing.clock_hz)
    return bus


_OUTPUT = "Folder of all files; files in it are overwritten. It is made if it does not exist. [default: build/BOARD]"


@command(f"""{boards_help()}

\b
Examples:
  tachometry build icebreaker --ppr 500
  tachometry build tang-nano-9k --ppr 2048 --filter 4 -o rig
  tachometry build ulx3s-85f --ppr 500 --max-speed 1000rad/s --loop \\
      --gains inputs -o drive
  tachometry program tang-nano-9k rig""")
@board_argument
@board_core_options(LOOP)
@option("Files", "--name NAME", default="tachometer", help="Name of the Verilog module and of the files.")
@option("Files", "--output DIR", "-o", "directory", type=FilePath(file_okay=False), help=_OUTPUT)
@option(
    "Files",
    "--bus",
    type=click.Choice((*_SERIAL, _EDGES), case_sensitive=False),
    default=_SERIAL[0],
    help="Registers on a serial bus. "
    + "; ".join(f"{name}: {BUSES[name].help}" for name in _SERIAL)
    + f". A UART is on the USB of the board, where the board has one. {_EDGES}: no core, but a bitstream that records "
    "edges for `tachometry calibrate`.",
)
@BAUD
def build(
    board: Board, spec: TachometerSpec | LoopSpec, name: str, directory: Path | None, bus: str, baud: int | None
) -> int:
    """Build a core for a board: with its registers on a UART or on SPI, and an emulated encoder beside it.

    With --loop --gains inputs the current of the control loop is on the pin `current_pdm`, as a stream of bits, unless
    the pin `enable` is low or LOOP.enable is not set.

    \b
    DIR/NAME.bin, .bit or .fs  bitstream, where open tools make one
    DIR/NAME.zip               else a project for Vivado or Quartus
    DIR/NAME.v                 the same design as Verilog
    DIR/NAME.json              manifest: registers, pins, tools, every option

    The tools are Python packages: pip install 'tachometry[boards]'. A design that is too slow for the clock of the
    board is refused. What was built is printed: cells, memories, and the greatest frequency.

    Pins and wiring of every board are in docs/guides/boards.md.
    """
    begun = time.monotonic()
    check_module_name(name)
    on = _bus(_SERIAL[0] if bus == _EDGES else bus, baud, spec)
    demo_ports(demo_map(spec), on)  # what cannot have registers is refused at once
    from tachometry.boards.fpga import build as builder

    builder.check_tools(board)
    suffixes = suffix, *_ = (".zip" if board.flow is None else board.flow.suffix, ".json", ".v")
    folder = default_folder(board) if directory is None else directory
    if bus == _EDGES:
        return _recorder(board, spec.tachometer, folder / f"{name}{suffix}", begun)
    with Outputs({kind: folder / f"{name}{kind}" for kind in suffixes}) as outputs:
        from tachometry.boards.fpga.top import component, described
        from tachometry.cli.reports.terminal import activity
        from tachometry.hdl.export.verilog import verilog_of

        core = component(spec, on)
        manifest = described(spec, on, board, name)
        with activity() as say:
            built = builder.build(core, board, say)
            say("writing Verilog")
            verilog = verilog_of(component(spec, on), manifest, demo_ports(demo_map(spec), on))
        manifest["board"] |= _made(board, name, built)
        outputs[suffix].write_bytes(built.content)
        for kind, text in ((".json", json.dumps(manifest, indent=2) + "\n"), (".v", verilog)):
            outputs[kind].write_text(text, encoding="utf-8", newline="\n")
    for kind in suffixes:
        click.echo(click.format_filename(folder / f"{name}{kind}"))
    click.echo()
    print_build(spec.tachometer, board, built, time.monotonic() - begun)
    return 0


def _recorder(board: Board, spec: TachometerSpec, path: Path, begun: float) -> int:
    """Build the recorder of edges."""
    from tachometry.boards.fpga.build import build as built_of
    from tachometry.boards.fpga.edge_recorder import recorder_of
    from tachometry.cli.reports.terminal import activity

    with Outputs({path.suffix: path}) as outputs, activity() as say:
        built = built_of(recorder_of(board), board, say)
        outputs[path.suffix].write_bytes(built.content)
    click.echo(click.format_filename(path) + "\n")
    print_build(spec, board, built, time.monotonic() - begun)
    return 0


def _made(board: Board, name: str, built: Built) -> dict[str, Any]:
    """Return what the manifest says of how the bitstream or the project was made."""
    return {
        "archive" if board.flow is None else "bitstream": f"{name}{built.suffix}",
        "tools": dict(built.tools),
        **({} if built.seed is None else {"seed": built.seed}),
    }
