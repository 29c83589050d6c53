"""Files appear whole or not at all."""

import csv
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

_ROWS = 1 << 16  # rows that are Python objects at once


def file_of(text: str) -> tuple[str, str | None]:
    """Return the file and the column of FILE or FILE:COLUMN."""
    file, _, column = text.partition(":")
    return (file, column) if column and Path(file).exists() else (text, None)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a path to write to, which takes the place of `path` at the end; nothing is left of it after an error."""
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield beside
        with beside.open("rb+") as file:  # else a rename may reach the disk before what is renamed
            os.fsync(file.fileno())
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Iterable[object]], *, more: bool = False) -> None:
    """Write a CSV, or `more` rows of one; numbers are the shortest that read back as the same, equal on every machine,
    None is empty.
    """
    with path.open("a" if more else "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if not more:
            writer.writerow(header)
        writer.writerows(rows)


def rows_of(columns: Sequence[NDArray[Any]]) -> Iterator[tuple[object, ...]]:
    """Yield rows of columns of equal length, as Python objects; memory is bounded, however long they are."""
    for first in range(0, len(columns[0]), _ROWS):
        yield from zip(*(column[first : first + _ROWS].tolist() for column in columns), strict=True)
