"""`monitor` shows a board in a live view, or by plain lines."""

import sys
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Any, Self

import click
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from tachometry.boards.monitor.columns import DEGREES
from tachometry.boards.monitor.selftest import Result
from tachometry.boards.monitor.watch import HISTORY, Display, State
from tachometry.cli.reports.standard_streams import printable
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.language.port import MISSED, WIDE
from tachometry.spec.language.tools import imported
from tachometry.spec.language.units import plural

_LINE = 1.0  # seconds of board from a plain line to the next
_REFRESH = 0.1  # seconds from a picture to the next
_SIDE = 46  # columns beside the plot
_LEAST = 24  # columns of a plot
_ERRORS = {"decode_errors": "illegal transitions", "overflows": "overflows", "tick_errors": "tick errors"}
_SATURATED = 255
_DIAL = "→↗↑↖←↙↓↘"


class PlainLines(AbstractContextManager["PlainLines"]):
    """A line on stdout for every second of the board, and on stderr what has changed."""

    def __init__(self) -> None:
        self._shown: float | None = None

    def __exit__(self, *_: object) -> None:
        pass

    def notice(self, text: str) -> None:
        click.echo(f"tachometry: {printable(text)}", err=True)

    def show(self, state: State) -> None:
        if state.frame and (self._shown is None or state.frame.time >= self._shown + _LINE):
            self._print(state)

    def end(self, state: State) -> None:
        if state.frame and state.frame.time != self._shown:
            self._print(state)

    def _print(self, state: State) -> None:
        assert state.frame is not None
        self._shown = state.frame.time
        click.echo(line(state))


class LiveView:
    """A view of the whole terminal, drawn anew ten times a second; OSError if plotext is not installed."""

    def __init__(self) -> None:
        plotext()  # missing: it is said before anything is opened
        self._console = Console(highlight=False)
        self._live = Live(console=self._console, screen=True, auto_refresh=False)
        self._drawn = -_REFRESH
        self._texts: list[str] = []

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()
        for text in self._texts:
            click.echo(f"tachometry: {printable(text)}", err=True)

    def notice(self, text: str) -> None:
        """Show that something has changed: below the view, when it has ended."""
        self._texts.append(text)

    def show(self, state: State) -> None:
        if time.monotonic() - self._drawn >= _REFRESH:
            self._drawn = time.monotonic()
            self._live.update(view(state, *self._console.size), refresh=True)

    def end(self, state: State) -> None:
        """Show the state for the last time, where the shell goes on."""
        self._live.stop()
        if state.frame:
            click.echo(line(state))


def display(plain: bool) -> Display:
    """Return the live view if stdout is a terminal, and plain lines otherwise."""
    return PlainLines() if plain or not sys.stdout.isatty() else LiveView()


def line(state: State) -> str:
    """Return the state in a line."""
    assert state.frame is not None
    parts = [f"{state.frame.time:.3f} s", *(f"{name} {text}" for name, text in measured_rows(state))]
    parts += [f"{name} {text}" for name, text in [*wrong_rows(state), *received_rows(state)]]
    return ", ".join(parts)


def view(state: State, width: int, height: int) -> RenderableType:
    """Return a picture of the state, so many columns wide and lines high."""
    head = Text(printable(state.title), style="bold", no_wrap=True, overflow="ellipsis")
    foot = Text(no_wrap=True, overflow="ellipsis")
    if state.waits_for:
        foot.append(f"waiting: {printable(state.waits_for)}", style="bold yellow")
    else:
        foot.append("Ctrl-C ends it", style="dim")
    if state.recorded:
        foot.append(f", recording {printable(state.recorded)}", style="dim")
    side = Table.grid(padding=(0, 2))
    side.add_column(no_wrap=True)
    side.add_column(no_wrap=True)
    measured = measured_rows(state)
    for number, (name, text) in enumerate([*measured, *wrong_rows(state), *received_rows(state)]):
        wrong = len(measured) <= number < len(measured) + len(_ERRORS) and text not in ("0", "-")
        side.add_row(Text(name, style="dim"), Text(text, style="bold red" if wrong else "bold" if not number else ""))
    rows = max(height - 3, 8)
    if width >= _SIDE + _LEAST:
        body = Table.grid()
        body.add_column(width=_SIDE)
        body.add_column()
        body.add_row(side, plot(state, width - _SIDE, rows))
        return Group(head, body, foot)
    return Group(head, side, foot)


def plot(state: State, width: int, height: int) -> Text:
    """Return speed, and its bounds, over the last seconds."""
    figure = plotext()
    figure.clear_figure()
    figure.theme("clear")
    figure.plotsize(width, height)
    times = [now for now, *_ in state.history]
    for column, colour in ((2, "gray"), (3, "gray"), (1, "cyan")):
        points = [(now, row[column]) for now, row in zip(times, state.history, strict=True) if row[column] is not None]
        if points:
            figure.plot(*zip(*points, strict=True), marker="braille", color=colour)
    speeds = [float(value) for _, *values in state.history for value in values if value is not None] or [0.0]
    room = max(0.05 * (max(speeds) - min(speeds)), 0.02 * max(map(abs, speeds)), 1e-6)
    figure.ylim(min(speeds) - room, max(speeds) + room)
    last = times[-1] if times else 0.0
    figure.xlim(max(last - HISTORY, 0.0), max(last, HISTORY))
    figure.title(f"{state.spec.scale.shown_unit.name} over s")
    return Text.from_ansi(figure.build())


def plotext() -> Any:
    """Return the module that draws in text; OSError if it is not installed."""
    return imported("plotext", "the live view needs plotext: pip install 'tachometry[host]', or take --plain")


def measured_rows(state: State) -> list[tuple[str, str]]:
    """Return names and values of what the board measures."""

    def shown(name: str, style: Callable[[Any], str] = str, absent: str = "-") -> str:
        value = state.value(name)
        return absent if value is None else style(value)

    unit = state.spec.scale.shown_unit.name
    rows = [("speed", f"{shown('velocity', '{:.6g}'.format)} {unit}")]
    if state.spec.bounds:
        lower, upper = (shown(name, "{:.6g}".format, "none") for name in BOUNDS)
        rows.append(("bounds", f"{lower} .. {upper} {unit}"))
    rows.append(("position", f"{shown('position')} counts"))
    angles = (name for name, column in state.columns.items() if column.unit == DEGREES)
    rows += [(name, shown(name, lambda at: f"{at:5.1f}° {_DIAL[round(at / 45) % 8]}")) for name in angles]
    if "age" in state.columns:
        rows.append(("age", f"{shown('age')} ticks"))
    return [*rows, ("standstill", shown("standstill", lambda rests: "yes" if rests else "no"))]


def wrong_rows(state: State) -> list[tuple[str, str]]:
    """Return names and numbers of what has been wrong with its encoder."""
    rows = []
    for name, text in (_ERRORS | {"decode_errors": "wrong reads"} if state.spec.encoder.sampled else _ERRORS).items():
        if name in state.counters or name != "tick_errors":
            number = state.counters.get(name)
            rows.append((text, "-" if number is None else f"{number}{' or more' * (number == _SATURATED)}"))
    if state.spec.front_end.index_state is not None:
        rows += [(name.replace("_", " "), str(state.told[name])) for name in (WIDE, MISSED)]
    for name, texts in (item for extra in state.spec.extras for item in extra.texts.items()):
        code = state.value(name)
        rows.append((name, "-" if code is None else f"{code}: {texts[int(code)]}" if code else "0"))
    if "filtered_edges" in state.columns:
        edges = state.value("filtered_edges")
        rows.append(("filtered edges", "-" if edges is None else str(edges)))
    return rows


def received_rows(state: State) -> list[tuple[str, str]]:
    """Return names and numbers of what has come of its telemetry."""
    counts = state.counts
    return [("frames", str(counts.frames)), ("lost", str(counts.lost)), ("bytes dropped", str(counts.bytes_dropped))]


class SelftestReport:
    """Prints a line for each of these steps of a self-test as it comes, and the verdict."""

    def __init__(self, names: Sequence[str]) -> None:
        self._width = max(map(len, names))

    def head(self) -> None:
        """Print the heads of the columns."""
        click.echo(f"{'step':<{self._width}}  frames   values")

    def line(self, result: Result) -> None:
        """Print what a step has shown."""
        verdict = "pass" if result.passed else f"FAIL: {result.difference or 'no telemetry'}"
        click.echo(f"{result.name:<{self._width}}  {result.frames:>6}  {result.values:>7}  {verdict}")

    def verdict(self, results: Sequence[Result]) -> bool:
        """Print how many steps have passed; whether all have."""
        passed = sum(result.passed for result in results)
        whole = passed == len(results)
        click.echo(f"{'PASS' if whole else 'FAIL'}: {passed} of {plural(len(results), 'step')} passed")
        return whole
