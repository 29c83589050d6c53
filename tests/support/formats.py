"""Texts as programs and instruments write them, of one motion: so many quarter periods forward, 0.25 ms each.

Only the shape of each format is that of others; all rows are made here. formats.json has for each the lines above them
and a row as an f-string of its number k and the levels a and b, or the name of such a row.
"""

import gzip
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tachometry.sim.captures.cell_parsers import Threshold
from tachometry.sim.captures.header import PLAIN, TextOptions
from tachometry.sim.captures.time_unit import TimeUnit

QUARTERS = 40
STEP_S = 0.25e-3
_LEVELS = [(0, 0), (1, 0), (1, 1), (0, 1)]
_DATA = json.loads(Path(__file__).with_name("formats.json").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Format:
    """A format: its name, the name of its file, its bytes, what must be given to read it, and what is told then."""

    name: str
    suffix: str
    content: bytes
    text: TextOptions = PLAIN
    a: str | None = None
    b: str | None = None
    samplerate_hz: float | None = None
    notes: tuple[str, ...] = ()

    def write(self, folder: Path) -> Path:
        """Write the file; return its path."""
        path = folder / f"x{self.suffix}"
        path.write_bytes(self.content)
        return path


def _content(head: str, row: str, end: str, encoding: str, packed: bool, cut: bool) -> bytes:
    made = compile(f"f'''{_DATA['rows'].get(row, row)}'''", "formats.json", "eval")
    levels = [(k, *_LEVELS[k % 4]) for k in range(QUARTERS + 1)]
    rows = [eval(made, {"k": k, "a": a, "b": b, "STEP_S": STEP_S}) + end for k, a, b in levels]
    content = (head.replace("\n", end) + "".join(rows))[: -1 if cut else None].encode(encoding)
    return gzip.compress(content, mtime=0) if packed else content


USUAL = {"row": "seconds", "end": "\n", "encoding": "utf-8", "packed": False, "cut": False, "suffix": ".csv"}


def _format(about: dict[str, Any]) -> Format:
    given: dict[str, Any] = USUAL | about
    text = TextOptions(
        time=given.get("time"),
        unit=TimeUnit(*given["unit"]) if "unit" in given else None,
        threshold=Threshold(1.65, 0.4) if "volts" in given else None,
    )
    content = _content(*(given[name] for name in ("head", "row", "end", "encoding", "packed", "cut")))
    a, b, samplerate = (given.get(name) for name in ("a", "b", "samplerate_hz"))
    return Format(given["name"], given["suffix"], content, text, a, b, samplerate, tuple(given.get("notes", ())))


FORMATS = [_format(about) for about in _DATA["formats"]]
