"""The equations alone say what the methods promise at each speed."""

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tachometry.sim.signals.files import rows_of, write_csv
from tachometry.sim.signals.shown import Shown
from tachometry.sim.studies.extras import expected_rows
from tachometry.sim.theory.performance import PERFORMANCES, disc_counts, disc_error, unknown
from tachometry.sim.theory.tsuji import unit_velocity
from tachometry.spec import METHODS, ParameterError, TachometerSpec, Timing, TrackTachometer
from tachometry.spec.formats.tracking_units import BLOCK
from tachometry.spec.language.option import read_options
from tachometry.spec.language.units import SpeedUnit

_ROWS = 12  # of a table
_UNITS = 10  # of the default range
# Cells of an ECP5 that the core of a method takes with the options of the reference core; `make size` writes them.
CELLS: dict[str, int] = json.loads(files(__package__).joinpath("cells.json").read_text(encoding="utf-8"))
_USUAL = {name for method in METHODS.values() for name in method.facts.usual}  # options whose default is a method's
_BETTER, _SMALLER, _ALIKE = 10, 2, 1.5  # ratios: of errors that are much less, of much fewer cells, of errors as good
_STEADY, _MULTIPLES, _DISTANCES = 1000, 200, 8  # samples: speeds, multiples of ω_u, distances from each of them


@dataclass(frozen=True, repr=False)
class Plan(Shown):
    """Measurements to be expected at constant speeds of an ideal encoder, once the first two windows are over."""

    speed: NDArray[np.float64]  # shape (n,), rad/s
    counts_per_tick: NDArray[np.float64]  # shape (n,): ω/ω_u
    interval: NDArray[np.float64]  # shape (n,), ticks: mean m_s; the maximum where updates are forced
    measurement_time: NDArray[np.float64]  # shape (n,), seconds: T_m
    # shape (n,), rad/s: Q_V. No error is greater, but for the rounding, once the method has settled (the S method: once
    # two successive ticks have counted alike). NaN, as the times, where the method cannot measure, or nothing is known
    # of it.
    resolution: NDArray[np.float64]
    forced: NDArray[np.bool_]  # shape (n,): the maximum time ends the measurement
    # shape (n,), rad/s: what a real disc adds to the error, see `sim.theory.performance.disc_error`
    disc: NDArray[np.float64]
    unit: str = "rad/s"  # in which it is printed

    def shown(self) -> tuple[str, list[list[str]]]:
        """Return the resolution over the speed."""
        unit = SpeedUnit(self.unit)
        heads = [f"speed ({unit.name})", "measurement time (s)", f"resolution ({unit.name})"]
        columns = zip(unit.of(self.speed), self.measurement_time, unit.of(self.resolution), strict=True)
        return "plan at constant speeds", [heads, *([f"{value:.4g}" for value in row] for row in columns)]

    @property
    def relative(self) -> NDArray[np.float64]:
        """Q_V/V."""
        return self.resolution / self.speed

    @property
    def product(self) -> NDArray[np.float64]:
        """Q_V·T_m in rad: what is paid in time for resolution (Tsuji 2009, Sec. V-C)."""
        return self.resolution * self.measurement_time


def plan_at(spec: TachometerSpec, speed: ArrayLike | None = None) -> Plan:
    """Return what to expect of a core at speeds in rad/s, by default at both ends of its range, from the equations of
    its method, see `sim.theory.performance`.

    A method that has none there has NaN for times and resolution.
    """
    speed = np.atleast_1d(np.asarray(default_range(spec) if speed is None else speed, dtype=np.float64))
    tick_seconds = float(spec.timing.tick_seconds)
    found = PERFORMANCES.get(spec.method, unknown)(spec, speed)
    return Plan(
        speed=speed,
        counts_per_tick=speed / unit_velocity(float(spec.encoder.counts_per_rev), tick_seconds),
        interval=found.time / tick_seconds,
        measurement_time=found.time,
        resolution=found.resolution,
        forced=found.forced,
        disc=disc_error(spec, speed, found),
    )


def default_range(spec: TachometerSpec) -> tuple[float, float]:
    """Return least and greatest speed, in rad/s, that a plan is of interest for.

    From one count in the maximum time to `max_speed`; without it, as everything recurs in each multiple of ω_u, to ten
    of them, and of positions that are read to the greatest. Never beyond one count per clock, nor what filter and
    blanking let through, over a decade at least.
    """
    unit = spec.scale.unit_velocity
    usual = _UNITS * unit if spec.encoder.sampled is None else math.inf
    high = usual if spec.max_speed is None else spec.max_speed.rad_per_s
    high = min(high, spec.velocity.greatest_speed)
    if spec.filter_clocks and spec.encoder.sensor == "quadrature":  # a level lasts half a period of its line
        high = min(high, unit * spec.timing.tick_cycles * spec.encoder.decoding / 2 / spec.filter_clocks)
    if spec.blanking_clocks:
        high = min(high, unit * spec.timing.tick_cycles * float(spec.front_end.blanked_counts))
    return min(unit / spec.timing.max_ticks, high / 10), high


def dense_speeds(spec: TachometerSpec, low: float, high: float) -> NDArray[np.float64]:
    """Return speeds from `low` to `high`, rad/s, that show all a line can: both ends, and where it goes at multiples of
    ω_u.

    Evenly spaced logarithms, and around every multiple of ω_u, or as many as a figure can tell apart, evenly spaced
    logarithms of the distance to it, down to where updates are forced.
    """
    unit = spec.scale.unit_velocity
    steady = np.geomspace(low, high, _STEADY)
    multiples = np.unique(np.floor(np.geomspace(low, high, _MULTIPLES) / unit + 0.5))
    edge = 1 / spec.timing.max_ticks
    beside = np.concatenate([np.geomspace(edge * (1 + 1e-6), 0.5, _DISTANCES), [edge * (1 - 1e-6)]])
    distances = np.concatenate([-beside, [0], beside])
    near = np.concatenate([multiple + distances for multiple in multiples.tolist()]) * unit
    return np.unique(np.concatenate([steady, near[(near > low) & (near < high)]]))


@dataclass(frozen=True)
class Plans:
    """Holds plans of a core, and of methods beside each other, over a range of speeds."""

    spec: TachometerSpec
    methods: Mapping[str, TachometerSpec]
    # low and high: rad/s
    low: float
    high: float

    @staticmethod
    def of(spec: TachometerSpec, greatest: float = math.inf) -> "Plans":
        """Return those of a core alone, over the range that is of interest, up to a greatest speed in rad/s."""
        low, high = default_range(spec)
        return Plans(spec, {}, low, min(high, greatest))

    @cached_property
    def table(self) -> Plan:
        """The plan of the core at a few speeds."""
        return plan_at(self.spec, np.geomspace(self.low, self.high, _ROWS))

    @property
    def tables(self) -> dict[str, Plan]:
        """Those of the methods at the same speeds."""
        return {name: plan_at(spec, self.table.speed) for name, spec in self.methods.items()}

    @property
    def range(self) -> tuple[float, float]:
        """The least and the greatest speed, in rad/s, that the core measures with a real disc.

        Below the least a count may take longer than the maximum time.
        """
        measured = self.line.speed[~np.isnan(self.line.resolution)]
        slowest = self.spec.scale.unit_velocity / self.spec.timing.max_ticks
        ends = plan_at(self.spec, slowest / 2).forced[0]
        low = max(self.low, slowest * (1 + disc_counts(self.spec))) if ends else self.low
        return low, float(measured[-1]) if len(measured) else self.high

    @property
    def of_extras(self) -> list[tuple[str, str]]:
        """Names and texts of the errors that extras have at the greatest speed, for which `{speed}` stands."""
        return expected_rows(self.spec, self.range[1])

    @cached_property
    def worst(self) -> Plan | None:
        """The plan at the speed whose error with a real disc may be greatest; None where the method tells nothing."""
        return self._worst(self.spec)

    def _worst(self, spec: TachometerSpec) -> Plan | None:
        speed = self.line.speed
        plan = self.line if spec is self.spec else plan_at(spec, speed)
        error = (plan.resolution + plan.disc)[(speed >= self.range[0]) & (speed <= self.range[1])]
        known = len(error) and not np.isnan(error).any()
        return plan_at(spec, speed[speed >= self.range[0]][np.argmax(error)]) if known else None

    @property
    def advice(self) -> "Advice | None":
        """Another method that would be much better, or much smaller and as good; None: no other is.

        It has all that methods have alike as this core, and measures all of its range.
        """
        here, own = cells_of(self.spec), _error(self.spec, self.worst)
        if here is None or own is None:
            return None
        better, smaller = [], []
        for spec in others(self.spec):
            error, cells = _error(spec, self._worst(spec)), cells_of(spec)
            if error is None or cells is None:
                continue
            one = Advice(spec.method, own / error, cells - here)
            better += [one] if one.gain >= _BETTER else []
            smaller += [one] if one.gain >= 1 / _ALIKE and cells * _SMALLER <= here else []
        best = max(better, key=lambda one: one.gain, default=None)
        return best or min(smaller, key=lambda one: one.cells, default=None)

    @cached_property
    def line(self) -> Plan:
        """The plan of the core at all speeds that a line can show."""
        return plan_at(self.spec, dense_speeds(self.spec, self.low, self.high))

    @cached_property
    def lines(self) -> dict[str, Plan]:
        """Those of the methods at the same speeds."""
        return {name: plan_at(spec, self.line.speed) for name, spec in self.methods.items()}

    def write(self, path: Path) -> None:
        """Write a CSV with a row per speed that a line can show; with methods, for each of them."""
        unit = self.spec.scale.shown_unit
        if not self.methods:
            columns = _columns(self.line, unit)
            write_csv(path, tuple(columns), rows_of(list(columns.values())))
            return
        each = {name: _columns(plan, unit) | {"product_rad": plan.product} for name, plan in self.lines.items()}
        rows = ((name, *row) for name, columns in each.items() for row in rows_of(list(columns.values())))
        write_csv(path, ("method", *next(iter(each.values()))), rows)


@dataclass(frozen=True)
class Advice:
    """Says what another method would be."""

    method: str
    gain: float  # how many times less its greatest error is, with a real disc
    cells: int  # how many more cells its reference core takes


def others(spec: TachometerSpec) -> Iterator[TachometerSpec]:
    """Yield the cores of other methods that can be, with all that methods have alike as in this one.

    A default of its method becomes that of the other one.
    """
    common = {one.name: getattr(spec, one.name) for one in fields(TachometerSpec) if one.name != "chosen"}
    given = {name: text for name, text in spec.options.items() if name not in _USUAL}

    def timing(method: type[TachometerSpec]) -> Timing:
        return Timing(**read_options(Timing, given, usual=method.facts.usual))

    for other in METHODS.values():
        if other is not type(spec):
            with suppress(ParameterError):
                own = timing(type(spec)) == spec.timing
                yield other(**common | ({"timing": timing(other)} if own else {}))


def _error(spec: TachometerSpec, worst: Plan | None) -> float | None:
    """Return the greatest error with a real disc, rounding included, in rad/s."""
    rounding = spec.velocity.rounding_lsb * spec.velocity.rad_per_s_per_lsb
    return None if worst is None else float(worst.resolution[0] + worst.disc[0]) + rounding


def cells_of(spec: TachometerSpec) -> int | None:
    """Return cells of an ECP5 that its method takes with the options of the reference core; None: not measured."""
    block = isinstance(spec, TrackTachometer) and spec.program.times is BLOCK
    return CELLS.get(f"{spec.method}{'-block' * block}")


def _columns(plan: Plan, unit: SpeedUnit) -> dict[str, NDArray[Any]]:
    return {
        f"speed_{unit.suffix}": unit.of(plan.speed),
        "counts_per_tick": plan.counts_per_tick,
        "interval_ticks": plan.interval,
        "measurement_time_s": plan.measurement_time,
        f"resolution_{unit.suffix}": unit.of(plan.resolution),
        f"disc_{unit.suffix}": unit.of(plan.disc),
        "relative_resolution": plan.relative,
        "forced": plan.forced.astype(np.int64),
    }
