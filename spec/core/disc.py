"""The map of a disc: where every edge lies, as `tachometry calibrate` writes it into a file."""

import json
import math
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from tachometry.spec.language.files import read_text

FORMAT = 1
_MOST_BYTES = 1 << 28  # of a file


@dataclass(frozen=True)
class Disc:
    """The displacement of every edge of a disc, with what is known of its measurement.

    Edge e, between the positions e - 1 and e, lies at e + displacement[e]. ValueError if a value is out of range.
    """

    counts_per_rev: int
    displacement: tuple[float, ...]  # counts, forward
    decoding: int  # counts per pulse
    index_place: int | None  # position of the index, from which edges are counted; None: any edge is edge 0
    error: float  # counts RMS: how far the displacements are off
    jitter: float  # counts RMS, of each edge from turn to turn
    speeds_rad_per_s: tuple[float, float]  # the least and the greatest
    turns: float  # that were used
    one_speed: bool  # whether ripple of the torque may be in the displacements
    reverse: bool = False  # whether forward is that of --reverse

    def __post_init__(self) -> None:
        if len(self.displacement) != self.counts_per_rev:
            raise ValueError(f"must have {self.counts_per_rev} displacements, not {len(self.displacement)}")
        if not all(math.isfinite(each) and abs(each) < self.counts_per_rev for each in self.displacement):
            raise ValueError(f"must have displacements within {self.counts_per_rev} counts")

    @property
    def text(self) -> str:
        """The file: JSON, a value a line."""
        values = {"format": FORMAT, **asdict(self)}.items()
        return "{\n" + ",\n".join(f'"{name}": {json.dumps(value)}' for name, value in values) + "\n}\n"

    @staticmethod
    def read(path: Path) -> "Disc":
        """Return the map in a file; OSError if it cannot be read, ValueError if it has none."""
        try:
            return Disc.parse(read_text(path, _MOST_BYTES))
        except ValueError as error:
            why = "it is no text" if isinstance(error, UnicodeDecodeError) else error
            raise ValueError(f"must be a file that tachometry calibrate -o wrote, not '{path}': {why}") from error

    @staticmethod
    def parse(text: str) -> "Disc":
        """Read the file; ValueError if it is not one of these."""
        try:
            found = json.loads(text)
            values = {about.name: found[about.name] for about in fields(Disc)}
            tuples = {name: tuple(map(float, values[name])) for name in ("displacement", "speeds_rad_per_s")}
        except (ValueError, TypeError, KeyError, RecursionError):
            raise ValueError("it has no map of a disc") from None
        if found.get("format") != FORMAT:
            raise ValueError(f"its format must be {FORMAT}, not {found.get('format')!r}")
        return Disc(**values | tuples)
