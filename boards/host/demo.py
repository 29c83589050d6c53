"""Talks to a demo board over a UART: settings, telemetry, and when a setting took effect."""

from collections.abc import Mapping, Sequence
from typing import Any

from tachometry.boards.host.client import Client
from tachometry.boards.host.link import Link, Port
from tachometry.boards.host.registers import HostRegisters
from tachometry.boards.host.snapshot import Snapshot
from tachometry.spec.registers.demo import PERIOD_WIDTH

# In the order in which they are written: what is measured, and what happens once, after all that it depends on.
SETTINGS = ("RATE", "ERRORS", "NOISE", "WIRES", "SPEED", "DEMO")


class DemoBoard:
    """Talks to the demo on a board, or to a simulated one.

    It raises ValueError if the manifest is not that of a demo; NoAnswer if nothing answers; WrongBoard if another
    demo answers.
    """

    def __init__(self, port: Port, manifest: Mapping[str, Any], timeout: float = 0.5) -> None:
        self.registers = registers = HostRegisters(manifest)
        if "DEMO" not in registers:
            raise ValueError("manifest must be that of a demo, which tachometry build makes")
        self._tick_cycles: int = manifest["tick_cycles"]
        self.link = Link(port, registers, timeout)
        self.client = Client(self.link.read, self.link.write, manifest)

    def set(self, **values: int) -> int:
        """Change settings of the emulator by the names of their fields; one whole register is `speed` or `rate`.

        The registers are written one after the other; return the clock since the restart of the last one. What acts
        once, such as `jump`, is done once.
        """
        if unknown := values.keys() - set(self.settings):
            raise ValueError(f"settings must be some of {', '.join(self.settings)}, not {', '.join(sorted(unknown))}")
        for register in SETTINGS:
            here = {field: values.pop(field) for field in self._fields(register) if field in values}
            if not here:
                continue
            self._write(register, here)
        return self.changed()

    @property
    def settings(self) -> list[str]:
        """Names that `set` takes."""
        return [field for register in SETTINGS for field in self._fields(register)]

    def changed(self) -> int:
        """Return when a setting was written last, in clocks since the restart."""
        return self.link.read(self.registers.offset("CHANGED"))

    def stream(self, ticks: int) -> None:
        """Ask for telemetry every so many ticks; 0: for none.

        It raises ValueError if there are more of them than the register holds.
        """
        if not 0 <= ticks < 1 << PERIOD_WIDTH:
            raise ValueError(f"ticks must be from 0 to {(1 << PERIOD_WIDTH) - 1}, not {ticks}")
        receiver = self.link.receiver
        # Up to the answer there may be frames of what was asked for before.
        receiver.frame_clocks = 0
        self.link.write(self.registers.offset("TELEMETRY"), ticks)
        receiver.frame_clocks = ticks * self._tick_cycles
        receiver.forget()

    def restart(self) -> None:
        """Reset tachometer, emulator and time; frames that were sent before are dropped, and none that came after."""
        self._write("DEMO", {"restart": 1})
        self.link.receiver.telemetry.clear()
        self.link.receiver.forget()

    def poll(self) -> Sequence[Snapshot]:
        """Return telemetry that has come since the last call."""
        return [self.registers.snapshot(words) for words in self.link.poll()]

    def _write(self, register: str, values: Mapping[str, int]) -> None:
        offset = self.registers.offset(register)
        named = {"value" if field == register.lower() else field: value for field, value in values.items()}
        self.link.write(offset, self.registers.with_fields(register, self.link.read(offset), named))

    def _fields(self, register: str) -> list[str]:
        fields = list(self.registers.fields(register, 0))
        return [register.lower()] if fields == ["value"] else fields
