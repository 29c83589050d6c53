"""The manifest of a core on a bus describes its registers; a host reads them here."""

from collections.abc import Mapping, Sequence
from typing import Any

from tachometry.boards.host.snapshot import Snapshot, lsb_of
from tachometry.spec.formats.sectors import sectors_of


class HostRegisters:
    """Holds the registers by their names.

    It raises ValueError if the manifest has no registers.
    """

    def __init__(self, manifest: Mapping[str, Any]) -> None:
        if "registers" not in manifest:
            raise ValueError("manifest must be that of a core on a bus, which tachometry generate --bus makes")
        described = manifest["registers"]
        self.module: str = manifest["module"]
        self.identification: int = described["identification"]
        self.configuration: int = described["configuration"]
        self.word_mask = (1 << described["word_bits"]) - 1
        self._registers: dict[str, Mapping[str, Any]] = {one["name"]: one for one in described["map"]}
        self.captured = [one for one in self._registers.values() if one["captured"]]
        self._rad_per_s_per_lsb: float = manifest["velocity"]["rad_per_s_per_lsb"]
        self._flags = frozenset(field["name"] for field in self._registers["STATUS"]["fields"])
        self.disc: Mapping[str, Any] | None = manifest.get("disc")
        self._units = {field["port"]: field["unit"] for one in self.captured for field in one["fields"]}
        self._unused = [self._unused_of(register) for register in self.captured]

    def __contains__(self, name: str) -> bool:
        return name in self._registers

    def offset(self, name: str) -> int:
        """Return bytes from the first register to this one."""
        return int(self._registers[name]["offset"])

    def mask(self, name: str, field: str) -> int:
        """Return bits of a field."""
        found = self._field(name, field)
        return int((1 << found["width"]) - 1 << found["low"])

    def fields(self, name: str, word: int) -> dict[str, int]:
        """Return fields of a register that shows this word, by their names, without a sign."""
        return {
            field["name"]: word >> field["low"] & (1 << field["width"]) - 1 for field in self._registers[name]["fields"]
        }

    def with_fields(self, name: str, word: int, values: Mapping[str, int]) -> int:
        """Return a word of a register with other values in some of its fields; ValueError if a value does not fit."""
        for field, value in values.items():
            found = self._field(name, field)
            width, least = found["width"], -(1 << found["width"] - 1) if found["signed"] else 0
            if not least <= value < least + (1 << width):
                raise ValueError(f"{field} must be from {least} to {least + (1 << width) - 1}, not {value}")
            mask = (1 << width) - 1
            word = word & ~(mask << found["low"]) | (value & mask) << found["low"]
        return word

    def of_degrees(self, name: str, degrees: float) -> int:
        """Return what to write to a register for an electrical angle; bits that let it act are 1. KeyError if there is
        none.
        """
        value, *acts = self._registers[name]["fields"]
        turns = round(degrees / lsb_of(value["unit"])) % (1 << value["width"])
        return turns | sum(self.mask(name, one["name"]) for one in acts)

    def disc_entries(self, displacement: Sequence[float]) -> list[int]:
        """Return entries of the core's table for a map of the disc: where each edge lies, in counts.

        It raises KeyError if the core has no table that is written; ValueError if the map has another number of edges,
        or one that does not fit.
        """
        about = self.disc
        if about is None or not about["writable"]:
            raise KeyError("there is no map of the disc that is written: see --disc-table")
        unit, edges, most = about["counts_per_lsb"], about["edges"], 1 << about["bits"] - 1
        if len(displacement) != edges:
            raise ValueError(f"displacement must have {edges} edges, not {len(displacement)}")
        if about["form"] == "edges":
            entries = shown = [round(each / unit) for each in displacement]
        else:
            lines = sectors_of(tuple(displacement), about["sectors"], unit, about["quarters"])
            entries, shown = [*lines.entries], [*lines.displacements]
        if not -most <= min(shown) <= max(shown) < most:
            raise ValueError(f"displacement must be from {-most * unit:g} to {(most - 1) * unit:g} counts")
        return entries

    def written(self, name: str, value: int) -> list[tuple[int, int]]:
        """Return offsets and words to be written for a value of a register, or of two; KeyError if there is none,
        ValueError if it does not fit.
        """
        parts, least, most = self.limits(name)
        if not least <= value <= most:
            raise ValueError(f"{name} must be from {least} to {most}, not {value}")
        return [(part["offset"], value >> part["fields"][0]["shift"] & self.word_mask) for part in parts]

    def limits(self, name: str) -> tuple[list[Mapping[str, Any]], int, int]:
        """Return a register that is written, or two of its name, the least and the greatest value; KeyError if there
        is none.
        """
        parts = [self._registers[part] for part in (name, f"{name}_LOW", f"{name}_HIGH") if part in self._registers]
        if not parts or (last := parts[-1]["fields"][-1])["access"] == "ro":
            raise KeyError(f"there is no register {name!r} that is written")
        if "most" in last:  # of the upper word
            return parts, last["least"] << last["shift"], (last["most"] + 1 << last["shift"]) - 1
        bits = last["low"] + last["width"]
        if bits == self.word_mask.bit_length():
            bits = last["port_width"]
        return parts, *((-(1 << bits - 1), (1 << bits - 1) - 1) if last["signed"] else (0, (1 << bits) - 1))

    def snapshot(self, words: Sequence[int]) -> Snapshot:
        """Return what the captured registers say that show these words, in the order of their offsets."""
        values: dict[str, int] = {}
        for register, word in zip(self.captured, words, strict=True):
            for field in register["fields"]:
                bits = word >> field["low"] & (1 << field["width"]) - 1
                if field["signed"]:
                    # Of a value of two words only the upper one has its sign; the lower one fills the bits below.
                    bits -= (bits >> field["width"] - 1) << field["width"]
                name, low = field["port"] or field["name"], (1 << field["shift"]) - 1
                values[name] = values.get(name, 0) & low | bits << field["shift"]
        return Snapshot(values, self._flags, self._rad_per_s_per_lsb, self._units)

    def possible(self, words: Sequence[int]) -> bool:
        """Return whether the captured registers can show these words: bits that no port has are as they must be."""
        for word, (unused, sign) in zip(words, self._unused, strict=True):
            if word & unused != (unused if sign and word & sign else 0):
                return False
        return True

    def _field(self, name: str, field: str) -> Mapping[str, Any]:
        for one in self._registers[name]["fields"]:
            if one["name"] == field:
                return one
        raise KeyError(field)

    @staticmethod
    def _unused_of(register: Mapping[str, Any]) -> tuple[int, int]:
        """Return bits of a captured register that repeat its sign bit, or are 0; and the sign bit, if there is one."""
        used, sign, every = 0, 0, 0xFFFF_FFFF
        for field in register["fields"]:
            width = min(max(field["port_width"] - field["shift"], 0), field["width"])
            used |= (1 << width) - 1 << field["low"]
            if field["signed"]:
                sign = 1 << field["low"] + width - 1
        return every & ~used, sign
