"""A wheel whose teeth make a pattern, and how its place is known."""

import re
from dataclasses import dataclass

_MOST_MISSING, _MOST_GAPS = 4, 4  # with more missing, a gap is too long to go by the speed before it


def parts_of(pattern: str) -> tuple[tuple[int, int], ...]:
    """Return the parts of a wheel in turn: teeth of a full wheel, and the last of them missing, or −1: one too many.

    It is empty for a text that is no pattern: 36-2-2-2 has its gaps evenly, 15-2,3-2,18-2 as they are listed, 24+1 has
    an extra tooth halfway between two.
    """
    if match := re.fullmatch(r"(\d{1,8})\+1", pattern, re.ASCII):
        return ((int(match[1]), -1),) if int(match[1]) >= 3 else ()
    parts = [[int(number) for number in part.split("-")] for part in pattern.split(",") if re.fullmatch(_PART, part)]
    if len(parts) == 1 < len(parts[0]):
        teeth, *gaps = parts[0]
        ends = [teeth * number // len(gaps) for number in range(len(gaps) + 1)]
        parts = [[end - begin, gap] for begin, end, gap in zip(ends, ends[1:], gaps, strict=False)]
    if len(parts) < len(pattern.split(",")) or len(parts) > _MOST_GAPS or any(len(part) != 2 for part in parts):
        return ()
    runs = [teeth - gap for teeth, gap in parts]
    legal = min(runs) >= 1 and max(runs) >= 3 and all(1 <= gap <= _MOST_MISSING for _, gap in parts)
    return tuple((teeth, gap) for teeth, gap in parts) if legal else ()


_PART = re.compile(r"\d{1,8}(-\d)+", re.ASCII)


@dataclass(frozen=True)
class ToothWheel:
    """A wheel with gaps, or with an extra tooth, and how its place is known by the time of a tooth.

    The period is the distance of the latest two teeth in a row. Until the place is known, a tooth after more than
    `fewest_halves` half periods, at most `most_halves`, is the first one after a gap. One gap is a place at once; of
    several the rows of teeth between them must fill a turn, and then each is as long as it was a turn ago. From then on
    teeth are counted. Where a gap must be, the missing teeth come a period apart, and the next tooth must be as late as
    that again, else the place is looked for anew. So all missing teeth have come before the next one does.

    An extra tooth comes within 3/4 of a period, after four teeth in a row. It does not count.
    """

    teeth: int  # that are there, without an extra one
    gaps: tuple[int, ...]  # missing teeth of each gap, in turn; empty: there is an extra tooth
    longest: int  # clocks of the greatest distance of teeth that is measured, of the form 2^n − 1

    @property
    def width(self) -> int:
        """Bits of a distance."""
        return self.longest.bit_length()

    def fewest_halves(self, missing: int) -> int:
        """Return the half periods that a gap is longer than: three for a gap of two periods, four for one of three."""
        return max(3, 2 * missing)

    @property
    def most_halves(self) -> int:
        """Half periods that a gap is not longer than, while it is looked for: twice as many as the longest has."""
        return 4 * (max(self.gaps) + 1)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Teeth that gaps miss, each number once; a gap is of the greatest whose half periods but one have passed."""
        return tuple(sorted({*self.gaps}))
