"""A wheel with missing teeth, and how its gap is known."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ToothWheel:
    """A wheel of teeth, some of which are missing in a row, and how its gap is known by the time of a tooth.

    The period is the distance of the latest two teeth in a row. Until the gap is known, a tooth after more than
    `fewest_halves` half periods, at most `most_halves`, is the first one after it. From then on teeth are counted.
    Where the gap must be, the missing teeth come a period apart, and the next tooth must be as late as that again,
    else the gap is looked for anew. So all missing teeth have come before the next one does.
    """

    teeth: int  # that are there
    missing: int
    longest: int  # clocks of the greatest distance of teeth that is measured, of the form 2^n − 1

    @property
    def width(self) -> int:
        """Bits of a distance."""
        return self.longest.bit_length()

    @property
    def fewest_halves(self) -> int:
        """Half periods that a gap is longer than: three for a gap of two periods, four for one of three."""
        return max(3, 2 * self.missing)

    @property
    def most_halves(self) -> int:
        """Half periods that a gap is not longer than, while it is looked for: twice as many as it has."""
        return 4 * (self.missing + 1)
