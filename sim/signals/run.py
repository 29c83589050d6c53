"""A run holds what a core shows at its ports, as arrays: engines and golden models both make one.

A run is what the ports say: a table for every strobe, with a column for every port that is held by it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.arrays import Ints
from tachometry.spec.control import AnySpec
from tachometry.spec.language.port import INDEX, TICK, UPDATE, WHOLE


@dataclass(frozen=True, eq=False)
class Table:
    """Has one row for every clock in which a strobe is high.

    A column is found by its name, `table["velocity"]`, or as an attribute, `table.velocity`.
    """

    clock: Ints  # shape (n,): clocks in which the strobe is high
    # shape (n,): values of ports in these clocks: bool for ports of one bit, else int64
    columns: Mapping[str, NDArray[Any]]

    def __len__(self) -> int:
        return len(self.clock)

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.clock if name == "clock" else self.columns[name]

    def __getattr__(self, name: str) -> NDArray[Any]:
        if name.startswith("_") or name not in self.columns:
            raise AttributeError(f"the table has no column {name!r}, but {', '.join(self.columns)}")
        return self.columns[name]

    def get(self, name: str) -> NDArray[Any]:
        """Return a column, or zeros where the core has no such port."""
        return self.columns.get(name, np.zeros(len(self), dtype=np.bool_))

    def at(self, name: str, clock: Ints) -> Ints:
        """Return a column as it is in each of these clocks: that of the latest row, 0 before the first."""
        values = np.append(0, self.get(name).astype(np.int64))
        return values[np.searchsorted(self.clock, clock, side="right")]

    def rows(self, chosen: Any) -> Table:
        """Return the rows of an index array, a mask or a slice."""
        return Table(self.clock[chosen], {name: column[chosen] for name, column in self.columns.items()})

    def then(self, more: Table) -> Table:
        """Return the rows of both."""
        columns = {name: np.concatenate([column, more[name]]) for name, column in self.columns.items()}
        return Table(np.concatenate([self.clock, more.clock]), columns)

    def having(self, **columns: NDArray[Any]) -> Table:
        """Return the same table with these columns added or replaced; `clock` replaces the clocks."""
        clock = columns.pop("clock", self.clock)
        return Table(clock, {**self.columns, **columns})


@dataclass(frozen=True, eq=False)
class Run:
    """Holds all that happened at the ports in clocks 0 … n_clocks − 1."""

    n_clocks: int
    tables: dict[str, Table]  # by the strobe, for each that the core has

    @classmethod
    def of_ports(cls, spec: AnySpec, n_clocks: int, tables: Mapping[str, Table]) -> Run:
        """Return the run with just what the ports of `spec` say, in their order; KeyError if a column is missing."""
        found = {
            strobe: Table(tables[strobe].clock, {name: tables[strobe][name] for name in names})
            for strobe, names in spec.ports.strobes.items()
        }
        return cls(n_clocks, found)

    @property
    def ticks(self) -> Table:
        """Rows of `tick`."""
        return self.tables[TICK]

    @property
    def updates(self) -> Table:
        """Rows of `velocity_valid`, with what `update_valid` brings after each; the end of a run may cut that off."""
        updates = self.tables[UPDATE]
        if (rest := self.tables.get(WHOLE)) is None:
            return updates
        row = np.searchsorted(rest.clock, updates.clock)
        return updates.having(**{name: np.append(column, 0)[row] for name, column in rest.columns.items()})

    @property
    def index(self) -> Table:
        """Rows of `index_valid`; none without an index."""
        return self.tables.get(INDEX, _NONE)

    @property
    def errors(self) -> Ints:
        """Clocks in which `decode_error` was high."""
        return self.tables["decode_error"].clock

    @property
    def tick_errors(self) -> Ints:
        """Clocks in which `tick_error` was high; none without an external tick."""
        return self.tables.get("tick_error", _NONE).clock


_NONE = Table(np.empty(0, dtype=np.int64), {"index_position": np.empty(0, dtype=np.int64)})


def observed(spec: AnySpec, n_clocks: int, rows: Ints) -> Run:
    """Return the run that was seen at the output ports.

    - `rows`, shape (n, 1 + number of outputs): The clock, and all outputs in the order of the ports, in every clock in
      which a strobe is high.
    """
    columns = {
        port.name: rows[:, k].astype(np.bool_ if port.width == 1 and not port.signed else np.int64)
        for k, port in enumerate(spec.ports.outputs, 1)
    }
    every = Table(rows[:, 0], columns)
    return Run.of_ports(spec, n_clocks, {strobe: every.rows(columns[strobe]) for strobe in spec.ports.strobes})


@dataclass(frozen=True)
class Mismatch:
    """Is the first row in which two runs differ in one signal; `clock` is the earlier of the rows'."""

    signal: str
    row: int
    expected: int | None
    actual: int | None
    clock: int

    def __str__(self) -> str:
        return f"{self.signal}[{self.row}]: expected {self.expected}, got {self.actual}"


def compare(expected: Run, actual: Run) -> tuple[int, list[Mismatch]]:
    """Return how many rows of two runs differ, summed over all signals, and the first in each signal that differs.

    A row that only one run has is one. It raises ValueError if they are not runs of the same ports.
    """
    shapes = [{strobe: list(table.columns) for strobe, table in run.tables.items()} for run in (expected, actual)]
    if shapes[0] != shapes[1]:
        raise ValueError(f"runs must be of the same ports, not {shapes[0]} and {shapes[1]}")
    count, first = 0, []
    for strobe, left in expected.tables.items():
        right = actual.tables[strobe]
        pairs = {f"{strobe}.{name}": (left[name], right[name]) for name in left.columns}
        for signal, (old, new) in ({f"{strobe}.clock": (left.clock, right.clock)} | pairs).items():
            common = min(len(old), len(new))
            differ = np.flatnonzero(old[:common] != new[:common])
            surplus = max(len(old), len(new)) - common
            if len(differ) or surplus:
                row = int(differ[0]) if len(differ) else common
                was, got = (int(side[row]) if row < len(side) else None for side in (old, new))
                clock = min(int(side.clock[row]) for side in (left, right) if row < len(side))
                first.append(Mismatch(signal, row, was, got, clock))
                count += len(differ) + surplus
    return count, first


class Comparison:
    """Compares two runs that come in pieces, as `compare` does; rows that one of them lacks wait for it."""

    def __init__(self) -> None:
        self.n_mismatches = 0
        self.first: list[Mismatch] = []
        self._waiting: tuple[dict[str, Table], dict[str, Table]] = {}, {}  # rows expected, and actual rows
        self._done = Counter[str]()  # rows

    def expect(self, run: Run) -> None:
        """Take the next rows of the run that is expected."""
        self._take(0, run)

    def add(self, run: Run) -> None:
        """Take the next actual rows, and compare those that both have."""
        self._take(1, run)
        self._compare({name: min(len(side[name]) for side in self._waiting) for name in run.tables})

    def end(self, n_clocks: int) -> None:
        """Compare the rows that wait, up to a clock."""
        for side in self._waiting:
            side.update({name: table.rows(table.clock < n_clocks) for name, table in side.items()})
        self._compare({name: max(len(side[name]) for side in self._waiting) for name in self._waiting[0]})

    def _take(self, side: int, run: Run) -> None:
        waiting = self._waiting[side]
        waiting |= {name: waiting[name].then(table) if name in waiting else table for name, table in run.tables.items()}

    def _compare(self, n_rows: Mapping[str, int]) -> None:
        parts = [Run(0, {name: side[name].rows(slice(n)) for name, n in n_rows.items()}) for side in self._waiting]
        count, first = compare(*parts)
        known = {mismatch.signal for mismatch in self.first}
        self.first += [
            replace(mismatch, row=mismatch.row + self._done[mismatch.signal.rpartition(".")[0]])
            for mismatch in first
            if mismatch.signal not in known
        ]
        self.n_mismatches += count
        self._done.update(n_rows)
        for side in self._waiting:
            side.update({name: side[name].rows(slice(n, None)) for name, n in n_rows.items()})
