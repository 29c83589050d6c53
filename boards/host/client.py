"""A client reads the registers of a core on a bus, by the names of the ports."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tachometry.boards.host.registers import HostRegisters
from tachometry.boards.host.snapshot import Snapshot

Read = Callable[[int], int]
Write = Callable[[int, int], None]


class WrongBoard(ValueError):
    """The board has another core than the manifest."""


class Client:
    """Reads and writes the registers of a core on a bus.

    Several threads must not use it at the same time: a snapshot takes several accesses.

    - `read`: Reads the register at an offset in bytes.
    - `write`: Writes a value to the register at an offset in bytes.
    - `manifest`: What `NAME.json` of a core on a bus says.

    It raises ValueError if the manifest is that of a core without registers; WrongBoard if another
    core answers.
    """

    def __init__(self, read: Read, write: Write, manifest: Mapping[str, Any]) -> None:
        self.registers = registers = HostRegisters(manifest)
        self._read, self._write = read, write
        self._hold = registers.mask("CONTROL", "hold")
        found = self._word("IDENTIFICATION")
        if found != registers.identification:
            raise WrongBoard(
                f"the board must answer with 0x{registers.identification:08x}, as a tachometer does, not 0x{found:08x}"
            )
        found = self._word("CONFIGURATION")
        if found != registers.configuration:
            raise WrongBoard(
                f"the board has configuration 0x{found:08x}, the manifest of {registers.module} says "
                f"0x{registers.configuration:08x}"
            )

    def snapshot(self) -> Snapshot:
        """Return capture, and read all that was captured.

        After `hold(True)` it does not capture, and reads what the input `capture` of the core has captured last. If
        that input captures while this reads, the snapshot is mixed.
        """
        # In the order of their offsets: the first captures.
        return self.registers.snapshot([self._word(one["name"]) for one in self.registers.captured])

    def counters(self) -> dict[str, int]:
        """Return how often something happened since reset or `clear`, by the names of the counters; 255: or more."""
        return self.registers.fields("COUNTERS", self._word("COUNTERS"))

    def clear(self) -> None:
        """Set all counters to 0, and clear the faults and the filtered edges of the core."""
        self.control("clear")

    def control(self, field: str) -> None:
        """Write 1 to a field of CONTROL, such as `preset` or `home`; KeyError if the core does not have it."""
        mask = self.registers.mask("CONTROL", field)
        self._write(self.registers.offset("CONTROL"), self._word("CONTROL") & self._hold | mask)

    def write(self, name: str, value: int) -> None:
        """Write a register, such as PRESET or PROBE_EDGES, or two of its name.

        It raises KeyError if the core has none that is written; ValueError if the value does not fit; then nothing is
        written.
        """
        for offset, word in self.registers.written(name, value):
            self._write(offset, word)

    def write_degrees(self, name: str, degrees: float) -> None:
        """Write an electrical angle, to ANGLE_OFFSET or ANGLE_SET; KeyError if the core has no such register."""
        self.write(name, self.registers.of_degrees(name, degrees))

    def write_disc(self, displacement: Sequence[float]) -> bool:
        """Write a map of the disc, and return whether the core has it then; it forgets its place in the turn.

        `displacement` is where each edge lies, in counts, as in the file of `tachometry calibrate`. While captures are
        held the map cannot be read back: False. It raises what `HostRegisters.disc_entries` raises; then nothing is
        written.
        """
        entries = self.registers.disc_entries(displacement)
        for address, entry in enumerate(entries):
            self.write("DISC_ADDRESS", address)
            value = entry & self.registers.mask("DISC_DATA", "value")
            self.write("DISC_DATA", self.registers.with_fields("DISC_DATA", value, {"write": 1}))
        return all(self._has_entry(*each) for each in enumerate(entries))

    def turn_disc(self, by: int) -> None:
        """Move the place in the turn of a core without an index on by counts, and let it use its map; see
        `tachometry calibrate --align`. It raises KeyError if the core has no DISC_TURN, ValueError if it is no count of
        a turn.
        """
        self.write("DISC_TURN", self.registers.with_fields("DISC_TURN", 0, {"by": by, "now": 1}))

    def _has_entry(self, edge: int, entry: int) -> bool:
        self.write("DISC_ADDRESS", edge)
        self._word(self.registers.captured[0]["name"])
        return self._word("DISC_ENTRY") == entry & self.registers.word_mask

    def hold(self, on: bool) -> None:
        """Let only the input `capture` of the core capture (True), or `snapshot`, too (False, as after reset)."""
        self._write(self.registers.offset("CONTROL"), self._hold if on else 0)

    def _word(self, register: str) -> int:
        return self._read(self.registers.offset(register)) & self.registers.word_mask
