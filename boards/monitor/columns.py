"""A recording and a view show a frame as columns by the names of the ports, each with its unit."""

from collections.abc import Callable
from dataclasses import dataclass

from tachometry.boards.host.snapshot import Snapshot
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.language.port import Port
from tachometry.spec.registers.demo import DemoMap

Value = float | int | bool | None
DEGREES = "degrees"


@dataclass(frozen=True)
class Column:
    """Is a column of a recording."""

    name: str  # of the port
    unit: str  # empty: it has none
    kind: type  # float, int or bool
    value: Callable[[Snapshot], Value]  # None: there is no such value in this frame

    @property
    def head(self) -> str:
        """Name with unit, such as `velocity [rad/s]`."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def columns(registers: DemoMap) -> list[Column]:
    """Return every captured port but the time; what is in LSB of the velocity is in the unit of shown speeds."""
    spec = registers.spec
    lsb = spec.velocity.rad_per_s_per_lsb
    (speeds,) = (port.unit for port in registers.ports if port.name == "velocity")

    def of(port: Port) -> Column:
        name = port.name
        if name in BOUNDS:
            return Column(name, spec.scale.shown_unit.name, float, bound(name))
        if port.unit == speeds:
            return Column(
                name, spec.scale.shown_unit.name, float, lambda now: float(spec.scale.shown_unit.of(now[name] * lsb))
            )
        if port.width == 1 and not port.unit:
            return Column(name, "", bool, lambda now: bool(now[name]))
        if (turns := port.unit.endswith(" electrical turns")) or port.unit.startswith("1/"):
            return Column(name, DEGREES * turns, float, lambda now: now.in_unit(name))
        return Column(name, port.unit, int, lambda now: now[name])

    def bound(name: str) -> Callable[[Snapshot], Value]:
        absent = BOUNDS[name] * spec.velocity.shown_absent

        def value(now: Snapshot) -> Value:
            there = now["bounds_valid"] and now[name] != absent
            return float(spec.scale.shown_unit.of(now[name] * lsb)) if there else None

        return value

    return [of(port) for port in registers.ports if port.name != "time"]
