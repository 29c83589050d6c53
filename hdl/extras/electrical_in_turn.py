"""Gates of `spec.core.extras.electrical.AngleInTurn`."""

from typing import Self

from amaranth import Array, C, Module, Mux, Signal, signed
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.products import take_products
from tachometry.hdl.extras.electrical import counted_on, phase_products
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box
from tachometry.spec import AxesSpec
from tachometry.spec.core.extras.electrical import AngleInTurn
from tachometry.spec.formats.angles import PLACE_BITS, SHOWN_BITS


class Gates(Box):
    """Adds up the angles of the counts of all axes in a memory, and carries that of one on when it is shown.

    With `tick` the outputs of the datapath are those of `axis`, until the next one.
    """

    def __init__(self, extra: AngleInTurn, spec: AxesSpec) -> None:
        axis = spec.axis
        self._extra, self._angles = extra, extra.angles(axis)
        self._late = [spec.at(number).late for number in range(spec.axes)]  # clocks from edges to `angle`
        taken = {one.name: one.width for one in axis.method_ports if one.name in ("acceleration", "position_fine")}
        taken |= {"position": axis.position_width, "native_velocity": axis.velocity.native}
        super().__init__(
            {
                "ready": In(1),  # of the slot, see `AxisIndex`
                "slot": In(range(spec.slots)),  # three clocks later, as `step` and `complete`
                "step": In(signed(2)),
                "complete": In(1),
                "index_rises": In(1),  # four clocks later
                "tick": In(1),
                "axis": In(range(spec.slots)),
                **{name: In(signed(width)) for name, width in taken.items()},
                "shows": Out(1),  # a clock in which `angle` is new
                "angle": Out(SHOWN_BITS),
                "angle_valid": Out(1),
            }
        )

    @classmethod
    def of(cls, extra: AngleInTurn, spec: AxesSpec) -> Self:
        return cls(extra, spec)

    def build(self, m: Module) -> None:
        angles, extra = self._angles, self._extra
        at, known = self._count(m)
        fine_bits = angles.position_fine_bits
        between = Signal(signed(fine_bits + PLACE_BITS))
        m.d.comb += between.eq(self.position_fine - (self.position << fine_bits))
        update = between, self.native_velocity, self.acceleration
        ends = [late + extra.ahead for late in self._late]
        middles = [(end >> 1) - late for end, late in zip(ends, self._late, strict=True)]
        bits = angles.factor_bits
        times = (Array(C(one, signed(bits)) for one in each)[self.axis] for each in (ends, middles))
        products = phase_products(angles, update, at, tuple(times))
        done, _, start = take_products(m, self.tick, products, bits, angles.bits, block=angles.block)
        m.d.sync += self.shows.eq(done)
        with m.If(done):
            m.d.sync += [self.angle.eq(start[-SHOWN_BITS:] + extra.offset), self.angle_valid.eq(known)]

    def _count(self, m: Module) -> tuple[Signal, Signal]:
        """Add up the steps of all axes; return the angle of `axis` in its tick, and whether there was an index."""
        angles, extra = self._angles, self._extra
        kept = data.StructLayout({"angle": angles.bits, "rest": range(angles.counts), "known": 1})
        m.submodules.state = state = Memory(shape=kept, depth=extra.slots, init=[])
        shown = data.StructLayout({"angle": angles.bits, "known": 1})
        m.submodules.handed = handed = Memory(shape=shown, depth=extra.slots, init=[])
        read = state.read_port()
        write = state.write_port()
        (ready,) = delay(m, self.ready, clocks=5)
        step, complete, slot = delay(m, self.step, self.complete, self.slot, clocks=2)
        (rises,) = delay(m, self.index_rises)
        before = Signal(kept)
        after = Signal(kept)
        zeroes = rises | ~ready  # the memory is not that of a reset
        moved, rest = counted_on(angles, step, before.angle, before.rest)
        m.d.sync += [
            before.eq(read.data),
            after.angle.eq(Mux(zeroes, angles.of(0), moved)),
            after.rest.eq(Mux(zeroes, 0, rest)),
            after.known.eq(rises | (ready & before.known)),
        ]
        complete, slot = delay(m, complete, slot)
        hands = handed.write_port()
        has = handed.read_port()
        m.d.comb += [
            read.addr.eq(self.slot),
            write.addr.eq(slot),
            write.data.eq(after),
            write.en.eq(1),
            hands.addr.eq(slot),
            hands.data.angle.eq(after.angle),
            hands.data.known.eq(after.known),
            hands.en.eq(complete),
            has.addr.eq(self.axis),
        ]
        return has.data.angle, has.data.known
