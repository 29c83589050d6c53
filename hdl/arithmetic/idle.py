"""A simulation may skip clocks in which counters count or a division goes on, and nothing else happens."""

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable


@dataclass(frozen=True)
class IdleCounter:
    """A counter on whose value nothing depends but at its stops.

    In clocks in which all else stands still, a simulation may move it on to the next stop at once.

    Parameters
    ----------
    path : str
        Name of the signal, behind those of the boxes around it: `sampling_clock.left`.
    step : int
        What it counts by, −1 or 1.
    stops : tuple of int
        Values at which something else may follow from it.
    order : tuple of int
        Instead of these two: its values, each after the one before, if it does not count. The last is the stop.
    """

    path: str
    step: int = 0
    stops: tuple[int, ...] = ()
    order: tuple[int, ...] = ()

    @property
    def paths(self) -> tuple[str, ...]:
        """Signals that it moves on."""
        return (self.path,)

    def within(self, box: str) -> "IdleCounter":
        """Return the same from outside of a box."""
        return replace(self, path=f"{box}.{self.path}")


@dataclass(frozen=True)
class IdleDivision:
    """A division of `spec.formats.reciprocal.DividedReciprocal`, on whose steps nothing depends until it is done.

    Parameters
    ----------
    digits, less_one, m : str
        Names of the signals, as that of an `IdleCounter`. m stands still as long as the division goes on.
    steps : int
        At most 62.
    """

    digits: str
    less_one: str
    m: str
    steps: int

    @property
    def paths(self) -> tuple[str, ...]:
        """Signals that it moves on."""
        return (self.digits, self.less_one)

    def within(self, box: str) -> "IdleDivision":
        """Return the same from outside of a box."""
        digits, less_one, m = (f"{box}.{path}" for path in (self.digits, self.less_one, self.m))
        return replace(self, digits=digits, less_one=less_one, m=m)


@runtime_checkable
class HasIdleCounters(Protocol):
    """A box with such counters, or such a division."""

    @property
    def idle_counters(self) -> tuple[IdleCounter | IdleDivision, ...]:
        """With paths within the box."""
