"""A client of a core on a bus: what its registers show, by the names of the ports."""

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any

Read = Callable[[int], int]
Write = Callable[[int, int], None]

_VELOCITIES = ("velocity_lower", "velocity_upper")  # ports with the LSB of velocity


class WrongBoard(ValueError):
    """What answers is not the core of the manifest."""


class Snapshot(Mapping[str, int]):
    """What the core showed in one clock: integers by the names of the ports; it cannot be changed.

    Ports of one bit are there as 0 or 1, and so are `updated` and `indexed`, the events since the capture before.

    Parameters
    ----------
    values : mapping of str to int
    flags : iterable of str
        Names of those that are flags.
    rad_per_s_per_lsb : float
        What one LSB of `velocity` is.
    """

    __slots__ = ("_flags", "_rad_per_s_per_lsb", "_values")

    def __init__(self, values: Mapping[str, int], flags: frozenset[str], rad_per_s_per_lsb: float) -> None:
        self._values = MappingProxyType(dict(values))
        self._flags = flags
        self._rad_per_s_per_lsb = rad_per_s_per_lsb

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


class Client:
    """A core on a bus.

    Several threads must not use it at the same time: a snapshot takes several accesses.

    Parameters
    ----------
    read : callable of int
        Reads the register at an offset in bytes.
    write : callable of int and int
        Writes a value to the register at an offset in bytes.
    manifest : mapping
        What `NAME.json` of a core on a bus says.

    Raises
    ------
    ValueError
        If the manifest is that of a core without registers.
    WrongBoard
        If what answers is not the core of the manifest.
    """

    def __init__(self, read: Read, write: Write, manifest: Mapping[str, Any]) -> None:
        if "registers" not in manifest:
            raise ValueError("manifest must be that of a core on a bus, which tachometry generate --bus makes")
        self._read, self._write = read, write
        described = manifest["registers"]
        self._registers: dict[str, Mapping[str, Any]] = {one["name"]: one for one in described["map"]}
        self._bits: int = described["word_bits"]
        self._rad_per_s_per_lsb: float = manifest["velocity"]["rad_per_s_per_lsb"]
        self._hold, self._clear = (self._mask("CONTROL", name) for name in ("hold", "clear"))
        found = self._word("IDENTIFICATION")
        if found != described["identification"]:
            raise WrongBoard(
                f"the board must answer with 0x{described['identification']:08x}, as a tachometer does, "
                f"not 0x{found:08x}"
            )
        found = self._word("CONFIGURATION")
        if found != described["configuration"]:
            raise WrongBoard(
                f"the board has configuration 0x{found:08x}, the manifest of {manifest['module']} says "
                f"0x{described['configuration']:08x}"
            )

    def snapshot(self) -> Snapshot:
        """Capture, and read all that was captured.

        After `hold(True)` it does not capture, and reads what the input `capture` of the core has captured last. If
        that input captures while this reads, the snapshot is mixed.
        """
        captured = [one for one in self._registers.values() if one["captured"]]
        # In the order of their offsets: the first captures.
        words = {one["name"]: self._word(one["name"]) for one in captured}
        values: dict[str, int] = {}
        for register in captured:
            for field in register["fields"]:
                bits = words[register["name"]] >> field["low"] & (1 << field["width"]) - 1
                if field["signed"]:
                    # Of a value of two words only the upper one has its sign; the lower one fills the bits below.
                    bits -= (bits >> field["width"] - 1) << field["width"]
                name, low = field["port"] or field["name"], (1 << field["shift"]) - 1
                values[name] = values.get(name, 0) & low | bits << field["shift"]
        flags = frozenset(field["name"] for field in self._registers["STATUS"]["fields"])
        return Snapshot(values, flags, self._rad_per_s_per_lsb)

    def counters(self) -> dict[str, int]:
        """How often something happened since reset or `clear`, by the names of the counters; 255 is 255 or more."""
        word = self._word("COUNTERS")
        fields = self._registers["COUNTERS"]["fields"]
        return {field["name"]: word >> field["low"] & (1 << field["width"]) - 1 for field in fields}

    def clear(self) -> None:
        """Set all counters to 0."""
        self._write(self._offset("CONTROL"), self._word("CONTROL") & self._hold | self._clear)

    def hold(self, on: bool) -> None:
        """Let only the input `capture` of the core capture (True), or `snapshot`, too (False, as after reset)."""
        self._write(self._offset("CONTROL"), self._hold if on else 0)

    def _offset(self, register: str) -> int:
        return int(self._registers[register]["offset"])

    def _word(self, register: str) -> int:
        return self._read(self._offset(register)) & (1 << self._bits) - 1

    def _mask(self, register: str, name: str) -> int:
        (field,) = (field for field in self._registers[register]["fields"] if field["name"] == name)
        return int((1 << field["width"]) - 1 << field["low"])
