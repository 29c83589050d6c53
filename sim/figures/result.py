"""A figure is data: panels with curves, and the paper's claims with the values that were computed."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tachometry.sim.figures.lab import Lab


@dataclass(frozen=True, eq=False)
class Curve:
    """Is a line of a panel.

    Parameters
    ----------
    label : str
        Its name in the legend and in the CSV.
    x, y : arrays, shape (n,)
    style : str
        `line`, `held` (each value until the next), `dots` or `reference` (thin and grey).
    """

    label: str
    x: NDArray[np.floating[Any]]
    y: NDArray[np.floating[Any]]
    style: str = "line"


@dataclass(frozen=True, eq=False)
class Panel:
    """Is a pair of axes with curves.

    Parameters
    ----------
    log : str
        Axes that are logarithmic: "", "x", "y" or "xy".
    levels : tuple of float
        Where thin horizontal lines are drawn.
    y_limits : pair of float or None
    whole : bool
        Ticks of the y axis at whole numbers only.
    marks : tuple of (str, float)
        Letters at some x.
    """

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    log: str = ""
    levels: tuple[float, ...] = ()
    y_limits: tuple[float, float] | None = None
    whole: bool = False
    marks: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Claim:
    """Holds a paper's word on a figure beside the value that was computed.

    Parameters
    ----------
    paper : str
        The paper's statement.
    found : str
        What was computed, with its numbers.
    """

    paper: str
    found: str
    agrees: bool


@dataclass(frozen=True, eq=False)
class Result:
    """Holds a figure that was computed.

    Parameters
    ----------
    source : str
        Paper and number of the figure.
    title : str
        As in the paper.
    settings : str
        What was simulated.
    panels : tuple of Panel
        One below the other.
    """

    source: str
    title: str
    settings: str
    panels: tuple[Panel, ...]
    claims: tuple[Claim, ...]

    @property
    def agrees(self) -> bool:
        return all(claim.agrees for claim in self.claims)


@dataclass(frozen=True)
class Entry:
    """Describes a figure that can be computed.

    Parameters
    ----------
    compute : callable
    seconds : float
        About what it takes.
    compiled : bool
        Whether it needs a C++ compiler.
    """

    name: str
    compute: "Callable[[Lab], Result]"
    seconds: float
    compiled: bool = False


def percent(part: NDArray[np.bool_]) -> float:
    """Return share of True, in per cent."""
    return float(100 * np.mean(part))
