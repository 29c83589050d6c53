"""The positions of all axes at their index lines."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box


class AxisIndex(Box):
    """Captures the position of an axis when its index line Z rises.

    It adds up all steps once more: the positions of the datapath are those of ticks.

    Latency: a rise that is seen in a slot is at the outputs four clocks later.
    """

    def __init__(self, *, slots: int, width: int, resets: bool) -> None:
        self._slots, self._resets = slots, resets
        super().__init__(
            slot=In(range(slots)),
            ready=In(1),  # of this round, see `Rounds`
            level_z=In(1),  # of the axis whose slot it is
            known=In(1),  # the levels of this round and of the one before are those of the line
            step=In(signed(2)),  # of the slot three clocks ago
            axis=Out(range(slots)),  # that the other outputs belong to
            index_valid=Out(1),  # one clock per rise
            index_position=Out(signed(width)),  # sum of the steps of this axis
            position=Out(signed(width)),  # the same, but 0 with a rise that resets
        )

    def build(self, m: Module) -> None:
        kept = data.StructLayout({"z": 1, "position": self.index_position.shape()})
        m.submodules.memory = memory = Memory(shape=kept, depth=self._slots, init=[])
        read = memory.read_port()
        write = memory.write_port()
        level, known, slot, ready = delay(m, self.level_z, self.known, self.slot, self.ready)
        m.d.comb += read.addr.eq(slot)
        level, known, slot, ready = delay(m, level, known, slot, ready, clocks=2)
        # Block RAM is slow.
        before = Signal(kept)
        m.d.sync += before.eq(read.data)
        z = Signal()
        m.d.sync += [
            z.eq(level),
            self.axis.eq(slot),
            self.index_valid.eq(known & level & ~before.z),
            # The memory is not that of a reset.
            self.index_position.eq(Mux(ready, before.position, 0) + self.step),
        ]
        m.d.comb += [
            self.position.eq(Mux(self.index_valid & int(self._resets), 0, self.index_position)),
            write.addr.eq(self.axis),
            write.data.z.eq(z),
            write.data.position.eq(self.position),
            write.en.eq(1),
        ]
