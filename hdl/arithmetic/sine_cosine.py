"""Sine and cosine of an angle."""

from amaranth import Array, C, Cat, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.spec.formats.sine import GUARD_BITS, START, STEPS, TURNS, WIDTH


class SineCosine(wiring.Component):
    """Takes an angle, in 2^-16 turns, in clock 0 after reset and in each `STEPS` clocks.

    Latency: `STEPS` + 1 clocks.
    """

    def __init__(self) -> None:
        super().__init__({"angle": In(16), "sin": Out(signed(16)), "cos": Out(signed(16))})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        step = Signal(range(STEPS))
        x, y, rest = (Signal(signed(WIDTH), name=name) for name in ("x", "y", "rest"))
        quadrant = Signal(2)
        turned = Signal(WIDTH)
        # Half of a quadrant more, so that the rest is within an eighth of a turn; step 0 turns it by one.
        m.d.comb += turned.eq((self.angle << WIDTH - 16) + (1 << WIDTH - 3))
        turn = Array(C(turn, WIDTH) for turn in TURNS)[step]
        back = rest[-1]
        # CXXRTL has no shift of a signed number by an unsigned one.
        of_x, of_y = ((Cat(word, word[-1].replicate(STEPS)) >> step)[:WIDTH] for word in (x, y))
        m.d.sync += [
            step.eq(step + 1),
            x.eq(Mux(back, x + of_y, x - of_y)),
            y.eq(Mux(back, y - of_x, y + of_x)),
            rest.eq(Mux(back, rest + turn, rest - turn)),
        ]
        cosine, sine = ((word + (1 << GUARD_BITS - 1)) >> GUARD_BITS for word in (x, y))
        one, other = Mux(quadrant[0], sine, cosine), Mux(quadrant[0], cosine, sine)
        with m.If(step == 0):
            first = turned[: WIDTH - 2].as_signed()
            m.d.sync += [
                x.eq(START),
                y.eq(Mux(first < 0, START, -START)),
                rest.eq(first),
                quadrant.eq(turned[-2:]),
                self.cos.eq(Mux(quadrant[0] ^ quadrant[1], -one, one)),
                self.sin.eq(Mux(quadrant[1], -other, other)),
            ]
        return m
