"""A recording says where it comes from: which channels of a capture its lines are, and whether they move."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Source:
    """Holds what a capture says of itself.

    Parameters
    ----------
    lines : mapping of str to str
        What the capture calls each line, by the line's name.
    duration : float, seconds
        As captured.
    n_changes : int
        Of the lines; those that come together are one.
    still : tuple of str
        Lines that never change.
    unused : mapping of int to str
        Names of the channels that were not taken, by their numbers.
    moving : tuple of str or None
        Those of them that change; None: nobody has looked.
    notes : tuple of str
        What else there is to say of how the capture was read.
    """

    lines: Mapping[str, str]
    duration: float
    n_changes: int
    still: tuple[str, ...] = ()
    unused: Mapping[int, str] = field(default_factory=dict)
    moving: tuple[str, ...] | None = None
    notes: tuple[str, ...] = ()
