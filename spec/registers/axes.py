"""Registers of a core of many axes: a window for each axis, and one capture of them all."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Self

from tachometry.spec.language.field import Draft
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import Port
from tachometry.spec.methods.axes import AxesSpec
from tachometry.spec.registers.map import RegisterMap

_WHOSE = ("axis", "index_axis")  # what is held says it by its name


@dataclass(frozen=True)
class AxesMap(RegisterMap):
    """Holds all registers of a core of many axes: those of axis 0, of axis 1 …, in windows of one size.

    It raises ParameterError if the core does not hold the values of every axis.
    """

    axes: AxesSpec

    def __post_init__(self) -> None:
        if not self.axes.parallel:
            raise ParameterError(
                "parallel", "must be given together with --axes and --bus: registers show what is held for each axis"
            )

    @classmethod
    def of(cls, core: AxesSpec) -> Self:
        return cls(core.tachometer, core)

    @property
    def core(self) -> AxesSpec:
        return self.axes

    @cached_property
    def ports(self) -> tuple[Port, ...]:
        live = [port for port in super().ports if port.name not in _WHOSE]
        # The ports of the core are those of a value, for each axis.
        return tuple(port for axis in range(self.axes.axes) for port in live[axis :: self.axes.axes])

    @property
    def strobes(self) -> tuple[str, ...]:
        return tuple(self.axes.ports.strobes)

    @cached_property
    def counted(self) -> dict[str, str]:
        found = {"decode_errors": "Clocks in which both lines of an axis changed at once."}
        found["overflows"] = "Ticks of an axis whose pulse_count was saturated."
        if self.axes.tachometer.external_tick:
            found["tick_errors"] = "External ticks that were missing or came too early."
        return found

    def of_axis(self, axis: int) -> tuple[Port, ...]:
        """Return ports with the registers of one axis."""
        n = len(self.ports) // self.axes.axes
        return self.ports[axis * n : (axis + 1) * n]

    @cached_property
    def events(self) -> dict[str, str]:
        kinds = ("updated", "indexed") if self.axes.tachometer.index else ("updated",)
        return {f"{kind}_{axis}": f"{kind}_now_{axis}" for axis in range(self.axes.axes) for kind in kinds}

    def _captured(self) -> Iterable[Draft]:
        for axis in range(self.axes.axes):
            yield from self._window(self.of_axis(axis), f"_{axis}", captures=axis == 0)
