"""The positions of all axes at their index lines."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import data, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.axes.axis_counters import of_slot
from tachometry.hdl.wires.delay import delay


class AxisIndex(wiring.Component):
    """Captures the position of an axis when its index line Z rises.

    It adds up all steps once more: the positions of the datapath are those of ticks.

    Latency: a rise that is seen in a slot is at the outputs four clocks later.

    Parameters
    ----------
    axes, slots : int
    width : int
        Bits of a position.

    Members
    -------
    slot : In(range(slots))
    ready : In(1)
        Of this round, see `Rounds`.
    level_z : In(axes)
        Levels in this clock, bit k of axis k.
    step : In(signed(2))
        Of the slot three clocks ago.
    axis : Out(range(slots))
        Of the other outputs.
    index_valid : Out(1)
        One clock per rise.
    index_position : Out(signed(width))
        Sum of the steps of this axis.
    """

    def __init__(self, *, axes: int, slots: int, width: int) -> None:
        self._slots = slots
        super().__init__(
            {
                "slot": In(range(slots)),
                "ready": In(1),
                "level_z": In(axes),
                "step": In(signed(2)),
                "axis": Out(range(slots)),
                "index_valid": Out(1),
                "index_position": Out(signed(width)),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        kept = data.StructLayout({"z": 1, "position": self.index_position.shape()})
        m.submodules.memory = memory = Memory(shape=kept, depth=self._slots, init=[])
        read = memory.read_port()
        write = memory.write_port()
        level, slot, ready = delay(m, of_slot(self.level_z, self.slot), self.slot, self.ready)
        m.d.comb += read.addr.eq(slot)
        level, slot, ready = delay(m, level, slot, ready, clocks=2)
        # Block RAM is slow.
        before = Signal(kept)
        m.d.sync += before.eq(read.data)
        z = Signal()
        m.d.sync += [
            z.eq(level),
            self.axis.eq(slot),
            self.index_valid.eq(ready & level & ~before.z),
            # The memory is not that of a reset.
            self.index_position.eq(Mux(ready, before.position, 0) + self.step),
        ]
        m.d.comb += [
            write.addr.eq(self.axis),
            write.data.z.eq(z),
            write.data.position.eq(self.index_position),
            write.en.eq(1),
        ]
        return m
