"""What a core shows at its ports, as arrays: the common language of engines and golden models."""

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.spec import TachometerSpec


@dataclass(frozen=True)
class Ticks:
    """One row per strobe of `tick`.

    Parameters
    ----------
    clock : int64 array, shape (n,)
        Clock in which `tick` is high.
    pulse_count, position : int64 arrays, shape (n,), counts
    overflow : bool array, shape (n,)
    swallowed_edges : int64 array, shape (n,)
        All zero without a filter.
    age : int64 array, shape (n,), ticks
        Of the velocity; all zero without an age.
    """

    clock: NDArray[np.int64]
    pulse_count: NDArray[np.int64]
    position: NDArray[np.int64]
    overflow: NDArray[np.bool_]
    swallowed_edges: NDArray[np.int64]
    age: NDArray[np.int64]


@dataclass(frozen=True)
class Updates:
    """One row per strobe of `velocity_valid`.

    Parameters
    ----------
    clock : int64 array, shape (n,)
        Clock in which `velocity_valid` is high.
    velocity : int64 array, shape (n,)
        Raw value, in 2^−frac_bits of the spec's unit.
    interval : int64 array, shape (n,)
        m_s.
    forced, stalled : bool arrays, shape (n,)
    velocity_overflow : bool array, shape (n,)
        The velocity was saturated; never where it is as wide as it can need.
    more : dict of str to array, shape (n,)
        Bounds, and outputs of the method.
    """

    clock: NDArray[np.int64]
    velocity: NDArray[np.int64]
    interval: NDArray[np.int64]
    forced: NDArray[np.bool_]
    stalled: NDArray[np.bool_]
    velocity_overflow: NDArray[np.bool_]
    more: dict[str, NDArray[Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Index:
    """One row per strobe of `index_valid`; none without an index.

    Parameters
    ----------
    clock : int64 array, shape (n,)
        Clock in which `index_valid` is high.
    index_position : int64 array, shape (n,), counts
    """

    clock: NDArray[np.int64]
    index_position: NDArray[np.int64]


@dataclass(frozen=True)
class Run:
    """All that happened at the ports in clocks 0 … n_clocks − 1.

    Parameters
    ----------
    n_clocks : int
    ticks : Ticks
    updates : Updates
    index : Index
    errors : int64 array
        Clocks in which `decode_error` was high.
    tick_errors : int64 array
        Clocks in which `tick_error` was high; none without an external tick.
    """

    n_clocks: int
    ticks: Ticks
    updates: Updates
    index: Index
    errors: NDArray[np.int64]
    tick_errors: NDArray[np.int64]


STROBES = ("tick", "velocity_valid", "index_valid", "decode_error", "tick_error")


def observed(spec: TachometerSpec, n_clocks: int, rows: NDArray[np.int64]) -> Run:
    """The run that was seen at the output ports.

    Parameters
    ----------
    spec : TachometerSpec
    n_clocks : int
    rows : int64 array, shape (n, 1 + number of outputs)
        The clock, and all outputs in the order of the ports, in every clock with one of the `STROBES`.
    """
    outputs = [port for port in spec.ports if port.direction == "output"]
    columns = {port.name: rows[:, k].astype(bool if port.width == 1 else np.int64) for k, port in enumerate(outputs, 1)}
    columns["clock"] = rows[:, 0]
    absent = np.zeros(len(rows), dtype=bool)

    def at(strobe: str, names: Iterable[str]) -> list[NDArray[Any]]:
        high = columns.get(strobe, absent)
        return [columns.get(name, absent)[high] for name in names]

    def group(strobe: str, kind: type[Any]) -> Any:
        return kind(*at(strobe, (item.name for item in fields(kind) if item.name != "more")))

    more = spec.held_ports
    return Run(
        n_clocks,
        group("tick", Ticks),
        replace(group("velocity_valid", Updates), more=dict(zip(more, at("velocity_valid", more), strict=True))),
        group("index_valid", Index),
        *at("decode_error", ["clock"]),
        *at("tick_error", ["clock"]),
    )


@dataclass(frozen=True)
class Mismatch:
    """The first row in which two runs differ in one signal; `clock` is the earlier of the rows'."""

    signal: str
    row: int
    expected: int | None
    actual: int | None
    clock: int

    def __str__(self) -> str:
        return f"{self.signal}[{self.row}]: expected {self.expected}, got {self.actual}"


def compare(expected: Run, actual: Run) -> tuple[int, list[Mismatch]]:
    """Hold two runs against each other, every row and every bit.

    Returns
    -------
    count : int
        Rows that differ, summed over all signals; a row that only one run has is one.
    first : list of Mismatch
        The first of them in each signal that differs.
    """
    count, first = 0, []
    both = (expected, actual)
    pairs = []
    for name in ("errors", "tick_errors"):
        clocks = [getattr(run, name) for run in both]
        pairs.append((name, clocks, clocks))
    for group in ("ticks", "updates", "index"):
        rows = [{**vars(side), **vars(side).get("more", {})} for side in (getattr(run, group) for run in both)]
        clocks = [side["clock"] for side in rows]
        pairs += [(f"{group}.{name}", clocks, [side[name] for side in rows]) for name in rows[0] if name != "more"]
    for signal, clocks, (left, right) in pairs:
        common = min(len(left), len(right))
        differ = np.flatnonzero(left[:common] != right[:common])
        surplus = max(len(left), len(right)) - common
        if len(differ) or surplus:
            row = int(differ[0]) if len(differ) else common
            old, new = (int(side[row]) if row < len(side) else None for side in (left, right))
            first.append(Mismatch(signal, row, old, new, min(int(side[row]) for side in clocks if row < len(side))))
            count += len(differ) + surplus
    return count, first
