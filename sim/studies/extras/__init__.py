"""Errors of extras in plans and comparisons, a file each, with the functions `expected` and `judged`."""

from collections.abc import Callable
from typing import Any

from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.studies.extras import electrical
from tachometry.spec import TachometerSpec

_EXPECTED: dict[str, Callable[..., tuple[str, str] | None]] = {"electrical": electrical.expected}
_JUDGED: dict[str, Callable[..., list[tuple[FloatArray, FloatArray]]]] = {"electrical": electrical.judged}


def expected_rows(spec: TachometerSpec, rad_per_s: float) -> list[tuple[str, str]]:
    """Return names and texts of the errors that extras of a core have at a constant speed."""
    found = (_EXPECTED[extra.name](extra, spec, rad_per_s) for extra in spec.extras if extra.name in _EXPECTED)
    return [row for row in found if row is not None]


def judged_angles(spec: TachometerSpec, *of: Any) -> list[tuple[FloatArray, FloatArray]]:
    """Return errors of angles, see `electrical.judged`; nothing if the core shows none."""
    return next((_JUDGED[extra.name](extra, spec, *of) for extra in spec.extras if extra.name in _JUDGED), [])
