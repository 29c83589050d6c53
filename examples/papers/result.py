"""A figure is data: panels with curves, and the paper's claims with the values that were computed."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Curve:
    """Is a line of a panel."""

    label: str  # its name in the legend and in the CSV
    # x and y: shape (n,)
    x: NDArray[np.floating[Any]]
    y: NDArray[np.floating[Any]]
    style: str = "line"  # `line`, `held` (each value until the next), `dots` or `reference` (thin and grey)


@dataclass(frozen=True, eq=False)
class Panel:
    """Is a pair of axes with curves."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    log: str = ""  # axes that are logarithmic: "", "x", "y" or "xy"
    levels: tuple[float, ...] = ()  # where thin horizontal lines are drawn
    y_limits: tuple[float, float] | None = None
    whole: bool = False  # ticks of the y axis at whole numbers only
    marks: tuple[tuple[str, float], ...] = ()  # letters at some x


@dataclass(frozen=True)
class Claim:
    """Holds a paper's word on a figure beside the value that was computed."""

    paper: str  # the paper's statement
    found: str  # what was computed, with its numbers
    agrees: bool


@dataclass(frozen=True, eq=False)
class Result:
    """Holds a figure that was computed."""

    source: str  # paper and number of the figure
    title: str  # as in the paper
    settings: str  # what was simulated
    panels: tuple[Panel, ...]  # one below the other
    claims: tuple[Claim, ...]

    @property
    def agrees(self) -> bool:
        return all(claim.agrees for claim in self.claims)


def percent(part: NDArray[np.bool_]) -> float:
    """Return share of True, in per cent."""
    return float(100 * np.mean(part))
