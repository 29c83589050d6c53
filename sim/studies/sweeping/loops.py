"""A point of a sweep over control loops: a setting with its seeds, and the row of figures that comes of it."""

import hashlib
import pickle
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from tachometry.sim.build import digest
from tachometry.sim.studies.loops import control
from tachometry.sim.studies.loops.control import Outcome, Setting, mean
from tachometry.sim.studies.sweeping.sweep import OtherCode, Row, code_digest
from tachometry.spec.language.option import ParameterError

# Columns of an outcome, in order, with what tables call them.
FIGURES = {
    "rms": ("rms_error_rad_s", "RMS error (rad/s)"),
    "largest": ("greatest_error_rad_s", "greatest"),
    "dip": ("dip_rad_s", "dip (rad/s)"),
    "sound": ("current_above_50_hz_a", "current > 50 Hz (A rms)"),
    "limited": ("share_at_limit", "at limit"),
}


@dataclass(frozen=True)
class LoopPoint:
    """Holds a setting with its seeds."""

    method: str  # what the method is called
    setting: Setting
    text: str  # the motion in words
    seeds: tuple[int, ...]

    @cached_property
    def digest(self) -> str:
        """Digest of all that decides the row."""
        motion = [array.tobytes() for array in vars(self.setting.task.motion).values()]
        one, task = self.setting, self.setting.task
        rest = (one.spec, one.gains, task.load, task.virtual, task.noise, one.motor, one.encoder, one.begin, one.gates)
        return digest(self.code, self.method, motion, *rest, self.seeds)

    @property
    def code(self) -> str:
        """Digest of the code that the row depends on."""
        return _code()


def _code() -> str:
    own = [Path(file).read_bytes() for file in (control.__file__, __file__)]
    return hashlib.sha256(code_digest(hardware=True).encode() + b"".join(own)).hexdigest()


def run_packed(code: str, packed: bytes) -> Iterator[Row | Exception]:
    """Yield the rows of pickled points, on any machine with the same code: the figures of `FIGURES`, and `point`.

    The error of a point takes the place of its row. It raises OtherCode if the code here is another.
    """
    if code != _code():
        raise OtherCode(f"{platform.node()} has another one")
    for point in pickle.loads(packed):
        try:
            outcomes = [point.setting.outcome(log) for log in control.each_seed(point.setting, point.seeds, jobs=1)]
            yield {"point": point.digest} | row_of(mean(outcomes))
        except ValueError as error:
            yield ParameterError.longer(error, f" (method {point.method}, motion {point.text})")
        except OSError as error:
            yield error


def row_of(outcome: Outcome) -> dict[str, Any]:
    """Return the columns of an outcome."""
    return {column: getattr(outcome, name) for name, (column, _) in FIGURES.items()}


def seeds_from(first: int, count: int) -> tuple[int, ...]:
    """Return so many seeds, one after the other; ParameterError if it is none, or more than a thousand."""
    if not 1 <= count <= 1000:
        raise ParameterError("seeds", f"must be from 1 to 1000, not {count}")
    return tuple(range(first, first + count))
