"""Results of a sweep on disk: one Parquet file, whole at any time, and beside it the rows that are not in it yet."""

import json
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from typing import IO, Any, Self

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from filelock import FileLock, Timeout

from tachometry.sim.signals.files import replacing
from tachometry.sim.signals.temporary import held_back
from tachometry.sim.studies.sweeping.sweep import COLUMNS, Row, code_digest
from tachometry.spec.language.option import ParameterError

_KINDS = {"text": pa.string(), "int": pa.int64(), "float": pa.float64(), "bool": pa.bool_()}
_MADE_BY = "tachometry.code"
_PATIENCE = 10.0  # seconds from one Parquet file to the next, or
_SHARE = 20  # so many times what it takes to write it


class Results:
    """Rows of a sweep, by their points; those of earlier sweeps into the same file stay in it. A context manager.

    A row is a line of the journal beside the file as soon as it is there. Now and then, and at the end, the file is
    written anew, beside and renamed, and the journal with it is done. Whatever ends the process, no row is lost.

    - `path`: The file; None: nothing is kept.
    - `points`: Digests of the points of this sweep, in whose order rows are written, before those of other sweeps.
    - `values`: Columns beyond `COLUMNS`, numbers.
    """

    def __init__(self, path: Path | None, points: Sequence[str], values: Iterable[str] = ()) -> None:
        self._path, self._points = path, points
        self._schema = _schema(values)
        self._table = self._schema.empty_table()
        self._new: list[Row] = []
        self._saved = True
        self._n_kept = 0  # rows on disk
        self._due = time.monotonic() + _PATIENCE
        self._lock: FileLock | None = None
        self._journal: IO[str] | None = None

    def __enter__(self) -> Self:
        """Take the file, for this sweep alone, and read it, and what a sweep that was killed has left beside it.

        It raises ValueError if another sweep has it, or it is none of a sweep by the same code, and OSError if it
        cannot be read or written.
        """
        if self._path is None:
            return self
        self._path.parent.mkdir(parents=True, exist_ok=True)
        beside = self._path.with_name(f".{self._path.name}.lock")
        try:
            with held_back():
                with self._writing():
                    beside.touch()  # a lock would wait where it cannot be written
                lock = FileLock(beside, timeout=0)
                lock.acquire()
                self._lock = lock
            for torn in self._path.parent.glob(f".{escape(self._path.name)}.*.part"):  # by one that was killed
                torn.unlink()
            if self._path.exists():
                self._table = _joined([self._table, _read(self._path)])
                self._n_kept = len(self._table)
            if (journal := self._path.with_name(f".{self._path.name}.new")).exists():
                there = set(self._table["point"].to_pylist())
                left = [row for row in _read_journal(journal) if row["point"] not in there]
                more = dict.fromkeys(name for row in left for name in row if name not in COLUMNS)
                self._table = _joined([self._table, pa.Table.from_pylist(left, schema=_schema(more))])
                self._n_kept = len(self._table)
                self._write()
            self._begin_journal()
        except Timeout:
            raise ParameterError("results", f"must be of one sweep at a time: {self._path} is in use") from None
        except BaseException:
            self._release()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.save()
        finally:
            self._release()

    @property
    def missing(self) -> list[str]:
        """Points of this sweep without a row, in order."""
        there = set(self._table["point"].to_pylist()).union(row["point"] for row in self._new)
        return [point for point in self._points if point not in there]

    def add(self, row: Row) -> None:
        """Add the row of a point that was missing; OSError if it cannot be written."""
        self._new.append(row)
        self._saved = False
        if self._journal is not None:
            with self._writing():
                self._journal.write(f"{json.dumps(row)}\n")
                self._journal.flush()
            self._n_kept += 1
        if time.monotonic() >= self._due:
            self.save()

    def save(self) -> None:
        """Write the file, if there are rows that are not in it; OSError if it cannot be written."""
        if self._saved:
            return
        begun = time.monotonic()
        self._table = _joined([self._table, pa.Table.from_pylist(self._new, schema=self._schema)])
        self._new = []
        if self._path is not None:
            self._write()
            self._saved = True
            self._begin_journal()
        self._due = time.monotonic() + max(_PATIENCE, _SHARE * (time.monotonic() - begun))
        self._saved = True

    def _write(self) -> None:
        assert self._path is not None
        place = {point: k for k, point in enumerate(self._points)}
        order = [place.get(point, len(place)) for point in self._table["point"].to_pylist()]
        table = self._table.take(pc.array_sort_indices(pa.array(order, pa.int64())))
        with self._writing(), replacing(self._path) as beside, beside.open("wb") as file:
            pq.write_table(table, file)
        self._n_kept = len(table)

    def _begin_journal(self) -> None:
        """Begin an empty journal; the old one's rows are in the file."""
        assert self._path is not None
        self._close_journal()
        with self._writing(), held_back():
            self._journal = self._path.with_name(f".{self._path.name}.new").open("w", encoding="ascii")
            self._journal.write(f"{_made_by()}\n")
            self._journal.flush()

    def _close_journal(self) -> None:
        if self._journal is not None:
            with suppress(OSError):  # of a line that could not be written, which has been reported
                self._journal.close()

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Report that the results could not be written, and what was saved nevertheless."""
        try:
            yield
        except OSError as error:
            rows = "row is" if self._n_kept == 1 else "rows are"
            kept = f"; {self._n_kept} {rows} kept, and the same command goes on from there" if self._n_kept else ""
            raise OSError(f"cannot write {self._path}: {error.strerror or error}{kept}") from error

    def _release(self) -> None:
        with held_back():
            try:
                self._close_journal()
                if self._journal is not None and self._saved:
                    Path(self._journal.name).unlink(missing_ok=True)
            finally:
                if self._lock is not None:
                    Path(self._lock.lock_file).unlink(missing_ok=True)
                    self._lock.release()

    def columns(self, *names: str) -> dict[str, list[Any]]:
        """Return columns of this sweep's points that have a row, in order."""
        self.save()
        row = {point: k for k, point in enumerate(self._table["point"].to_pylist())}
        found = self._table.take([row[point] for point in self._points if point in row])
        return {name: found[name].to_pylist() for name in names}


def _schema(values: Iterable[str]) -> pa.Schema:
    columns = [(name, _KINDS[kind]) for name, (kind, _) in COLUMNS.items()]
    return pa.schema([*columns, *((name, pa.float64()) for name in values)], metadata={_MADE_BY: _made_by()})


def _made_by() -> str:
    """Return what rows here are made by: the code of all of them, and that of those with an engine."""
    return f"{code_digest()} {code_digest(hardware=True)}"


def _read(path: Path) -> pa.Table:
    try:
        table = pq.read_table(path)
    except pa.ArrowInvalid:
        raise ParameterError("results", f"must be a Parquet file of a sweep, which {path} is not") from None
    made_by = (table.schema.metadata or {}).get(_MADE_BY.encode())
    if made_by is None:
        raise ParameterError("results", f"must be a Parquet file of a sweep, which {path} is not")
    _check_code(path, made_by.decode(), table["engine"].to_pylist() if "engine" in table.column_names else [])
    return table


def _read_journal(path: Path) -> list[Row]:
    """Return rows of a journal after its first line, the code; any last line may not be whole."""
    whole = path.read_text(encoding="ascii").split("\n")[:-1]
    rows: list[Row] = [json.loads(line) for line in whole[1:]]
    if rows:
        _check_code(path, whole[0], [row["engine"] for row in rows])
    return rows


def _check_code(path: Path, made_by: str, engines: Sequence[str | None]) -> None:
    parts = 2 if any(engines) else 1
    if made_by.split()[:parts] != _made_by().split()[:parts]:
        rest = f"must be of this version of tachometry, and {path} is of another: remove it, or take another file"
        raise ParameterError("results", rest)


def _joined(tables: list[pa.Table]) -> pa.Table:
    return pa.concat_tables(tables, promote_options="default").combine_chunks()
