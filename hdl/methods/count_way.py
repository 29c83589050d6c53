"""Which way a count leads."""

from amaranth import Module, Mux, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec.formats.displacement import Displacement


class CountWay(Box):
    """The way from the edge of the last count to that of a count; two counts of opposite sign are from one edge.

    It looks a clock ahead, so that all comes from registers, and distances can be added at once. Where the velocity
    decays, the way is that of a count and a half. With a `displacement`, that of the count before is taken
    off each count.

    - `decays`, `reversals`: Whether there are decays, and whether a count of the other sign leads nowhere.
    """

    def __init__(self, half: int, *, decays: bool, reversals: bool, displacement: Displacement | None = None) -> None:
        self._half, self._decays, self._reversals = half, decays, reversals
        self._low = 0 if displacement is None else displacement.low + 1
        most = 3 * half if displacement is None else 3 * half + 2 * displacement.most
        super().__init__(
            step_before=In(signed(2)),  # the step of the next clock
            decays_before=In(1),  # in the next clock, without a step, the velocity may decay
            negative_before=In(1),  # and is negative
            moves_before=Out(1),  # the step of the next clock leads to another edge
            **({} if displacement is None else {"displaced_before": In(signed(displacement.width))}),
            way=Out(signed(most.bit_length() + 1)),
            negative=Out(1),  # the sign of the last count up to this clock
        )

    def build(self, m: Module) -> None:
        # Bit 0 of a step tells that it is one, bit 1 its sign.
        counts, negative = self.step_before
        m.d.comb += self.moves_before.eq(counts & (negative == self.negative if self._reversals else 1))
        way = Mux(self.moves_before, Mux(negative, -2 * self._half, 2 * self._half), 0)
        m.d.sync += self.way.eq(way)
        if self._low:
            with m.If(counts):
                m.d.sync += self.way.eq(way - (self.displaced_before << self._low))
        if self._decays:
            with m.If(self.decays_before):
                m.d.sync += self.way.eq(Mux(self.negative_before, -3 * self._half, 3 * self._half))
        with m.If(counts):
            m.d.sync += self.negative.eq(negative)
