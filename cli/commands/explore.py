"""`tachometry explore`: a core is configured in a page of the browser."""

import importlib.util
import os
from collections.abc import Mapping
from typing import Any

import click

from tachometry.cli.options.option import GroupedCommand, option


@click.command(
    cls=GroupedCommand,
    epilog="""\b
Examples:
  tachometry explore
  tachometry explore --port 8080""",
)
@option(
    "Page",
    "--port",
    type=click.IntRange(0, 65535),
    metavar="N",
    help="Port of 127.0.0.1 at which the page is. [default: one that is free]",
)
def explore(port: int | None) -> int:
    """Configure a core in a page of the browser, with its symbol, its files, and the command that writes them.

    The address is printed; it has a token, without which nothing is served, to whoever else uses this machine. The page
    needs no network. Ctrl-C ends it.
    """
    if missing := [name for name in ("starlette", "uvicorn") if importlib.util.find_spec(name) is None]:
        raise OSError(f"explore needs {' and '.join(missing)}: pip install 'tachometry[explore]'")
    from tachometry.cli.explore.server import serve

    def answer(name: str, args: Mapping[str, Any]) -> Mapping[str, Any]:
        from tachometry.cli.explore.answers import answer  # takes a second to import, in which the page is opened

        return answer(name, args)

    try:
        serve(
            port or 0, answer, lambda address: click.echo(f"{address}\nOpen this address in a browser; Ctrl-C ends it.")
        )
    except OSError as error:
        raise OSError(f"--port {port} cannot be had: {os.strerror(error.errno or 0)}") from error
    return 0
