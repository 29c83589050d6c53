"""A snapshot holds what a core showed in one clock."""

import re
from collections.abc import Iterator, Mapping
from types import MappingProxyType

_VELOCITIES = ("velocity_lower", "velocity_upper")  # ports with the LSB of velocity


def lsb_of(unit: str) -> float:
    """Return one LSB of a port in its unit, such as `2^-8 counts` or `1/32767`; electrical turns give degrees."""
    found = re.match(r"2\^-(\d+) (electrical)?|1/(\d+)", unit)
    if found is None:
        return 1.0
    power, turns, part = found.groups()
    return 1 / int(part) if part else (360 if turns else 1) / 2 ** int(power)


class Snapshot(Mapping[str, int]):
    """Holds what the core showed in one clock: integers by the names of the ports; it cannot be changed.

    Ports of one bit are there as 0 or 1, and so are `updated` and `indexed`, the events since the capture before.

    - `rad_per_s_per_lsb`: What one LSB of `velocity` is.
    - `units`: Units of ports, as the manifest has them.
    """

    __slots__ = ("_flags", "_rad_per_s_per_lsb", "_units", "_values")

    def __init__(
        self,
        values: Mapping[str, int],
        flags: frozenset[str],
        rad_per_s_per_lsb: float,
        units: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self._values = MappingProxyType(dict(values))
        self._units, self._flags, self._rad_per_s_per_lsb = units, flags, rad_per_s_per_lsb

    def __getitem__(self, name: str) -> int:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return f"Snapshot({', '.join(f'{name}={value}' for name, value in self.items())})"

    @property
    def flags(self) -> Mapping[str, bool]:
        """The flags alone."""
        return MappingProxyType({name: bool(self[name]) for name in self if name in self._flags})

    def in_unit(self, name: str) -> float:
        """Return a value in its unit: a sine from -1 to 1, and an electrical angle in degrees."""
        return self[name] * lsb_of(self._units.get(name, ""))

    @property
    def velocity_rad_per_s(self) -> float:
        """The velocity in rad/s."""
        return self["velocity"] * self._rad_per_s_per_lsb

    @property
    def bounds_rad_per_s(self) -> tuple[float, float] | None:
        """The bounds of the velocity in rad/s; None if the core has none, or not yet."""
        if not self.get("bounds_valid"):
            return None
        lower, upper = (self[name] * self._rad_per_s_per_lsb for name in _VELOCITIES)
        return lower, upper
