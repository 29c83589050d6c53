"""One map says which register of a core on a bus holds what; gates, drivers and documents read it.

The registers follow from the ports of the core. A port of several bits has a register of its own, extended to 32 bits
by its sign or by zeros, or two of them if it is wider; ports of one bit are flags of STATUS. Offsets are in bytes.

A capture takes all of these in one clock: the position and whatever else belongs to a tick is of the latest tick, the
velocity and whatever belongs to an update is of the latest update, and the age says how many ticks came after what
caused it. Only `filtered_edges`, `over_speed`, `probed` and what a watch of the encoder shows are of the clock of the
capture.
Reading the first captured register, VELOCITY, captures, and the others keep what was captured until the next capture.
Before the first update the velocity is 0, and what else has a unit and belongs to an update is not defined.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

from tachometry.spec.control import AnySpec
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.language.field import WORD, Draft, Field, Register, position_words
from tachometry.spec.language.port import INDEX, MISSED, WIDE, Port
from tachometry.spec.registers.manifest import manifest

IDENTIFICATION = int.from_bytes(b"TACH", "big")
COUNTER_WIDTH = 8  # bits of each counter of COUNTERS

# What a core has with an interrupt, besides the registers.
IRQ = Port("irq", "output", help="Interrupt, high while an event waits that INTERRUPT_ENABLE lets through.")

_CONTROLS = {"preset": "Writing 1 sets the position to PRESET.", "home": "Writing 1 lets the next index be taken."}
_DESCRIBED = ("name", "low", "width", "access", "reset", "signed", "unit", "port", "shift")  # in the manifest


@dataclass(frozen=True)
class RegisterMap:
    """Holds all registers of a core."""

    spec: TachometerSpec
    # there is an output `irq`, with registers of its own, which follow all others
    irq: bool = field(default=False, kw_only=True)

    @classmethod
    def of(cls, core: Any) -> Self:
        """Return the registers of a core of the kind that the class is for."""
        return cls(core.tachometer)

    @cached_property
    def registers(self) -> tuple[Register, ...]:
        """In the order of their offsets, which follow each other without a gap."""
        drafts = (
            *self._head(),
            *self._captured(),
            *self._placing(),
            *(draft for extra in self.spec.extras for draft in extra.registers(self.spec)),
            *self._added(),
            *self._interrupting(),
        )
        return tuple(
            Register(name, number * WORD // 8, help, fields, **more)
            for number, (name, help, fields, more) in enumerate(drafts)
        )

    def __iter__(self) -> Iterator[Register]:
        return iter(self.registers)

    def __getitem__(self, name: str) -> Register:
        for register in self.registers:
            if register.name == name:
                return register
        raise KeyError(name)

    @property
    def address_width(self) -> int:
        """Bits of the address of a byte; at the highest address there is no register."""
        return (len(self.registers) * WORD // 8).bit_length()

    @property
    def core(self) -> AnySpec:
        """The spec that the registers are of."""
        return self.spec

    @property
    def core_ports(self) -> tuple[Port, ...]:
        """Ports that the core has beside those of the bus; what is written is no input."""
        written = {field.port for field in self.settings}
        return (*(port for port in self.core.ports if port.name not in written), *(IRQ,) * self.irq)

    @cached_property
    def interrupts(self) -> dict[str, str]:
        """Events that raise the interrupt, each with its meaning; none without an interrupt."""
        if not self.irq:
            return {}
        found = {"index": "An index was taken."} if self.spec.index else {}
        found["overflow"] = "A tick at more than the maximum speed: its pulse_count was saturated."
        found["stall"] = "The shaft has come to rest: standstill rises."
        late = ", or an external tick was missing or came too early" if self.spec.external_tick else ""
        found["error"] = f"Both lines changed at once{late}."
        for extra in self.spec.extras:
            found |= {name: event.help for name, event in extra.events(self.spec).items()}
        return found

    @property
    def quantities(self) -> tuple[tuple[str, float, str], ...]:
        """Numbers that drivers need beside those of every tachometer: name, value, and what it means."""
        return ()

    @cached_property
    def ports(self) -> tuple[Port, ...]:
        """Outputs of the core that are captured."""
        live = {strobe for strobe, names in self.spec.ports.strobes.items() if names}
        return tuple(port for port in self.core.ports.outputs if port.held_by in live and not port.is_strobe)

    @property
    def strobes(self) -> tuple[str, ...]:
        """Strobes that the bank follows."""
        return tuple(self.spec.ports.strobes)

    @cached_property
    def events(self) -> dict[str, str]:
        """Flags that say that something has happened since the capture before, each with the input that says it."""
        found = {"updated": self.spec.whole} | ({"indexed": INDEX} if self.spec.index else {})
        return found | ({WIDE: WIDE, MISSED: MISSED} if self.spec.front_end.index_state else {})

    @cached_property
    def status(self) -> tuple[Register, ...]:
        """Registers of flags."""
        return tuple(register for register in self.registers if register.name.split("_")[0] == "STATUS")

    @property
    def settings(self) -> tuple[Field, ...]:
        """Fields whose value what is around the bank follows."""
        return tuple(field for register in self.registers for field in register.fields if field.writable and field.port)

    @property
    def live(self) -> tuple[Field, ...]:
        """Fields that show a port of what is around the bank as it is, without a capture."""
        fields = (field for register in self.registers if not register.captured for field in register.fields)
        return tuple(field for field in fields if field.port and not field.writable)

    @cached_property
    def counted(self) -> dict[str, str]:
        """Fields of COUNTERS, each with what it counts."""
        found = {"decode_errors": "Clocks in which both lines changed at once."}
        found["overflows"] = "Ticks whose pulse_count was saturated."
        found["lost_updates"] = "Updates of the velocity that no capture has shown."
        if self.spec.external_tick:
            found["tick_errors"] = "External ticks that were missing or came too early."
        return found

    @cached_property
    def configuration(self) -> int:
        """A hash of all that a driver relies on: a driver that was made for one core refuses another."""
        core = {name: entry for name, entry in manifest(self.core).items() if name != "options"}
        described: list[Any] = [core, [(name, help) for name, help, *_ in self._captured()]]
        described += [[*self.interrupts]] if self.irq else []
        return int.from_bytes(hashlib.sha256(json.dumps(described, sort_keys=True).encode()).digest()[:4], "big")

    def described(self) -> dict[str, Any]:
        """Return what the manifest says of the registers."""
        widths = {port.name: port.width for port in self.ports}
        return {
            "word_bits": WORD,
            "identification": IDENTIFICATION,
            "configuration": self.configuration,
            "map": [
                {
                    "name": register.name,
                    "offset": register.offset,
                    "captured": register.captured,
                    "captures": register.captures,
                    "fields": [
                        {
                            **{key: getattr(field, key) for key in _DESCRIBED},
                            "reset": field.reset & (1 << field.width) - 1,
                            "port_width": widths.get(field.port, field.kept + field.shift),
                            **({} if field.most is None else {"least": field.least, "most": field.most}),
                        }
                        for field in register.fields
                    ],
                }
                for register in self.registers
            ],
        }

    def _head(self) -> Iterable[Draft]:
        help, more = "Says that a tachometer answers: the letters TACH.", {"constant": True}
        yield "IDENTIFICATION", help, (Field("value", WORD, reset=IDENTIFICATION),), more
        help = "Says which core it is: a hash of all that a driver relies on, as the manifest has it."
        yield "CONFIGURATION", help, (Field("value", WORD, reset=self.configuration),), more
        clear = "Writing 1 sets all counters to 0."
        hold = "Reading the velocity does not capture; the input capture still does."
        fields = [Field("clear", 1, 0, clear, writable=True, single=True), Field("hold", 1, 1, hold, writable=True)]
        fields += (
            Field(name, 1, place, help, writable=True, single=True, port=f"{name}_now")
            for place, (name, help) in enumerate(_CONTROLS.items(), 2)
            if name in self.spec.front_end.controls
        )
        yield "CONTROL", "What a driver may change.", tuple(fields), {}
        counters = (
            Field(name, COUNTER_WIDTH, place * COUNTER_WIDTH, f"{help} It stays at {(1 << COUNTER_WIDTH) - 1}.")
            for place, (name, help) in enumerate(self.counted.items())
        )
        yield "COUNTERS", "What went wrong since reset or CONTROL.clear; not captured.", tuple(counters), {}

    def _captured(self) -> Iterable[Draft]:
        yield from self._window(self.ports, "", captures=True)

    def _window(self, ports: Iterable[Port], suffix: str, *, captures: bool) -> Iterable[Draft]:
        """Return captured registers of these ports, whose names have this end."""
        ports = tuple(ports)
        values = [port for port in ports if port.width > 1]
        for port in values:
            words = range(0, port.width, WORD)
            for word in words:
                name = port.name.upper() + ("_HIGH" if word else "_LOW" if len(words) > 1 else "")
                low = "" if len(words) == 1 else "Upper word. " if word else "Lower word. "
                field = Field(
                    "value", WORD, help=port.help, signed=port.signed, unit=port.unit, port=port.name, shift=word
                )
                first = port is values[0] and not word
                yield name, f"{low}{port.help}", (field,), {"captured": True, "captures": first and captures}
            if port is values[0]:
                flags = tuple(self._flags(ports, suffix))
                yield f"STATUS{suffix}", "Flags of what was captured.", flags, {"captured": True}

    def _placing(self) -> Iterable[Draft]:
        """Return what the position is set to, and by how much the place within a modulus is moved."""
        spec = self.spec
        if spec.preset is not None:
            help = "Position that the input preset, or CONTROL.preset, sets."
            yield from position_words("PRESET", help, "preset_value", spec.position_width, spec.preset)
        if spec.encoder.zero is not None:
            help = "Position of the encoder that is 0, from the next tick on. To make the position N, write ZERO + "
            help += "POSITION - N."
            yield from position_words("ZERO", help, "zero", spec.position_width, spec.encoder.zero)
        if (modulus := spec.front_end.shifted_modulus) is not None:
            help = "Counts by which position_modulo is ahead of counts since reset, or since an index that resets."
            most = int(modulus) - 1
            more: dict[str, Any] = {"unit": "counts", "bits": most.bit_length(), "least": 0, "most": most}
            field = Field("value", WORD, help=help, writable=True, port="modulo_offset", **more)
            yield "MODULO_OFFSET", help, (field,), {}

    def _added(self) -> Iterable[Draft]:
        """Return what a design around the core adds."""
        return ()

    def _interrupting(self) -> Iterable[Draft]:
        """Return registers of the interrupt: an event has the same bit in each of them."""
        kinds: tuple[tuple[str, str, str, dict[str, Any]], ...] = (
            ("INTERRUPTS", "Events that wait. One that comes while it is cleared waits on.", "pending", {}),
            ("INTERRUPT_ENABLE", "Events that raise irq.", "enable", {"writable": True}),
            ("INTERRUPT_CLEAR", "Writing 1 clears an event.", "clear", {"writable": True, "single": True}),
        )
        for register, help, kind, more in kinds if self.irq else ():
            fields = (
                Field(event, 1, place, meaning, port=f"irq_{kind}_{event}", **more)
                for place, (event, meaning) in enumerate(self.interrupts.items())
            )
            yield register, help, tuple(fields), {}

    def _flags(self, ports: Iterable[Port], suffix: str) -> Iterable[Field]:
        events = {f"updated{suffix}": "There was an update of the velocity since the capture before."}
        events[f"indexed{suffix}"] = "There was an index since the capture before."
        events[WIDE] = "z was wider than a period since the capture before, so the index is at two places."
        events[MISSED] = "z came and went without the state of --index-at since the capture before."
        flags = [(name, help) for name, help in events.items() if name in self.events]
        flags += [(port.name, port.help) for port in ports if port.width == 1]
        for place, (name, help) in enumerate(flags):
            yield Field(name, 1, place, help, port="" if name in events else name)
