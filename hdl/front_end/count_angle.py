"""The electrical angle of a count, exact for ever."""

from amaranth import Const, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import only_if
from tachometry.spec.formats.angles import Angles


class CountAngle(wiring.Component):
    """floor(2^N·P·n/C) and half an LSB of the shown angle: a sum of n counts, and a remainder whose carry is one more.

    A step in clock c is in `angle` from clock c + 1 on. With a zero in clock c, n is 0 after the count of that clock;
    `angle` follows from clock c + 2 on.

    Parameters
    ----------
    corrects : bool
        Later zeros only correct: one is taken if the angle was within 1/16 of a turn of it, or equal to that of the
        zero before; else it is refused.
    """

    def __init__(self, angles: Angles, *, corrects: bool = False) -> None:
        self._angles, self._corrects = angles, corrects
        super().__init__(
            {
                "step": In(signed(2)),
                "zero": In(1),
                **only_if(corrects, anew=In(1), refused=Out(1)),  # of a `zero` that is taken whatever the angle is
                "clears": Out(1),  # n is 0 in the next clock but for the step of this one
                "angle": Out(angles.bits, init=angles.zero),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        counts, origin = self._angles.counts, self._angles.zero
        quotient, remainder = self._angles.count
        zero, rest, back = Signal(), Signal(range(counts)), self.step[1]
        m.d.sync += zero.eq(self.zero)
        clears = self.clears
        m.d.comb += clears.eq(zero)
        if self._corrects:
            # No two counts of a turn have the same bits here.
            place = self.angle[-max(counts.bit_length(), 4) :]
            anew, before, top = Signal(), Signal.like(place, init=0), place[-4:]
            m.d.sync += anew.eq(self.anew)
            m.d.comb += [
                clears.eq(zero & (anew | ~top.any() | top.all() | (place == before))),
                self.refused.eq(zero & ~clears),
            ]
            with m.If(zero):
                m.d.sync += before.eq(place)
        angle, left, move = Mux(clears, origin, self.angle), Mux(clears, 0, rest), Const(quotient, len(self.angle))
        up, down = Signal(range(2 * counts)), Signal(signed(counts.bit_length() + 1))
        carry = Mux(back, ~(down < 0), up >= counts)
        m.d.comb += [up.eq(left + remainder), down.eq(left - remainder)]
        m.d.sync += [
            self.angle.eq(angle + Mux(self.step[0], move ^ back.replicate(len(move)), 0) + (self.step[0] & carry)),
            rest.eq(left),
        ]
        with m.If(self.step[0]):
            m.d.sync += rest.eq(Mux(back, Mux(down < 0, down + counts, down), Mux(up >= counts, up - counts, up)))
        return m
