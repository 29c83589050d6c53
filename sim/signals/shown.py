"""Results print as a few lines, and as a table in a notebook."""

from collections.abc import Sequence
from html import escape

_MOST = 8  # rows


class Shown:
    """Base of a result that is printed in at most ten lines."""

    def shown(self) -> tuple[str, Sequence[Sequence[str]]]:
        """Return a title and rows of cells, the heads first."""
        raise NotImplementedError

    def __repr__(self) -> str:
        title, rows = self.shown()
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows[:_MOST]]
        return "\n".join([title, *lines, *[f"... {len(rows) - _MOST} more rows"][: len(rows) > _MOST]])

    def _repr_html_(self) -> str:
        title, rows = self.shown()
        cells = ["".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows]
        return f"<p>{escape(title)}</p><table>{''.join(f'<tr>{row}</tr>' for row in cells)}</table>"
