"""Counts and their velocity as an electrical angle that is new in every clock."""

from amaranth import C, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.products import Multiplier, Product
from tachometry.hdl.output.debt import owed
from tachometry.spec.formats.angles import LEAD_BITS, Counted


class CountedAngle(wiring.Component):
    """After a count the place is at its edge; it grows by the slope of the velocity, to the next edge at most.

    What a count, a zero or an update moves the phase by is owed, and paid in an eighth of a tick. An update that comes
    while the one before is multiplied waits for that; the latest of several is taken.

    Parameters
    ----------
    velocity_width : int
        Bits of the velocity.
    """

    def __init__(self, counted: Counted, velocity_width: int) -> None:
        self._counted = counted
        bits = counted.angles.bits
        wide = max(velocity_width + counted.velocity.shift, bits + 1)
        self._multiplier = Multiplier(wide, counted.factor_bits, bits, counted.block)
        super().__init__(
            {
                "at": In(bits),  # the angle of the counts in this clock
                "step": In(signed(2)),  # in `at` from the next clock on
                "moves": In(1),  # something else moves `at` in the next clock
                "velocity": In(signed(velocity_width)),  # from `update` on
                "update": In(1),
                "ahead": In(LEAD_BITS),  # clocks, with `update`
                "angle": Out(bits),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        counted, half = self._counted, self._counted.half
        bits = counted.angles.bits
        s, slope = Signal(counted.factor_bits), Signal(signed(bits))
        shift = counted.velocity.shift
        term = self.velocity << shift if shift >= 0 else self.velocity >> -shift
        products = (Product(term, counted.velocity.number, C(0), slope), Product(slope, s, C(0), None))
        begins, done, far = self._multiplier.take(m, self.update, products)
        with m.If(begins):
            m.d.sync += s.eq(self.ahead + counted.late)
        near = half.bit_length() + 1
        grows, place, ahead = Signal(signed(near)), Signal(signed(near)), Signal(bits)
        with m.If(done):
            m.d.sync += [grows.eq(_held(slope, half)), ahead.eq(far)]
        m.d.sync += place.eq(_held(place + grows, half))
        with m.If(self.step[0]):
            m.d.sync += place.eq(Mux(self.step[1], half, -half))
        phase, coming, moved = Signal(bits), Signal(bits), Signal()
        m.d.comb += coming.eq(self.at + place + ahead)
        m.d.sync += [phase.eq(coming), moved.eq(done | self.step[0] | self.moves)]
        debt = owed(m, counted.angles, moved, (phase - coming)[:bits])
        m.d.comb += self.angle.eq(phase + debt)
        return m


def _held(value: Value, most: int) -> Value:
    return Mux(value > most, most, Mux(value < -most, -most, value))
