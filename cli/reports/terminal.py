"""Tables go to stdout, and progress to stderr."""

import sys
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from threading import Event

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from tachometry.cli.reports.standard_streams import printable

_PATIENCE = 2.0  # seconds of work without a bar
LINE_SECONDS = 10.0  # of work between two lines in a pipe
_PLAIN_WIDTH = 1 << 16  # columns where there is no terminal: no line is broken
_GAP = 2  # columns between two of a table


@contextmanager
def progress_bar(verb: str, total: float, unit: str = "", *, rate: bool = False) -> Iterator[Callable[[float], None]]:
    """Yield a function to be called with how much of `total` is done, in some unit; a total of 0 is not known.

    It shows a bar on stderr as soon as the work is seen to take more than two seconds, if stderr is a terminal; else
    there is a line every ten seconds.
    """
    if not sys.stderr.isatty():
        share = [0.0]
        with _lines(lambda: f"{verb}, {share[0]:.0%}" if total else f"{verb}, {share[0]:.0f} {unit}"):
            yield lambda done: share.__setitem__(0, done / (total or 1))
        return
    columns = [MofNCompleteColumn(), TextColumn(unit)] if unit else []
    begun = time.monotonic()
    with ExitStack() as stack:
        bar = Progress(
            TextColumn(verb),
            BarColumn(),
            *columns,
            *([_PerSecond(unit)] if rate else []),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        task = bar.add_task(verb, total=total or None)

        def update(done: float) -> None:
            if not bar.live.is_started and (time.monotonic() - begun) * (total or done) > _PATIENCE * done:
                stack.enter_context(bar)
            bar.update(task, completed=done)

        yield update


@contextmanager
def activity() -> Iterator[Callable[[str], None]]:
    """Yield a function to be told what is being done; after two seconds it is shown on stderr, if that is a terminal,
    else in a line every ten seconds.
    """
    if not sys.stderr.isatty():
        told = [""]
        with _lines(lambda: told[0]):
            yield lambda what: told.__setitem__(0, what)
        return
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with ExitStack() as stack:
        shown = Progress(*columns, console=Console(stderr=True), transient=True)
        task = shown.add_task("")
        timer = threading.Timer(_PATIENCE, shown.start)
        stack.callback(shown.stop)
        stack.callback(timer.join)
        stack.callback(timer.cancel)
        timer.start()
        yield lambda what: shown.update(task, description=what)


@contextmanager
def working(what: str) -> Iterator[None]:
    """Show as `activity` does that one thing is being done, while the context lasts."""
    with activity() as say:
        say(what)
        yield


@contextmanager
def _lines(state: Callable[[], str]) -> Iterator[None]:
    """Print on stderr, every ten seconds, how far work is, and how long it has taken."""
    over = Event()

    def tell() -> None:
        seconds = 0.0
        while not over.wait(LINE_SECONDS):
            seconds += LINE_SECONDS
            with suppress(OSError, ValueError):  # nobody reads it
                print(f"{printable(state())}: {seconds:.0f} s", file=sys.stderr, flush=True)

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        over.set()
        teller.join()


class _PerSecond(ProgressColumn):
    """Shows how fast it goes."""

    def __init__(self, what: str) -> None:
        super().__init__()
        self._what = what

    def render(self, task: Task) -> Text:
        return Text("" if task.speed is None else f"{task.speed:.3g} {self._what}/s")


class _Console(Console):
    """A console whose texts, which may come from files, cannot command the terminal."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else printable(text), style, control)

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def stdout_console() -> Console:
    """Return where to print: as wide as the terminal, or without breaking a line if there is none."""
    return _Console(width=None if sys.stdout.isatty() else _PLAIN_WIDTH, highlight=False)


def print_rows(rows: list[tuple[str, str]]) -> None:
    """Print a table of names and values on stdout."""
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in rows:
        table.add_row(Text(name), Text(value))
    stdout_console().print(table)


def print_table(heads: Sequence[str], rows: Iterable[Sequence[str]], left: Collection[int] = (0,)) -> None:
    """Print a table on stdout: numbers to the right, and the columns that are `left`, which are words, to the left.

    No cell is broken or cut. If the terminal is too narrow, heads have several lines; if it still is, the table is
    printed in parts, each with the first column.
    """
    console, body = stdout_console(), [*rows]

    def widths(names: Sequence[str]) -> list[int]:
        lines = ([*name.split("\n"), *(row[column] for row in body)] for column, name in enumerate(names))
        return [max(map(cell_len, texts)) for texts in lines]

    if sum(widths(heads)) + _GAP * (len(heads) - 1) > console.width:
        heads = [head.replace(" ", "\n") for head in heads]
    for number, part in enumerate(_parts(widths(heads), console.width)):
        console.width = max(console.width, sum(widths(heads)[column] + _GAP for column in part))
        table = Table(box=None, pad_edge=False, header_style="")
        for column in part:
            table.add_column(heads[column], justify="left" if column in left else "right", no_wrap=True)
        for row in body:
            table.add_row(*(Text(row[column]) for column in part))
        if number:
            console.print()
        console.print(table)


def _parts(widths: Sequence[int], room: int) -> list[list[int]]:
    """Return columns that fit beside each other, the first in every part."""
    parts, used = [[0]], widths[0]
    for column, width in enumerate(widths[1:], 1):
        if used + _GAP + width > room and len(parts[-1]) > 1:
            parts.append([0])
            used = widths[0]
        parts[-1].append(column)
        used += _GAP + width
    return parts
