"""Golden registers answer accesses from what the core shows."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tachometry.sim import golden
from tachometry.sim.golden import extras
from tachometry.sim.golden.front_end import MOST_FILTERED, decoded, homed
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec.language.field import WORD, Field, Register
from tachometry.spec.language.port import INDEX, MISSED, TICK, UPDATE, WHOLE, WIDE
from tachometry.spec.registers.map import COUNTER_WIDTH, RegisterMap


@dataclass(frozen=True)
class Access:
    """Is one clock of the native port."""

    clock: int
    address: int  # of the word
    data: int | None = None  # what is written; None: the access reads


def initial(registers: RegisterMap) -> dict[str, int]:
    """Return settings after a reset, by their ports."""
    found = dict.fromkeys((field.port for field in registers.settings), 0)
    for field in registers.settings:
        found[field.port] |= field.reset << field.shift
    return found


def written(field: Field, data: int, before: int) -> int:
    """Return a setting after a word was written to one of its fields."""
    value = data >> field.low & (1 << field.width) - 1
    if field.most is not None and field.least is not None:
        value = value - (1 << WORD) if field.signed and value >> (WORD - 1) else value
        value = max(field.least, min(value, field.most))
    value &= (1 << field.kept) - 1
    if field.signed and value >> (field.kept - 1):
        value -= 1 << field.kept
    below = (1 << field.shift) - 1
    # The lower word of two leaves the upper one as it is.
    above = 0 if field.shift or field.signed or field.bits else before >> WORD << WORD
    return value << field.shift | before & below | above


def rises(clock: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return the clocks in which a level rises, which is low before the first."""
    high = level != 0
    return clock[high & ~np.append(False, high[:-1])]


class GoldenBank:
    """Answers for the bank of a core whose pins are driven so; of a demo, from a restart on, with all settings 0."""

    def __init__(self, registers: RegisterMap, trace: PinTrace) -> None:
        self._map = registers
        # Flags, which have no unit, are 0 before the first update.
        self._of_updates = {
            port.name
            for port in registers.ports
            if port.held_by in (UPDATE, WHOLE) and port.unit and port.name != "velocity"
        }
        self._trace = trace.completed(registers.spec)
        self._pins = self._steps = decoded(registers.spec, self._trace)
        self._tables = golden.tables(registers.spec, self._trace, self._steps)
        spec = registers.spec  # the strobe of a whole update has the velocity as well
        self._strobes = tuple(name for name in spec.ports.strobes if name != UPDATE or spec.whole == UPDATE)
        self._updated = self._tables[spec.whole].clock
        self._happened = {"updated": self._updated, "indexed": self._tables[INDEX].clock}
        self._happened |= {name: self._tables[name].clock for name in (WIDE, MISSED)}
        self._follow(self._tables[TICK].overflow)
        stalls = self._tables[registers.spec.facts.rests_with]
        self._stalls = rises(stalls.clock, stalls.standstill)

    def _follow(self, overflow: np.ndarray) -> None:
        """Find the clocks of what is counted; `overflow` is a column of the ticks."""
        strobes = {
            "decode_errors": self._tables["decode_error"].clock,
            "overflows": self._tables[TICK].clock[overflow],
            **({"tick_errors": self._tables["tick_error"].clock} if "tick_error" in self._tables else {}),
        }
        self._events = {name: clocks for name, clocks in strobes.items() if name in self._map.counted}

    def answers(self, accesses: Sequence[Access], captures: Iterable[int] = ()) -> list[tuple[int | None, bool]]:
        """Return data and error of each access, in the order of their clocks; `captures` are clocks of the input
        `capture`.

        None stands for data that are not defined: what belongs to an update, the velocity aside, before the first.
        """
        registers = self._map.registers
        (capturing,) = (number for number, register in enumerate(registers) if register.captures)
        self._captured: dict[str, int] = {}
        self._known = False
        self._captures: list[int] = []
        self._cleared, hold = -1, 0
        self._settings = initial(self._map)
        self._changed = 0
        self._irq = {event: [0] for event in self._map.interrupts}  # since which clocks events count
        left = sorted(captures)
        self._ask(accesses)
        self._act(accesses)
        found: list[tuple[int | None, bool]] = []
        for access in accesses:
            while left and left[0] <= access.clock:
                self._capture(left.pop(0))
            register = registers[access.address] if access.address < len(registers) else None
            if access.data is not None:
                if register is not None and register.name == "CONTROL":
                    hold = access.data >> 1 & 1
                    self._cleared = access.clock if access.data & 1 else self._cleared
                elif register is not None and register.writable:
                    self._set(register, access.data, access.clock)
                found.append((0, register is None or not register.writable))
                continue
            if access.address == capturing and not hold:
                self._capture(access.clock)
            found.append((0 if register is None else self._read(access, hold), register is None))
        return found

    def _ask(self, accesses: Sequence[Access]) -> None:
        """Find what the core shows if a program sets the position, lets the index through, and writes offsets."""
        spec = self._map.spec
        if not spec.front_end.controls and spec.modulus is None and spec.encoder.zero is None:
            return
        written_at = self._written(accesses)
        pins = self._pins
        if pins.reads is not None:
            ends = self._tables[TICK].clock - spec.latency.tick + spec.latency.place
            zero = self._held("zero", spec.encoder.zero or 0, ends - 1)
            pins = replace(pins, reads=replace(pins.reads, zero=zero))
        ahead = spec.latency.place - 1
        clocks = {
            name: np.union1d(of_pins, np.array([at for at, _ in written_at[f"{name}_now"]], dtype=np.int64) - ahead)
            for name, of_pins in (("preset", pins.presets), ("home", pins.arms))
        }
        values = self._held("preset_value", spec.preset or 0, clocks["preset"] + ahead)
        self._steps = pins.asked(spec, clocks["preset"], values, clocks["home"])
        self._tables = golden.tables(spec, self._trace, self._steps)
        if (modulus := spec.front_end.shifted_modulus) is not None:
            ticks = self._tables[TICK]
            moved = (ticks.position_modulo + self._held("modulo_offset", 0, ticks.clock)) % int(modulus)
            self._tables[TICK] = ticks.having(position_modulo=moved)
        self._happened["indexed"] = self._tables[INDEX].clock

    def _written(self, accesses: Sequence[Access]) -> dict[str, list[tuple[int, int]]]:
        """Return the clocks of writes of what moves the position, by ports, and what the ports were then."""
        found: dict[str, list[tuple[int, int]]] = {
            name: [] for name in ("preset_now", "home_now", "preset_value", "modulo_offset", "zero")
        }
        self._writes = found
        settings = initial(self._map)
        for access in accesses:
            if access.data is None or access.address >= len(self._map.registers):
                continue
            for field in self._map.registers[access.address].fields:
                if field.port not in found or (field.single and not access.data >> field.low & 1):
                    continue
                settings[field.port] = written(field, access.data, settings[field.port])
                found[field.port].append((access.clock, settings[field.port]))
        return found

    def _held(self, port: str, first: int, clock: np.ndarray) -> np.ndarray:
        """Return what a setting was in these clocks: a write is seen in the next one."""
        at, values = zip(*((-1, first), *self._writes[port]), strict=True)
        found: np.ndarray = np.array(values, dtype=np.int64)[np.searchsorted(at, clock, side="left") - 1]
        return found

    def interrupts(self) -> dict[str, np.ndarray]:
        """Return clocks of the events that raise the interrupt."""
        errors = [self._tables[strobe].clock for strobe in ("decode_error", "tick_error") if strobe in self._tables]
        found: dict[str, np.ndarray] = {
            "index": self._tables[INDEX].clock if INDEX in self._tables else np.array([], dtype=np.int64),
            "overflow": self._events["overflows"],
            "stall": self._stalls,
            "error": np.unique(np.concatenate(errors)),
        }
        return {event: found[event] if event in found else self._tables[event].clock for event in self._map.interrupts}

    def irq(self, accesses: Iterable[Access], n_clocks: int) -> list[bool]:
        """Return the level of the interrupt in each clock."""
        written = {access.clock: (access.address, access.data) for access in accesses if access.data is not None}
        enabling, clearing = (self._map.registers.index(self._map[f"INTERRUPT_{name}"]) for name in ("ENABLE", "CLEAR"))
        comes = dict.fromkeys(range(n_clocks), 0)
        for place, clocks in enumerate(self.interrupts().values()):
            for clock in clocks.tolist():
                comes[clock] = comes.get(clock, 0) | 1 << place
        levels, waits, enabled, level = [], 0, 0, False
        for clock in range(n_clocks):
            levels.append(level)
            level = waits & enabled != 0
            address, data = written.get(clock, (None, 0))
            waits = comes[clock] | (waits & ~data if address == clearing else waits)
            enabled = data if address == enabling else enabled
        return levels

    def _set(self, register: Register, data: int, clock: int) -> None:
        """Write settings; those that act once stay 0."""
        self._changed = clock
        for field in register.fields:
            if register.name == "INTERRUPT_CLEAR" and data >> field.low & 1:
                self._irq[field.name].append(clock)
            if not field.single:
                self._settings[field.port] = written(field, data, self._settings[field.port])

    def _capture(self, clock: int) -> None:
        """Take what there is in a clock."""
        if self._captures and self._captures[-1] == clock:
            return
        before = self._captures[-1] if self._captures else -1
        taken: dict[str, int] = {}
        for strobe in self._strobes:
            table = self._tables[strobe]
            row = int(np.searchsorted(table.clock, clock, side="right")) - 1
            for name, column in table.columns.items():
                taken[name] = int(column[row]) if row >= 0 else 0
        taken |= {flag: int(self._count(clocks, before, clock) > 0) for flag, clocks in self._happened.items()}
        taken |= self._of_clock(clock)
        updates = self._updated
        self._known = clock >= updates[0] if len(updates) else False
        self._captured = taken
        self._captures.append(clock)

    def _of_clock(self, clock: int) -> dict[str, int]:
        """Return what a capture takes that is no row of a strobe."""
        ticks, updates = self._tables[TICK].clock, self._tables[UPDATE]
        caused = updates.cause[updates.clock <= clock]
        age = self._count(ticks, int(caused[-1]) if len(caused) else -1, clock)
        # The core is cleared in the clock after.
        glitches = self._count(self._pins.swallowed, self._cleared + 1, clock)
        return {
            "time": clock % (1 << WORD),
            "age": min(age, self._map.spec.timing.max_ticks),
            "filtered_edges": min(2 * glitches, MOST_FILTERED),
            **self._shown(extras.shown(self._map.spec, self._tables, np.array([clock]), self._cleared)),
            "homed": int(homed(self._map.spec, self._steps, np.array([clock]))[0]),
        }

    def _act(self, accesses: Sequence[Access]) -> None:
        """Find what extras show when a program writes what are inputs without a bus."""
        spec = self._map.spec
        added = {name for extra in spec.extras for name, *_ in extra.registers(spec)}
        fields = {field for name in added for field in self._map[name].fields}
        if not fields and not spec.extras:
            return
        control = self._map.registers.index(self._map["CONTROL"])
        clears = np.array([one.clock for one in accesses if one.address == control and (one.data or 0) & 1], np.int64)
        settings = dict(self._settings)
        changes = {field.port: {0: settings[field.port]} for field in fields}
        for access in accesses:
            if access.data is None or access.address >= len(self._map.registers):
                continue
            for field in fields.intersection(self._map.registers[access.address].fields):
                value = settings[field.port] = written(field, access.data, settings[field.port])
                acts = {access.clock: value, access.clock + 1: 0}
                changes[field.port] |= acts if field.single else {access.clock + 1: value}
        clock = np.union1d(self._trace.clock, [at for each in changes.values() for at in each]).astype(np.int64)
        lines = self._trace.at(clock) | {
            port: np.array([*each.values()])[np.searchsorted([*each], clock, side="right") - 1]
            for port, each in changes.items()
        }
        pins = PinTrace.of_lines(clock, self._trace.n_clocks, lines)
        if spec.displacement is not None or any(extra.exchanges for extra in spec.extras):
            kept = {name: one for name, one in self._tables[TICK].columns.items() if name == "position_modulo"}
            self._tables = golden.tables(spec, pins, self._steps)
            self._tables[TICK] = self._tables[TICK].having(**kept)
        self._tables |= extras.tables(extras.View(spec, pins, self._steps, self._tables, clears))

    @staticmethod
    def _shown(found: dict[str, np.ndarray]) -> dict[str, int]:
        return {name: int(column[0]) for name, column in found.items()}

    @staticmethod
    def _count(clocks: np.ndarray, after: int, until: int) -> int:
        """Return clocks in (after, until]."""
        return int(np.searchsorted(clocks, until, side="right") - np.searchsorted(clocks, after, side="right"))

    def _lost(self, until: int) -> int:
        """Return updates since the counters were cleared that came when one waited for a capture."""
        clocks = self._updated
        before = np.append(-1, clocks[:-1])
        captures = np.array([-1, *self._captures])
        latest = captures[np.searchsorted(captures, clocks) - 1]  # strictly before each
        lost = clocks[(before > latest) & (before >= 0)]
        return self._count(lost, self._cleared, until)

    def _read(self, access: Access, hold: int) -> int | None:
        register = self._map.registers[access.address]
        if self._captures and not self._known and {field.port for field in register.fields} & self._of_updates:
            return None
        shown = {"clear": 0, "hold": hold, "changed": self._changed, **self._settings, **self._captured}
        if register.name == "COUNTERS":
            shown |= {name: self._count(clocks, self._cleared, access.clock) for name, clocks in self._events.items()}
            shown["lost_updates"] = self._lost(access.clock)
            shown = {name: min(value, (1 << COUNTER_WIDTH) - 1) for name, value in shown.items()}
        if register.name == "INTERRUPTS":
            happened = self.interrupts()
            shown |= {
                f"irq_pending_{event}": int(self._count(happened[event], clears[-1] - 1, access.clock) > 0)
                for event, clears in self._irq.items()
            }
        word = 0
        for field in register.fields:
            value = field.reset if register.constant else shown.get(field.port or field.name, 0)
            word |= (value >> field.shift & (1 << field.width) - 1) << field.low
        return word & (1 << WORD) - 1
