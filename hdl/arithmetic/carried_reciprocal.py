"""1/m as quotient and remainder, for long measurements."""

from amaranth import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec.formats import carried_reciprocal


def _less_another(total: Signal, more: Value, q: Signal, borrow: Value) -> Value:
    """Return total + more − (q − borrow) with one carry: sums and carries of every bit first, which a LUT forms."""
    width = len(total)
    one, two, three = total, Cat(more, Const(0, width))[:width], ~Cat(q, Const(0, width))[:width]
    sums, carries = one ^ two ^ three, (one & two) | (one & three) | (two & three)
    # −q is ~q + 1; that 1 is the carry from an additional bit at the end, and the borrow has the place of no carry.
    return ((Cat(1, sums) + Cat(1, borrow, carries[:-1])) >> 1)[:width].as_signed()


class CarriedReciprocal(Box):
    """Gives Q = ⌊C/m⌋ and R = C mod m exactly: from a small table, and beyond it from m to m + 1 by subtraction.

    When it moves, m may count up by one, start over at 1, or go on at `entry`; it may do so in every clock. Why one
    correction is enough is shown in spec/formats/carried_reciprocal.py.

    Latency: the answer is there in the clock after `moves`, and stays until the clock after the next.
    """

    def __init__(self, reciprocal: carried_reciprocal.CarriedReciprocal) -> None:
        self._reciprocal = reciprocal
        super().__init__(
            m=In(range(reciprocal.max_m + 1)),
            moves=In(1),  # the last clock with this m, which is answered
            q=Out(reciprocal.quotient_width),
            r=Out(reciprocal.remainder_width),
        )

    def build(self, m: Module) -> None:
        spec = self._reciprocal
        m.submodules.table = memory = Memory(shape=spec.width, depth=spec.depth, init=spec.table)
        read = memory.read_port()
        address_bits = (spec.depth - 1).bit_length()
        m.d.comb += [read.addr.eq(self.m[:address_bits]), read.en.eq(self.moves)]

        # Only presets are ever used without a step from a preset before them.
        q = Signal(spec.carried_quotient_width, name="carried_q", reset_less=True)
        r = Signal(spec.remainder_width, reset_less=True)
        carried = Signal()
        # R − Q, of which the next step needs the sign first: it comes with Q and R, so that there is one carry a clock.
        less = Signal(signed(max(len(q), len(r)) + 1), reset_less=True)
        borrow = less[-1]
        corrected = Mux(borrow, self.m, 0)
        with m.If(self.moves):
            m.d.sync += [
                carried.eq(self.m[address_bits:].any()),
                q.eq(q - borrow),
                r.eq(less + corrected),
                less.eq(_less_another(less, corrected, q, borrow)),
            ]
            if spec.entry in spec.presets:
                quotient, remainder = spec.presets[spec.entry]
                with m.If(self.m == spec.entry):
                    m.d.sync += [q.eq(quotient), r.eq(remainder), less.eq(remainder - quotient)]
            quotient, remainder = spec.presets[spec.depth]
            with m.If(~self.m[address_bits:].any()):
                # So the step to where the table ends, which needs no borrow, has the right result.
                m.d.sync += [q.eq(quotient), less.eq(remainder)]
        table_q, table_r = read.data[: spec.quotient_width], read.data[spec.quotient_width :]
        m.d.comb += [self.q.eq(Mux(carried, q, table_q)), self.r.eq(Mux(carried, r, table_r))]
