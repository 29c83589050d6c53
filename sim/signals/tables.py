"""A run becomes tables here: updates, ticks, and the held velocity with its error."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.arrays import Ints
from tachometry.sim.signals.axes import of_axis
from tachometry.sim.signals.files import rows_of, write_csv
from tachometry.sim.signals.run import Run, Table
from tachometry.spec import CoreSpec, TachometerSpec
from tachometry.spec.language.port import TICK, UPDATE, WHOLE

TrueSpeed = Callable[[NDArray[np.float64]], NDArray[np.float64]]  # rad/s at times in seconds


@dataclass(frozen=True)
class HeldVelocity:
    """Holds the velocity that the core shows, tick by tick, from the first update on.

    - `time`, shape (n,), seconds: Of each tick the clock in which an update that it causes is valid. A core that ends
      its ticks itself is read after each nominal tick.
    """

    time: NDArray[np.float64]
    velocity_rad_s: NDArray[np.float64]


@dataclass(frozen=True)
class VelocityError:
    """Holds statistics of held velocity less true speed, in rad/s, over all ticks from the first update on.

    - `rms`, `mean`, `max`, rad/s: `max` is the largest magnitude.
    """

    rms: float
    mean: float
    max: float


class Tally:
    """Numbers of a run that may come in pieces: rows, what is not 0, and the held velocity with its error."""

    def __init__(self, spec: TachometerSpec) -> None:
        self._spec = spec
        self.rows = Counter[str]()  # of each strobe
        self.not_zero = Counter[tuple[str, str]]()  # rows of a strobe in which a column is not 0
        self.begin = self.n_values = self.n_ticks_before = 0  # clock of the last piece; ticks before those of `window`
        self.window: Run | None = None  # the last piece, and some rows before it
        self.n_counts, self.places = 0, list[Ints]()  # sum of what ticks counted; positions at the index
        self.n_held = 0
        self.least, self.most, self.total = math.inf, -math.inf, 0.0  # rad/s, of the held velocity
        self._squares = self._errors = self._worst = 0.0

    def hold(self, run: Run, true_speed: TrueSpeed | None = None) -> None:
        """Take the velocity that is held in the next rows."""
        if (old := self.window) is not None:
            self.begin = old.n_clocks
            first = self.begin - self._spec.latency.tick_to_velocity
            first = max(int(np.searchsorted(old.ticks.clock, first)) - 1, 0)
            self.n_ticks_before += first
            before = {TICK: old.ticks.rows(slice(first, None)), UPDATE: old.tables[UPDATE].rows(slice(-1, None))}
            run = Run(run.n_clocks, run.tables | {name: rows.then(run.tables[name]) for name, rows in before.items()})
        self.window, held = run, held_velocity(self._spec, run)
        new = held.time >= self.begin / self._spec.timing.clock_hz
        time, velocity = held.time[new], held.velocity_rad_s[new]
        self.n_held += len(velocity)
        self.least = float(np.min(velocity, initial=self.least))
        self.most = float(np.max(velocity, initial=self.most))
        self.total += float(np.sum(velocity))
        if true_speed is not None:
            error = velocity - true_speed(time)
            self._squares += float(np.sum(error * error))
            self._errors += float(np.sum(error))
            self._worst = float(np.max(np.abs(error), initial=self._worst))

    def count(self, run: Run) -> None:
        """Count rows, and what is not 0 in them; take counts, and positions at the index."""
        self.n_counts += int(run.ticks.get("pulse_count").sum())
        self.places.append(run.index.get("index_position"))
        for strobe, table in run.tables.items():
            self.rows[strobe] += len(table)
            self.n_values += len(table) * (1 + len(table.columns))
            self.not_zero.update({(strobe, name): int(np.count_nonzero(table[name])) for name in table.columns})

    @property
    def error(self) -> VelocityError | None:
        """Statistics of the held velocity against the true speed; None without an update."""
        n = self.n_held
        return VelocityError(math.sqrt(self._squares / n), self._errors / n, self._worst) if n else None


def held_velocity(spec: TachometerSpec, run: Run) -> HeldVelocity:
    """Return velocity at the end of every tick; empty if there was no update."""
    cycles, late = spec.timing.tick_cycles, spec.latency.tick_to_velocity
    ticks = run.ticks.clock
    if spec.facts.own_ticks:
        ticks = np.arange(cycles - 1, run.n_clocks, cycles) + spec.latency.tick
    clock = ticks + late
    return held_from(clock[clock < run.n_clocks], run.updates, spec)


def held_from(clock: NDArray[np.int64], updates: Table, spec: TachometerSpec) -> HeldVelocity:
    """Return the velocity that is held in these clocks, from the first update on."""
    latest = np.searchsorted(updates.clock, clock, side="right") - 1
    clock, latest = clock[latest >= 0], latest[latest >= 0]
    velocity = updates.velocity[latest].astype(np.float64) * spec.velocity.rad_per_s_per_lsb
    return HeldVelocity(clock.astype(np.float64) / spec.timing.clock_hz, velocity)


def velocity_error(held: HeldVelocity, true_speed: TrueSpeed) -> VelocityError | None:
    """Return statistics of a held velocity against the true speed (rad/s) at times (s); None if it is empty."""
    if not len(held.time):
        return None
    error = held.velocity_rad_s - true_speed(held.time)
    return VelocityError(
        rms=float(np.sqrt(np.mean(error * error))), mean=float(np.mean(error)), max=float(np.max(np.abs(error)))
    )


def write_trace(path: Path, spec: CoreSpec, run: Run, tally: Tally | None = None) -> None:
    """Write a CSV with a row per update: when it came, which tick closed its window, and what all its ports say.

    The velocity stands there as the raw number and in the unit of the core (in rad/s, if that is counts per tick); all
    else is raw, by the names of the ports. With many axes, the axis comes first. With a `tally`, which has the pieces
    up to this run, the rows go behind those of the pieces before, as in the other functions here.
    """
    if tally is not None and tally.window is not None:
        run = Run(run.n_clocks, run.tables | {TICK: tally.window.ticks})
    columns = _columns(spec, run)
    if tally is not None:
        columns["tick"] += tally.n_ticks_before
    write_csv(path, tuple(columns), rows_of(list(columns.values())), more=tally is not None and tally.begin > 0)


def _columns(spec: CoreSpec, run: Run) -> dict[str, NDArray[Any]]:
    if spec.axes is None:
        return _of_updates(spec, run, spec.latency.tick_to_velocity)
    each = [_of_updates(spec.tachometer, of_axis(spec, run, axis), 0) for axis in range(spec.axes)]
    axis = np.repeat(np.arange(spec.axes), [len(found["clock"]) for found in each])
    together = {name: np.concatenate([found[name] for found in each]) for name in each[0]}
    order = np.argsort(together["clock"], kind="stable")
    return {name: column[order] for name, column in {"axis": axis, **together}.items()}


def _of_updates(spec: TachometerSpec, run: Run, tick_to_velocity: int) -> dict[str, NDArray[Any]]:
    updates, unit = run.updates, spec.scale.own_unit
    tick = np.searchsorted(run.ticks.clock, updates.clock - tick_to_velocity, side="right") - 1
    columns = {
        "clock": updates.clock,
        "tick": tick,
        "interval": updates.interval.astype(np.int64),  # numbers, also of one bit
        "forced": updates.forced.astype(np.int64),
        "velocity_raw": updates.velocity,
        f"velocity_{unit.suffix}": unit.of(updates.velocity * spec.velocity.rad_per_s_per_lsb),
    }
    return columns | {
        name: updates[name].astype(np.int64) for name in updates.columns if name not in (*columns, "velocity")
    }


def write_counts(path: Path, run: Run, tally: Tally | None = None) -> None:
    """Write a CSV with a row per tick: its number, then what all ports say that are held by the tick.

    With many axes, every axis has a row with the same number.
    """
    number = np.arange(len(run.ticks))
    axis = run.ticks.get("axis")
    for one in np.unique(axis):
        number[axis == one] = np.arange(np.count_nonzero(axis == one))
    number += 0 if tally is None else tally.rows[TICK] - len(run.ticks)
    columns = {"tick": number, **run.ticks.columns}
    rows = rows_of([column.astype(np.int64) for column in columns.values()])
    write_csv(path, tuple(columns), rows, more=tally is not None and tally.begin > 0)


def write_events(path: Path, run: Run, tally: Tally | None = None) -> None:
    """Write a CSV with a row for every strobe that is neither a tick nor an update: index, errors.

    A row has the clock, the name of the strobe, and what the ports say that are held by it; other cells are empty.
    """
    tables = {name: table for name, table in run.tables.items() if name not in (TICK, UPDATE, WHOLE)}
    columns = [name for table in tables.values() for name in table.columns]
    rows: list[tuple[Any, ...]] = []
    for event, table in tables.items():
        cells = [
            table[name].astype(np.int64).tolist() if name in table.columns else [None] * len(table) for name in columns
        ]
        rows += [(clock, event, *values) for clock, *values in zip(table.clock.tolist(), *cells, strict=True)]
    rows.sort(key=itemgetter(0))
    write_csv(path, ("clock", "event", *columns), rows, more=tally is not None and tally.begin > 0)
