"""The points that a sweep runs: every method at every combination of the values of its axes."""

from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

from tachometry.sim.studies.sweeping.loops import LoopPoint
from tachometry.sim.studies.sweeping.sweep import Point
from tachometry.spec.language.units import SpeedUnit


class _Digested(Protocol):
    @property
    def digest(self) -> str: ...


Item = TypeVar("Item", bound=_Digested)


@dataclass(frozen=True)
class Grid(Generic[Item]):
    """Holds the points that are to be run."""

    points: dict[str, Item]  # by their digests, in order
    at: dict[str, dict[str, str]]  # where each is: values of the axes that its method has
    axes: dict[str, list[str]]  # all values of each axis
    left_out: dict[str, str] = field(default_factory=dict)  # methods of `all` that are impossible somewhere, and why


class Points(Grid[Point]):
    """Holds the points of a sweep."""

    @property
    def unit(self) -> SpeedUnit:
        """The unit in which speeds are shown: that of all points, else rad/s."""
        units = {point.spec.scale.shown_unit for point in self.points.values()}
        return units.pop() if len(units) == 1 else SpeedUnit("rad/s")

    @property
    def values(self) -> list[str]:
        """Values that are varied within the motion."""
        return list(dict.fromkeys(name for point in self.points.values() for name in point.values))


Loops = Grid[LoopPoint]
