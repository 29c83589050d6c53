"""The registers of a core."""

from collections.abc import Iterable
from functools import reduce
from operator import or_

from amaranth import Cat, Const, Module, Mux, Shape, Signal, Value, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.bus.counter import SaturatingCounter
from tachometry.hdl.bus.native import native_port
from tachometry.hdl.wires.ports import Box, by_name
from tachometry.spec.language.field import WORD, Field, Register
from tachometry.spec.registers.map import COUNTER_WIDTH, RegisterMap

_DEEPEST = 128  # terms of an expression


class RegisterBank(Box):
    """Registers as `RegisterMap` lists them, on a native port.

    A capture takes in one clock all that the core shows in it. It is made by `capture`, and by reading the first
    captured register, whose answer, a clock later, is what has just been captured.
    """

    def __init__(self, registers: RegisterMap) -> None:
        self._map = registers
        super().__init__(
            {
                "bus": In(native_port(registers.address_width - 2)),
                "capture": In(1),  # captures in every clock in which it is high
                "clear": Out(1),  # the counters are being cleared
                # The captured ports of the core; `position` is that of the latest tick.
                **{port.name: In(signed(port.width) if port.signed else port.width) for port in registers.ports},
                **{name: In(1) for name in (*registers.strobes, *registers.events.values(), "overflow")},
                "written": Out(1),  # a register is being written
                # Settings as they were written last; those that act once are high in the clock of the write.
                **{name: Out(shape, init=init) for name, (shape, init) in _shapes(registers.settings).items()},
                **{field.port: In(Shape(field.width, field.signed)) for field in registers.live},
            }
        )

    def build(self, m: Module) -> None:
        bus = self.bus
        here = {register.name: bus.address == number for number, register in enumerate(self._map)}
        writable = Cat(here[register.name] for register in self._map if register.writable).any()
        m.d.sync += bus.error.eq((bus.read & (bus.address >= len(self._map.registers))) | (bus.write & ~writable))
        m.d.comb += self.written.eq(bus.write & writable)
        hold = Signal()
        capture = self._control(m, here, hold)
        captured, lost = self._captured(m, capture)
        shown = {**captured, **self._counts(m, lost=lost), "clear": Const(0), "hold": hold, **self._settings(m, here)}
        shown |= by_name(self, (field.port for field in self._map.live))
        self._answer(m, shown)

    def _control(self, m: Module, here: dict[str, Value], hold: Signal) -> Signal:
        """Follow CONTROL; return whether all is captured in this clock."""
        bus = self.bus
        capture = Signal(name="captures")
        control = Signal()  # it is being written
        m.d.comb += [control.eq(bus.write & here["CONTROL"]), self.clear.eq(control & bus.write_data[0])]
        with m.If(control):
            m.d.sync += hold.eq(bus.write_data[1])
        (captures,) = (here[register.name] for register in self._map if register.captures)
        m.d.comb += capture.eq(self.capture | (bus.read & captures & ~hold))
        return capture

    def _captured(self, m: Module, capture: Signal) -> tuple[dict[str, Value], Value]:
        """Return what was captured, by names, and whether an update is lost: the one before it was not captured."""
        taken: dict[str, Value] = by_name(self, (port.name for port in self._map.ports))
        waiting = {flag: Signal(name=f"{flag}_waits") for flag in self._map.events}
        events = by_name(self, self._map.events.values())
        for flag, waits in waiting.items():
            taken[flag] = waits | events[self._map.events[flag]]
            m.d.sync += waits.eq(taken[flag] & ~capture)
        captured: dict[str, Value] = {
            name: Signal.like(Value.cast(value), name=f"captured_{name}", reset_less=False)
            for name, value in taken.items()
        }
        with m.If(capture):
            m.d.sync += [captured[name].eq(value) for name, value in taken.items()]
        return captured, waiting["updated"] & events[self._map.events["updated"]] if "updated" in waiting else Const(0)

    def _answer(self, m: Module, shown: dict[str, Value]) -> None:
        """Answer a read a clock later; an address without a register reads 0."""
        bus = self.bus
        # Which register was read is kept for a clock, not what it said.
        chosen = Signal(bus.address.shape(), init=(1 << len(bus.address)) - 1)
        m.d.sync += chosen.eq(Mux(bus.read, bus.address, -1))
        # A word of all selections, and not each where it is used, which compiled simulations would repeat for each bit.
        selected = Signal(len(self._map.registers))
        m.d.comb += selected.eq(Cat(chosen == number for number in range(len(selected))))
        answers = [
            _word(m, register, shown) & selects.replicate(WORD)
            for register, selects in zip(self._map, selected, strict=True)
        ]
        # Amaranth follows an expression by recursion, which must not be as deep as 64 axes have registers.
        parts = [reduce(or_, answers[first : first + _DEEPEST]) for first in range(0, len(answers), _DEEPEST)]
        m.d.comb += bus.read_data.eq(reduce(or_, parts))

    def _settings(self, m: Module, here: dict[str, Value]) -> dict[str, Value]:
        """Return the settings by their names, as they are read."""
        read: dict[str, Value] = {}
        settings = by_name(self, (field.port for field in self._map.settings))
        for register in self._map:
            for field in register.fields:
                if not (field.writable and field.port):
                    continue
                value, given = settings[field.port], self.bus.write_data[field.low : field.low + field.width]
                read[field.port] = Const(0) if field.single else value
                with m.If(self.bus.write & here[register.name]):
                    if field.single:
                        m.d.comb += value.eq(given)
                    else:
                        part = value[field.shift : field.shift + field.kept]
                        m.d.sync += part.eq(given if field.most is None else _held(m, field, given))
        return read

    def _counts(self, m: Module, *, lost: Value) -> dict[str, Value]:
        """Return the counters of COUNTERS by their names."""
        events = {"decode_errors": self.decode_error, "overflows": self.tick & self.overflow, "lost_updates": lost}
        if "tick_error" in self.signature.members:
            events["tick_errors"] = self.tick_error
        counts = {}
        for name in self._map.counted:
            m.submodules[name] = counter = SaturatingCounter(COUNTER_WIDTH)
            m.d.comb += [counter.event.eq(events[name]), counter.clear.eq(self.clear)]
            counts[name] = counter.count
        return counts


def _shapes(fields: Iterable[Field]) -> dict[str, tuple[Shape, int]]:
    """Return shapes and resets of the ports that fields set, some of them in two words, the upper one with the sign."""
    found: dict[str, tuple[Shape, int]] = {}
    for field in fields:
        _, init = found.get(field.port, (None, 0))
        found[field.port] = (Shape(field.shift + field.kept, field.signed), init | field.reset << field.shift)
    return found


def _held(m: Module, field: Field, given: Value) -> Value:
    """Return a written value, held within the limits of the field."""
    assert field.least is not None
    assert field.most is not None
    word = given.as_signed() if field.signed else given
    held = Signal(Shape(field.kept, field.signed), name=f"held_{field.port}")
    beyond = Mux(word > field.most, field.most, word)
    m.d.comb += held.eq(Mux(word < field.least, field.least, beyond) if field.signed else beyond)
    return held


def _word(m: Module, register: Register, shown: dict[str, Value]) -> Value:
    """Return what a register reads when its fields show this."""
    word = Signal(WORD, name=register.name.lower())
    for field in register.fields:
        if register.constant:
            value: Value = Const(field.reset, field.width)
        else:
            value = shown[field.port or field.name]
        # The upper or only word of a value is extended by its sign.
        part = value[field.shift : field.shift + WORD] if len(value) > field.shift + WORD else value >> field.shift
        m.d.comb += word[field.low : field.low + field.width].eq(part)
    return word
