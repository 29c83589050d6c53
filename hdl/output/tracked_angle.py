"""The place of a tracking core as an electrical angle, carried on to every clock."""

from amaranth import C, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.products import Multiplier, Product
from tachometry.hdl.output.debt import owed
from tachometry.spec.formats.angles import LEAD_BITS, PLACE_BITS, SLOPE_BITS, Carried, Factor


class TrackedAngle(wiring.Component):
    """A phase that grows by its slope in each clock, and begins anew `Carried.clocks` clocks after each update.

    The difference of a new phase to the old one is owed, and paid in an eighth of a tick, so the angle never steps.
    The first phase owes nothing.

    Parameters
    ----------
    velocity_width, acceleration_width : int
        Bits of the velocity and of the acceleration.
    """

    def __init__(self, carried: Carried, velocity_width: int, acceleration_width: int) -> None:
        self._carried = carried
        bits, place = carried.angles.bits, carried.tracked.position_fine_bits + PLACE_BITS
        self._curve = Signal(signed(max(acceleration_width + carried.acceleration.shift, 2)))
        factors = (
            (place, carried.fine),
            (velocity_width, carried.velocity),
            (acceleration_width, carried.acceleration),
        )
        terms = (width + factor.shift for width, factor in factors)
        wide = max(*terms, len(self._curve) + carried.factor_bits - SLOPE_BITS, bits + 1)
        self._multiplier = Multiplier(wide, carried.factor_bits, bits, carried.tracked.block)
        super().__init__(
            {
                "at": In(bits),  # the angle of the counts at the end of the tick; like the next three from `update` on
                "fine": In(signed(place)),
                "velocity": In(signed(velocity_width)),
                "acceleration": In(signed(acceleration_width)),
                "update": In(1),
                "ahead": In(LEAD_BITS),  # clocks, with `update`
                "angle": Out(bits),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        carried, curve = self._carried, self._curve
        bits, half = carried.angles.bits, carried.angles.tick >> 1
        s, target = Signal(carried.factor_bits), Signal(bits)
        slope, now = Signal(signed(bits)), Signal(signed(bits))
        bent = curve << carried.factor_bits - SLOPE_BITS
        begins, done, start = self._multiplier.take(
            m,
            self.update,
            (
                Product(_term(self.acceleration, carried.acceleration), carried.acceleration.number, C(0), curve),
                Product(_term(self.velocity, carried.velocity), carried.velocity.number, C(0), slope),
                Product(bent, s + (half - carried.late), slope, now),
                Product(bent, (s >> 1) - carried.late, slope, slope),
                Product(_term(self.fine, carried.fine), carried.fine.number, self.at, target),
                Product(slope, s, target, None),
            ),
        )
        with m.If(begins):
            m.d.sync += s.eq(self.ahead + carried.span)
        phase, run, grows, begun = Signal(bits), Signal(bits), Signal(signed(bits)), Signal()
        debt = owed(m, carried.angles, done, (run - start)[:bits])
        m.d.comb += [run.eq(phase + grows), self.angle.eq(phase + debt)]
        m.d.sync += phase.eq(Mux(done, start, run))
        with m.If(done):
            m.d.sync += [grows.eq(now), begun.eq(1)]
            with m.If(~begun):
                m.d.sync += debt.eq(0)
        return m


def _term(value: Value, factor: Factor) -> Value:
    return value << factor.shift if factor.shift >= 0 else value >> -factor.shift
