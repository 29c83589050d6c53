"""A table on the terminal."""

from collections.abc import Iterable, Sequence

from rich.table import Table
from rich.text import Text

from tachometry.cli.reports.run import stdout_console


def print_table(heads: Sequence[str], rows: Iterable[Sequence[str]], left: Sequence[int] = (0,)) -> None:
    """Print a table on stdout, numbers to the right; `left` are the columns of words."""
    table = Table(box=None, pad_edge=False, header_style="")
    for column, head in enumerate(heads):
        table.add_column(head, justify="left" if column in left else "right", no_wrap=True)
    for row in rows:
        table.add_row(*map(Text, row))
    stdout_console().print(table)
