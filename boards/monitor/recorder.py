"""Telemetry is recorded with a row for each frame."""

import csv
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

from tachometry.boards.monitor.columns import Column, Value
from tachometry.boards.monitor.session import Frame
from tachometry.spec.language.tools import imported

TIME = "time [s]"


class Recorder(AbstractContextManager["Recorder"]):
    """Writes a row for each frame into a .csv or .parquet: its time, and the columns; a context manager.

    Rows are lines of CSV as they come, so that those on the disk can be read whatever happens; at the end they become
    Parquet where that is wanted. It raises OSError if the file cannot be written, or pyarrow is not installed and must
    be.
    """

    def __init__(self, path: Path, suffix: str, columns: Sequence[Column]) -> None:
        self._columns, self._path = columns, path
        self._parquet = suffix == ".parquet"
        self._rows = path.with_name(f"{path.stem}.rows.csv") if self._parquet else path
        if self._parquet:
            _pyarrow()
        self._file = self._rows.open("w", encoding="utf-8", newline="")
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._writer.writerow([TIME, *(column.head for column in columns)])
        self.rows, self.whole = 0, True

    def __exit__(self, *_: object) -> None:
        with self._writes():
            self._file.close()
            if self._parquet and self.whole:
                self._convert()

    @contextmanager
    def _writes(self) -> Iterator[None]:
        """Note that a write fails, of which the system does not say to which file."""
        try:
            yield
        except OSError as error:
            self.whole = False
            error.filename = error.filename or str(self._path)
            raise

    def write(self, frame: Frame) -> None:
        """Write a row: numbers are the shortest that read back as the same, flags 0 or 1, what is absent is empty."""
        values: list[Value] = [frame.time, *(column.value(frame.snapshot) for column in self._columns)]
        with self._writes():
            self._writer.writerow([int(value) if isinstance(value, bool) else value for value in values])
        self.rows += 1

    def waits(self, why: str) -> None:
        """Write nothing: a silence is no row."""

    def saved(self) -> tuple[Path, int]:
        """Cut what has reached a full disk to whole rows, and return the CSV and how many there are."""
        end = lines = 0
        with self._rows.open("rb+") as file:
            for line in file:
                if line.endswith(b"\n"):
                    end, lines = end + len(line), lines + 1
            file.truncate(end)
        return self._rows, max(lines - 1, 0)

    def _convert(self) -> None:
        pyarrow = _pyarrow()
        from pyarrow.csv import ConvertOptions, open_csv
        from pyarrow.parquet import ParquetWriter

        kinds = {float: pyarrow.float64(), int: pyarrow.int64(), bool: pyarrow.bool_()}
        fields = {TIME: pyarrow.float64()} | {column.head: kinds[column.kind] for column in self._columns}
        schema = pyarrow.schema(fields)
        options = ConvertOptions(column_types=schema, null_values=[""])
        with self._path.open("wb") as file, ParquetWriter(file, schema) as table:
            if self.rows:
                for batch in open_csv(self._rows, convert_options=options):
                    table.write_batch(batch)
        self._rows.unlink()


def _pyarrow() -> Any:
    return imported("pyarrow", "recordings in Parquet need pyarrow: pip install 'tachometry[host]'")
