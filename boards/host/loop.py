"""A client of a core with a control loop sets its commands and gains, in their units."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from tachometry.boards.host.client import Client, Read, Write

_GENERATOR = {
    "velocity": "counts_per_tick_per_lsb",
    "acceleration": "counts_per_tick2_per_lsb",
    "amplitude": "counts_per_lsb",
    "rate": "per_lsb",
}
_MODES = 4  # of the generator
_COMMANDS = {
    "command_position": "counts_per_lsb",
    "command_velocity": "rad_per_s_per_lsb",
    "command_acceleration": "rad_per_s2_per_lsb",
}


class LoopClient(Client):
    """Reads and writes a core with a control loop on a bus.

    It raises ValueError if the manifest is that of a core without registers or without a loop; WrongBoard if
    another core answers.
    """

    def __init__(self, read: Read, write: Write, manifest: Mapping[str, Any]) -> None:
        if "loop" not in manifest:
            raise ValueError("manifest must be that of a core with a control loop, which --loop makes")
        super().__init__(read, write, manifest)
        fields = (field for one in manifest["registers"]["map"] for field in one["fields"])
        written = {field["port"] for field in fields if field["access"] == "rw"}
        self._scales = {name: scale for name, scale in _scales(manifest["loop"]) if name in written}

    @property
    def settings(self) -> tuple[str, ...]:
        """Names that `set` takes."""
        return tuple(self._scales)

    def raw(self, name: str, value: float) -> int:
        """Return what stands in the registers for a value.

        It raises KeyError if there is no such setting; ValueError if it does not fit.
        """
        if name not in self._scales:
            raise KeyError(f"there is no setting {name!r}; there are {', '.join(self.settings)}")
        if not math.isfinite(value):
            raise ValueError(f"{name} must be a finite number, not {value}")
        lsb, (_, least, most) = self._scales[name], self.registers.limits(name.upper())
        if not least <= (raw := round(value / lsb)) <= most:
            raise ValueError(f"{name} must be from {least * lsb:.9g} to {most * lsb:.9g}, not {value:.9g}")
        return raw

    def set(self, *, mode: int | None = None, **values: float) -> None:
        """Write settings that the loop takes at once, with its next control tick; `mode` is that of the generator.

        It raises KeyError if there is no such setting; ValueError if one does not fit; then none is written.
        """
        if mode is not None and "generator_velocity" not in self._scales:
            raise KeyError("there is no setting 'mode': the core has no command generator")
        if mode not in (None, *range(_MODES)):
            raise ValueError(f"mode must be from 0 to {_MODES - 1}, not {mode!r}")
        raws = {name: self.raw(name, value) for name, value in values.items()}
        done = {"freeze": 0} | ({} if mode is None else {"mode": mode})
        word = self._word("LOOP")
        loop = self.registers.offset("LOOP")
        after = self.registers.with_fields("LOOP", word, done)
        self._write(loop, self.registers.with_fields("LOOP", word, {"freeze": 1}))
        for name, raw in raws.items():
            self.write(name.upper(), raw)
        self._write(loop, after)

    def enable(self, on: bool) -> None:
        """Let the loop command a current, if the input `enable` is high, too."""
        word = self.registers.with_fields("LOOP", self._word("LOOP"), {"enable": int(on)})
        self._write(self.registers.offset("LOOP"), word)


def _scales(loop: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    """Yield what one LSB of each setting is."""
    for name, gain in loop["gains"].items():
        yield name, gain["per_lsb"]
    for name, key in _COMMANDS.items():
        yield name, loop[name][key]
    for name, key in _GENERATOR.items() if "generator" in loop else ():
        yield f"generator_{name}", loop["generator"][name][key]
