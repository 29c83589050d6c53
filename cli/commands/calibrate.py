"""`tachometry calibrate`: the map of a disc, from captures of a shaft that coasts down."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path

import click
import numpy as np

from tachometry.boards.host.client import Client
from tachometry.boards.host.edges import read_edges
from tachometry.boards.host.link import Link
from tachometry.boards.host.registers import HostRegisters
from tachometry.boards.monitor.serial_port import SerialPort
from tachometry.cli.files import Outputs
from tachometry.cli.options.capture import CAPTURE_OPTIONS
from tachometry.cli.options.core import CAPTURED_OPTIONS
from tachometry.cli.options.option import FilePath, command, option, output
from tachometry.cli.reports.calibrate import print_calibration
from tachometry.cli.reports.terminal import progress_bar
from tachometry.sim.signals.recording import Recording
from tachometry.sim.studies.calibrating.calibrate import calibrate as calibration_of
from tachometry.spec import TachometerSpec
from tachometry.spec.core.disc import Disc
from tachometry.spec.language.files import MOST_JSON, read_text
from tachometry.spec.registers.edges import BAUD

_TIMES = 15  # recordings of a board

_ONE_SPEED = "Accept captures at one speed. Ripple of the torque in step with the turn is then part of the map."
_AGAINST = "Check that it is the encoder of this map. Without --index, edges are then counted as there."
_PORT = """Record from a board at the serial port CAPTURE. Its bitstream is from `tachometry build --bus edges`; it \
records 15 times while the shaft coasts."""
_ALIGN = """Align the core without an index at this serial port. It needs --against, and a capture that begins with \
the reset of the core, whose --manifest `tachometry build` wrote."""


@command("""\b
Examples:
  tachometry calibrate coast.sr --ppr 500 --index -o disc.json --plot disc.png
  tachometry calibrate coast1.csv coast2.csv --ppr 500
  tachometry calibrate later.sr --ppr 500 --index --against disc.json
  tachometry calibrate /dev/ttyUSB1 --port --ppr 500 --index -o disc.json""")
@click.argument("capture", type=FilePath(), nargs=-1, required=True, metavar="CAPTURE…")
@CAPTURED_OPTIONS
@CAPTURE_OPTIONS
@option("Map", "--one-speed", is_flag=True, help=_ONE_SPEED)
@option("Map", "--against", type=FilePath(), metavar="FILE", help=_AGAINST)
@option("Map", "--port", is_flag=True, help=_PORT)
@option("Map", "--align", type=FilePath(), metavar="PORT", help=_ALIGN)
@option("Map", "--manifest", type=FilePath(), metavar="FILE", help="Manifest of the board of --align.")
@output("-o", "--output", "table", suffixes=(".json",), help="Write the map of the disc.")
@output("--plot", suffixes=(".png", ".pdf", ".svg"), help="Draw the disc as it is, and with the map.")
def calibrate(
    spec: TachometerSpec,
    capture: tuple[Path, ...],
    read: Callable[[Path, TachometerSpec], Recording],
    one_speed: bool,
    against: Path | None,
    port: bool,
    **targets: Path | None,
) -> int:
    """Measure the disc of an encoder from captures of its lines.

    Turn the shaft fast, let it coast, and record A, B and, if there is one, the index, until it has half the speed. A
    CAPTURE is a file as `tachometry replay` takes it, but no log of counts or angles. Several captures, in both
    directions, make the map better.

    The map has the place of every edge: lines that are uneven, a disc off centre, errors of phase and duty. Ripple of
    the torque, which depends on the speed, is shown, and is not in the map. A map that is not certain is refused with
    the reasons, exit status 2, and no file is written. Equal captures give equal files.
    """
    known = None if against is None else _read_disc(against)
    inputs = [*capture, *([against] if against else [])]
    outputs = Outputs({"-o": targets["table"], "--plot": targets["plot"]}, inputs)
    one = (lambda path: _of_board(str(path), spec)) if port else (lambda path: [(str(path), read(path, spec))])
    recordings = chain.from_iterable(map(one, capture))
    with outputs:
        found = calibration_of(recordings, spec, one_speed=one_speed, against=known, bar=progress_bar)
        if found.reasons:
            print_calibration(found, spec)
            raise ValueError(f"the map is refused: {'; '.join(found.reasons)}")
        if path := outputs.get("-o"):
            path.write_text(found.disc.text, encoding="utf-8")
        if path := outputs.get("--plot"):
            from tachometry.sim.plots.disc import save_disc  # Matplotlib is slow to import

            save_disc(path, found)
    print_calibration(found, spec)
    if targets["align"]:
        _align(targets["align"], targets["manifest"], found.turn)
    return 0


def _align(port: Path, manifest: Path | None, turn: int | None) -> None:
    if turn is None or manifest is None:
        raise ValueError("--align must be given with --manifest and --against, and without --index")
    try:
        described = json.loads(read_text(manifest, MOST_JSON))
        with SerialPort(str(port), described["baud"]) as line:
            link = Link(line, HostRegisters(described))
            Client(link.read, link.write, described).turn_disc(turn)
    except (json.JSONDecodeError, UnicodeDecodeError, KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"--manifest must be of a core on a UART with a map and no index, not {manifest}") from error


def _of_board(name: str, spec: TachometerSpec) -> Iterator[tuple[str, Recording]]:
    """Yield recordings of a board, by names."""
    with SerialPort(name, BAUD) as port:
        for number in range(_TIMES):
            click.echo(f"recording {number + 1} of {_TIMES}: let the shaft coast", err=True)
            clock_hz, edges = read_edges(port)
            gap, levels = np.array(edges).T
            time, (a, b, z) = np.cumsum(gap) / clock_hz, ((levels >> line & 1).astype(np.uint8) for line in range(3))
            yield f"recording {number + 1}", Recording(time, a, b, float(time[-1]), z if spec.index else None)


def _read_disc(path: Path) -> Disc:
    try:
        return Disc.read(path)
    except ValueError as error:
        raise ValueError(f"--against {error}") from error
