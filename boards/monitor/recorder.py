"""Telemetry is recorded with a row for each frame."""

import csv
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

from tachometry.boards.monitor.columns import Column, Value
from tachometry.boards.monitor.session import Frame

SUFFIXES = (".csv", ".parquet")
TIME = "time [s]"
_ROWS = 4096  # that Parquet has in a group


class _Table(Protocol):
    def write(self, row: list[Value]) -> None: ...

    def close(self) -> None: ...


class Recorder:
    """Writes a row for each frame: its time, and the columns; a context manager.

    Parameters
    ----------
    path : Path
        Where it is written.
    suffix : str
        One of `SUFFIXES`.
    columns : sequence of Column

    Raises
    ------
    OSError
        If the file cannot be written, or pyarrow is not installed and must be.
    """

    def __init__(self, path: Path, suffix: str, columns: Sequence[Column]) -> None:
        self._columns, self._path = columns, path
        self._table: _Table = (_Csv if suffix == ".csv" else _Parquet)(path, columns)
        self.rows = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        with self._named():
            self._table.close()

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Yield a write that fails does not say of which file."""
        try:
            yield
        except OSError as error:
            error.filename = error.filename or str(self._path)
            raise

    def write(self, frame: Frame) -> None:
        """Write a row."""
        with self._named():
            self._table.write([frame.time, *(column.value(frame.snapshot) for column in self._columns)])
        self.rows += 1


class _Csv:
    """Numbers are the shortest that read back as the same, flags 0 or 1, and what is not there is empty."""

    def __init__(self, path: Path, columns: Sequence[Column]) -> None:
        self._path = path
        self._file = path.open("w", encoding="utf-8", newline="")
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._writer.writerow([TIME, *(column.head for column in columns)])

    def write(self, row: list[Value]) -> None:
        self._writer.writerow([int(value) if isinstance(value, bool) else value for value in row])

    def close(self) -> None:
        try:
            self._file.close()
        except OSError:  # the disk is full: all whole rows stay
            os.truncate(self._path, self._path.read_bytes().rfind(b"\n") + 1)
            raise


class _Parquet:
    def __init__(self, path: Path, columns: Sequence[Column]) -> None:
        pyarrow = _pyarrow()
        from pyarrow.parquet import ParquetWriter

        kinds = {float: pyarrow.float64(), int: pyarrow.int64(), bool: pyarrow.bool_()}
        fields = [(TIME, pyarrow.float64()), *((column.head, kinds[column.kind]) for column in columns)]
        self._schema = pyarrow.schema(fields)
        self._writer: Any = ParquetWriter(path, self._schema)
        self._rows: list[list[Value]] = []

    def write(self, row: list[Value]) -> None:
        self._rows.append(row)
        if len(self._rows) == _ROWS:
            self._flush()

    def close(self) -> None:
        try:
            self._flush()
        finally:
            self._writer.close()

    def _flush(self) -> None:
        if self._rows:
            arrays = [list(column) for column in zip(*self._rows, strict=True)]
            self._writer.write_table(_pyarrow().table(arrays, schema=self._schema))
            self._rows.clear()


def _pyarrow() -> Any:
    try:
        import pyarrow
    except ImportError as error:
        raise OSError("recordings in Parquet need pyarrow: pip install 'tachometry[host]'") from error
    return pyarrow
