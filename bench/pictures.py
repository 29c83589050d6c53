"""Draws the pictures of the guides, or those that are named: `python bench/pictures.py [NAME …]`."""

import re
import shlex
import shutil
import subprocess
import sys
from io import StringIO
from pathlib import Path

from pages import ROOT, stamp, tachometry
from rich.console import Console
from rich.terminal_theme import MONOKAI

from tachometry.boards.monitor.columns import columns
from tachometry.boards.monitor.emulator_settings import emulator_settings
from tachometry.boards.monitor.session import Session
from tachometry.boards.monitor.watch import State
from tachometry.cli.reports.monitor import view
from tachometry.sim.engines.board import BoardSimulation
from tachometry.spec import of_texts
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.demo import DemoMap, demo_manifest

GUIDES = ROOT / "docs" / "guides"
FLAGS = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking".split()

# The live view of a simulated board: speeds, a reversal and a standstill.
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


def monitor(picture: Path) -> None:
    """Draw the live view at the end of the motion."""
    registers, bus = DemoMap(of_texts("s", CORE)), bus_of("uart")
    assert bus is not None
    line, manifest = Line(BoardSimulation(registers, bus)), demo_manifest(registers, bus)
    shown = {one.name: one for one in columns(registers)}
    state = State("icebreaker, simulated: S method, eq. (21)", registers.spec, shown)
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
    width, height = SIZE
    console = Console(
        record=True, width=width, height=height, file=StringIO(), force_terminal=True, color_system="truecolor"
    )
    console.print(view(state, *SIZE))
    text = console.export_svg(title="tachometry monitor", theme=MONOKAI, unique_id="monitor")
    picture.write_text(text, encoding="utf-8", newline="\n")


def explore(picture: Path) -> None:
    """Take what the page of `tachometry explore` first shows in Chromium, with its curves."""
    from playwright.sync_api import sync_playwright  # which made_of.py does not need

    command = [sys.executable, "-m", "tachometry", "explore"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process, sync_playwright() as playwright:
        assert process.stdout is not None
        chromium = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        page = chromium.new_page(viewport={"width": 1360, "height": 1180})
        page.goto(process.stdout.readline().strip())
        page.locator("#velocity canvas").wait_for()
        page.screenshot(path=picture)
        chromium.close()
        process.terminate()


def commands() -> dict[str, str]:
    """Return the commands of the guides that draw a picture in build/, by its name."""
    pages = "".join((GUIDES / page).read_text(encoding="utf-8") for page in ("captures.md", "foc.md"))
    found = re.findall(r"^tachometry (.* --plot build/((?:wheel|angle)\w*.png))$", pages, re.MULTILINE)
    return {"sweep.png": "sweep docs/guides/sweep.toml", **{name: words for words, name in found}}


def main() -> None:
    """Draw them beside their pages."""
    drawn = {"monitor.svg": monitor, "explore.png": explore}
    for name in sys.argv[1:] or (*commands(), *drawn):
        picture = GUIDES / name
        if name in drawn:
            drawn[name](picture)
        else:
            tachometry(*shlex.split(commands()[name]))
            picture.write_bytes((ROOT / "build" / name).read_bytes())
        stamp(picture)


if __name__ == "__main__":
    main()
