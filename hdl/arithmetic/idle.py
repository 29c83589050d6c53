"""What a simulation may skip: clocks in which counters count, and nothing else happens."""

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

    def within(self, box: str) -> "IdleCounter":
        """The same from outside of a box."""
        return replace(self, path=f"{box}.{self.path}")


@runtime_checkable
class HasIdleCounters(Protocol):
    """A box with such counters."""

    @property
    def idle_counters(self) -> tuple[IdleCounter, ...]:
        """With paths within the box."""
