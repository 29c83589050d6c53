"""A recording says where it comes from: which channels of a capture its lines are, and whether they move."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Source:
    """Holds what a capture says of itself."""

    lines: Mapping[str, str]  # what the capture calls each line, by the line's name
    duration: float  # seconds: as captured
    n_changes: int  # of the lines; those that come together are one
    still: tuple[str, ...] = ()  # lines that never change
    unused: Mapping[int, str] = field(default_factory=dict)  # names of channels that were not taken, by their numbers
    moving: tuple[str, ...] | None = None  # those of them that change; None: nobody has looked
    notes: tuple[str, ...] = ()  # what else there is to say of how the capture was read
