"""Errors of extras in plans, a file each, with the function `expected`."""

from collections.abc import Callable

from tachometry.sim.studies.extras import electrical
from tachometry.spec import TachometerSpec

_EXPECTED: dict[str, Callable[..., tuple[str, str] | None]] = {"electrical": electrical.expected}


def expected_rows(spec: TachometerSpec, rad_per_s: float) -> list[tuple[str, str]]:
    """Return names and texts of the errors that extras of a core have at a constant speed."""
    found = (_EXPECTED[extra.name](extra, spec, rad_per_s) for extra in spec.extras if extra.name in _EXPECTED)
    return [row for row in found if row is not None]
