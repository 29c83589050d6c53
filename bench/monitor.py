"""Draws the live view of a simulated board, docs/guides/monitor.svg: speeds, a reversal and a standstill."""

from io import StringIO
from pathlib import Path

import click
from pages import stamp
from rich.console import Console
from rich.terminal_theme import MONOKAI

from tachometry.boards.monitor.columns import columns
from tachometry.boards.monitor.session import Session
from tachometry.boards.monitor.settings import emulator_settings
from tachometry.boards.monitor.watch import State
from tachometry.cli.reports.monitor import view
from tachometry.sim.engines.board import BoardSimulation
from tachometry.sim.signals.files import replacing
from tachometry.spec import of_texts
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.demo import DemoMap, demo_manifest

PICTURE = Path(__file__).resolve().parent.parent / "docs" / "guides" / "monitor.svg"
CORE = {"ppr": "500", "clock": "12MHz", "max-speed": "1000rad/s", "filter": "4", "age": "yes"}
STEP = 12_000  # clocks of a look at the line
# Settings, each with the seconds that it lasts.
MOTION = [("speed=300rad/s", 3.0), ("speed=-100rad/s", 3.0), ("speed=0", 2.0), ("speed=40rad/s", 2.0)]
SIZE = 110, 26


class Line:
    """The compiled board, without real time, so that the picture is the same on every machine."""

    def __init__(self, simulation: BoardSimulation) -> None:
        self._simulation, self._sent = simulation, b""

    def write(self, data: bytes, /) -> None:
        self._sent += data

    def read(self, size: int = 1, /) -> bytes:
        found, self._sent = self._simulation.run(STEP, self._sent)
        return found

    def close(self) -> None:
        pass


@click.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), default=PICTURE, help="File of the picture.")
def main(output: Path) -> None:
    """Write the picture."""
    registers, bus = DemoMap(of_texts("s", CORE)), bus_of("uart")
    assert bus is not None
    line, manifest = Line(BoardSimulation(registers, bus)), demo_manifest(registers, bus)
    state = State(
        "icebreaker, simulated: S method, eq. (21)", registers.spec, {one.name: one for one in columns(registers)}
    )
    first = emulator_settings(registers.spec, ["acceleration=300rad/s2", "speed=0"])
    session = Session("sim:icebreaker", lambda: line, manifest, 500, first)
    while state.frame is None:
        state.take(session.poll())
    until = state.frame.time
    for word, seconds in MOTION:
        session.set(emulator_settings(registers.spec, [word]))
        until += seconds
        while state.frame.time < until:
            state.take(session.poll())
    state.counters, state.counts = session.counters(), session.counts
    console = Console(
        record=True, width=SIZE[0], height=SIZE[1], file=StringIO(), force_terminal=True, color_system="truecolor"
    )
    console.print(view(state, *SIZE))
    with replacing(output) as beside:
        text = console.export_svg(title="tachometry monitor", theme=MONOKAI, unique_id="monitor")
        beside.write_text(text, encoding="utf-8", newline="\n")
    stamp(output)


if __name__ == "__main__":
    main()
