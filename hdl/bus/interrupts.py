"""Events wait until they are cleared, and raise an interrupt if they are enabled."""

from functools import reduce
from operator import or_

from amaranth import Cat, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.spec.registers.map import RegisterMap


class Interrupts(wiring.Component):
    """Keeps events for a program; one that comes in the clock in which it is cleared waits on."""

    def __init__(self, registers: RegisterMap, axes: int = 1) -> None:
        self._events = [*registers.interrupts]
        kinds = {
            "enable": In(1),  # the event raises `irq`
            "clear": In(1),
            "pending": Out(1),  # it waits, from the clock after it on
        }
        super().__init__(
            {
                **{event: In(1) for event in self._events if event != "stall"},
                **{f"irq_{kind}_{event}": flow for kind, flow in kinds.items() for event in self._events},
                "ticks": In(axes),
                "stalled": In(axes),  # the shaft of the axis stands still
                "irq": Out(1),  # an enabled event waits, a clock later
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        rested = Signal.like(self.stalled)  # at the latest tick of each axis
        m.d.sync += rested.eq((self.stalled & self.ticks) | (rested & ~self.ticks))
        stall = (self.stalled & self.ticks & ~rested).any()
        raised: list[Value] = []
        for event in self._events:
            enable, clear, pending = (getattr(self, f"irq_{kind}_{event}") for kind in ("enable", "clear", "pending"))
            comes = stall if event == "stall" else getattr(self, event)
            m.d.sync += pending.eq(comes | (pending & ~clear))
            raised.append(pending & enable)
        m.d.sync += self.irq.eq(reduce(or_, raised))
        return m


def connect(m: Module, box: Interrupts, bank: wiring.Component, core: wiring.Component) -> None:
    """Connect what a bank and a core of one axis or many have by the names of the box, and its output."""
    m.submodules.interrupts = box
    for name, member in box.signature.members.items():
        if name.startswith("irq_"):
            source, target = (box, bank) if member.flow == Out else (bank, box)
            m.d.comb += getattr(target, name).eq(getattr(source, name))
    late = [core.tick_error] if hasattr(core, "tick_error") else []
    m.d.comb += [box.overflow.eq(core.tick & bank.overflow), box.error.eq(reduce(or_, late, core.decode_error))]
    if hasattr(box, "probe"):
        strobes = [name for name in core.signature.members if name.startswith("probe_valid")]
        m.d.comb += box.probe.eq(Cat(getattr(core, name) for name in strobes).any())
    if hasattr(box, "index"):
        m.d.comb += box.index.eq(core.index_valid)
