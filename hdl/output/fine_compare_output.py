"""Pulses at positions between counts."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import data
from amaranth.lib.wiring import In

from tachometry.hdl.output.compare_output import Awaited, CompareOutput
from tachometry.hdl.output.velocity_output import SerialVelocityOutput
from tachometry.spec.core.compare import BACKWARD, Compare
from tachometry.spec.formats.carrying import FASTER_BITS, Carrying


class FineCompareOutput(CompareOutput):
    """Makes a pulse when `position_fine`, carried on with the velocity, reaches a position, and waits for the next one.

    A place that goes back because of an update makes no second pulse; one that leaps over several positions makes all
    their pulses. The place is that of the shaft at the pins in the first clock of the pulse.

    Parameters
    ----------
    width : int
        Bits of the position in counts.
    native_width : int
        Bits of `velocity`.

    Members
    -------
    valid, velocity, position_fine : In
        An update of the method, which stays until the next.
    tick : In(1)
    moves : In(1)
        The position of the next clock does not follow from counts: places that it leaps over have no pulses.
    """

    def __init__(self, compare: Compare, clocks: int, width: int, carrying: Carrying, native_width: int) -> None:
        self._carrying = carrying
        fine = width + carrying.position_fine_bits
        velocity, place = In(signed(native_width)), In(signed(fine))
        taken = {"valid": In(1), "velocity": velocity, "position_fine": place, "tick": In(1), "moves": In(1)}
        super().__init__(compare, clocks, fine, taken)

    def _awaited(self, m: Module, reached: Signal) -> Awaited:
        compare, carrying = self._compare, self._carrying
        layout = data.StructLayout({"velocity": signed(len(self.velocity) + carrying.shift)})
        m.submodules.per_clock = per_clock = SerialVelocityOutput(carrying.per_clock, layout)
        m.d.comb += [
            per_clock.updates.valid.eq(self.valid),
            per_clock.updates.p.velocity.eq(self.velocity << carrying.shift),
        ]
        new = per_clock.shown.p.velocity
        # It catches up.
        late = Signal(signed(len(self.position_fine) + carrying.more_bits))
        place = Signal.like(late)
        speed = Signal.like(new)
        catching = Signal(range(carrying.waits + carrying.adds + 1))
        loads = Signal()
        m.d.sync += [loads.eq(catching == 1), place.eq(Mux(loads, late, place + speed))]
        with m.If(per_clock.shown.valid):
            m.d.sync += [late.eq(self.position_fine << carrying.more_bits), catching.eq(carrying.waits + carrying.adds)]
        with m.Elif(catching.any()):
            m.d.sync += catching.eq(catching - 1)
            with m.If(catching <= carrying.adds):
                m.d.sync += late.eq(late + (new << FASTER_BITS))
        # What moved the position since the tick before is of the next tick, and of its update.
        moved = Signal()
        of_tick = Signal()
        of_update = Signal()
        m.d.sync += moved.eq(self.moves | (moved & ~self.tick))
        with m.If(self.tick):
            m.d.sync += of_tick.eq(moved)
        with m.If(self.valid):
            m.d.sync += of_update.eq(of_tick)
        awaited = Signal.like(self.position_fine, init=compare.in_lsb(compare.start, carrying.position_fine_bits))
        beyond = Signal.like(awaited)
        m.d.comb += beyond.eq((place >> carrying.more_bits) - awaited)
        ahead = beyond[-1] ^ (compare.direction == BACKWARD)
        armed = Signal()
        m.d.sync += armed.eq((armed | ahead) & ~(loads & of_update))
        with m.If(loads):
            m.d.sync += speed.eq(new)
        there = armed & ~ahead & (self.position_compare_count != compare.count if compare.count else 1)
        return awaited, there, [awaited.eq(awaited + compare.in_lsb(compare.apart, carrying.position_fine_bits))]
