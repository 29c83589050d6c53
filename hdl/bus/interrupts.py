"""Events wait until they are cleared, and raise an interrupt if they are enabled."""

from functools import reduce
from operator import or_

from amaranth import Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box, by_name, follow
from tachometry.spec.registers.map import RegisterMap

_KINDS = {
    "enable": In(1),  # the event raises `irq`
    "clear": In(1),
    "pending": Out(1),  # it waits, from the clock after it on
}


class Interrupts(Box):
    """Keeps events for a program; one that comes in the clock in which it is cleared waits on."""

    def __init__(self, registers: RegisterMap, axes: int = 1) -> None:
        self._events = [*registers.interrupts]
        super().__init__(
            **{event: In(1) for event in self._events if event != "stall"},
            **{f"irq_{kind}_{event}": flow for kind, flow in _KINDS.items() for event in self._events},
            ticks=In(axes),
            standstill=In(axes),  # the shaft of the axis stands still
            irq=Out(1),  # an enabled event waits, a clock later
        )

    def build(self, m: Module) -> None:
        rested = Signal.like(self.standstill)  # at the latest tick of each axis
        m.d.sync += rested.eq((self.standstill & self.ticks) | (rested & ~self.ticks))
        stall = (self.standstill & self.ticks & ~rested).any()
        raised: list[Value] = []
        comes = {"stall": stall} | by_name(self, (event for event in self._events if event != "stall"))
        enable, clear, pending = (by_name(self, self._events, f"irq_{kind}_{{}}") for kind in _KINDS)
        for event in self._events:
            m.d.sync += pending[event].eq(comes[event] | (pending[event] & ~clear[event]))
            raised.append(pending[event] & enable[event])
        m.d.sync += self.irq.eq(reduce(or_, raised))


def connect(m: Module, box: Interrupts, bank: wiring.Component, core: wiring.Component) -> None:
    """Connect what a bank and a core of one axis or many have by the names of the box, and its output."""
    m.submodules.interrupts = box
    flows = {name: member.flow for name, member in box.signature.members.items() if name.startswith("irq_")}
    follow(m, box, bank, (name for name, flow in flows.items() if flow == In))
    follow(m, bank, box, (name for name, flow in flows.items() if flow == Out))
    late = [core.tick_error] if "tick_error" in core.signature.members else []
    m.d.comb += [box.overflow.eq(core.tick & bank.overflow), box.error.eq(reduce(or_, late, core.decode_error))]
    if "index" in box.signature.members:
        m.d.comb += box.index.eq(core.index_valid)
