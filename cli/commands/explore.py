"""`tachometry explore`: a core is configured in a page of the browser."""

import importlib.util
from pathlib import Path

import click

from tachometry.cli.options.option import FilePath, command, option

_MANIFEST = """Manifest that `tachometry build` wrote for the board. The page can then show the board at a serial PORT \
live."""
_PORT = "Port of 127.0.0.1 at which the page is. [default: one that is free]"


@command("""\b
Examples:
  tachometry explore
  tachometry explore --port 8080
  tachometry explore /dev/ttyUSB1 --manifest build/icebreaker/tachometer.json""")
@click.argument("board", metavar="[PORT]", required=False)
@option("Page", "--manifest FILE", type=FilePath(dir_okay=False), help=_MANIFEST)
@option("Page", "--port N", type=click.IntRange(0, 65535), help=_PORT)
def explore(board: str | None, manifest: Path | None, port: int | None) -> int:
    """Configure a core in a page of the browser, and see what it does.

    The page has a form of all options, the symbol of the core, its files and the command that writes them. It shows all
    methods over speed and on a motion or a capture, and live what a board measures: the one at the serial PORT, or a
    simulated one.

    The address is printed; it has a token, without which nothing is served, to whoever else uses this machine. The page
    needs no network. Ctrl-C ends it.
    """
    if missing := [name for name in ("starlette", "uvicorn") if importlib.util.find_spec(name) is None]:
        raise OSError(f"explore needs {' and '.join(missing)}: pip install 'tachometry[explore]'")
    from tachometry.cli.explore.server import Answer, Boards, serve

    def load() -> tuple[Answer, Boards]:
        from tachometry.cli.explore.answers import FUNCTIONS, answer  # takes a second to import
        from tachometry.cli.explore.live import Live

        live = Live(board, manifest)
        return lambda name, args: answer(name, args, {**FUNCTIONS, **live.functions}), live

    if board is None and manifest is None:
        serve(port or 0, load, click.echo)
    else:
        loaded = load()  # what is wrong with them is said before there is an address
        serve(port or 0, lambda: loaded, click.echo)
    return 0
