"""1/m as quotient and remainder, for long measurements."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.spec.formats import carried_reciprocal


class CarriedReciprocal(wiring.Component):
    """Q = ⌊C/m⌋ and R = C mod m, exactly: from a small table, and beyond it carried from m to m + 1 by subtraction.

    When it moves, m may count up by one, start over at 1, or go on at `entry`; it may do so in every clock. Why one
    correction is enough is shown in spec/formats/carried_reciprocal.py.

    Latency: the answer is there in the clock after `moves`, and stays until the clock after the next.

    Parameters
    ----------
    reciprocal : spec.carried_reciprocal.CarriedReciprocal

    Members
    -------
    m : In(range(max_m + 1))
    moves : In(1)
        This is the last clock with this m, which is answered.
    q : Out(quotient_width)
    r : Out(remainder_width)
    """

    def __init__(self, reciprocal: carried_reciprocal.CarriedReciprocal) -> None:
        self._reciprocal = reciprocal
        super().__init__(
            {
                "m": In(range(reciprocal.max_m + 1)),
                "moves": In(1),
                "q": Out(reciprocal.quotient_width),
                "r": Out(reciprocal.remainder_width),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._reciprocal
        m.submodules.table = memory = Memory(shape=spec.width, depth=spec.depth, init=spec.table)
        read = memory.read_port()
        address_bits = (spec.depth - 1).bit_length()
        m.d.comb += [read.addr.eq(self.m[:address_bits]), read.en.eq(self.moves)]

        # Only presets are ever used without a step from a preset before them.
        q = Signal(spec.carried_quotient_width, reset_less=True)
        r = Signal(spec.remainder_width, reset_less=True)
        carried = Signal()
        less = Signal(signed(spec.remainder_width + 1))
        m.d.comb += less.eq(r - q)
        with m.If(self.moves):
            m.d.sync += [
                carried.eq(self.m[address_bits:].any()),
                q.eq(q - less[-1]),
                r.eq(less + Mux(less[-1], self.m, 0)),
            ]
            for preset, (quotient, remainder) in sorted(spec.presets.items()):
                with m.If(self.m == preset):
                    m.d.sync += [q.eq(quotient), r.eq(remainder)]
        table_q, table_r = read.data[: spec.quotient_width], read.data[spec.quotient_width :]
        m.d.comb += [self.q.eq(Mux(carried, q, table_q)), self.r.eq(Mux(carried, r, table_r))]
        return m
