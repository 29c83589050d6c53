"""Sine and cosine of an angle."""

from amaranth import Array, C, Cat, Module, Mux, Signal, signed
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec.formats.sine import ASIDE, FACTOR_SHIFT, GUARD_BITS, ONE, QUARTER, START, STEPS, TURNS, WIDTH


class SineCosine(Box):
    """Takes an angle, in 2^-16 turns, in clock 0 after reset and in each `STEPS` clocks.

    Latency: `STEPS` + 1 clocks.
    """

    def __init__(self) -> None:
        super().__init__({"angle": In(16), "sin": Out(signed(16)), "cos": Out(signed(16))})

    def build(self, m: Module) -> None:
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


class SineTable(Box):
    """Does the same by a table of a quarter turn: half of the clocks are for the sine, the others for the cosine.

    To an entry is added what the place in it, times the other function, is; bit by bit.
    """

    def __init__(self) -> None:
        super().__init__({"angle": In(16), "sin": Out(signed(16)), "cos": Out(signed(16))})

    def build(self, m: Module) -> None:
        m.submodules.table = table = Memory(shape=ONE.bit_length(), depth=len(QUARTER), init=QUARTER)
        read = table.read_port()
        clock = Signal(range(STEPS), init=STEPS - 1)
        held = Signal(16)
        quadrant, place, aside = held[14:], held[4:14], held[:4]
        cosine, step = clock[3], clock[:3]
        mirrored = cosine ^ quadrant[0]
        minus = quadrant[1] ^ (cosine & quadrant[0])
        # Bits of how far the angle is aside of the entry, of the second clock on, and whether it is below it.
        far = Array(C(abs(one) << 2, 8) for one in ASIDE)[aside]
        below = ~aside[3] ^ mirrored ^ minus
        entry = Signal(ONE.bit_length())
        more = Signal(signed(10))
        sine = Signal(signed(16))
        factor = read.data[FACTOR_SHIFT:] & far.bit_select(step, 1).replicate(len(read.data) - FACTOR_SHIFT)
        total = Signal(signed(16))
        m.d.comb += [
            read.addr.eq(place ^ (mirrored ^ (step != 0)).replicate(len(place))),
            total.eq((entry ^ minus.replicate(16)) + minus + (more >> 3)),
        ]
        m.d.sync += [clock.eq(clock + 1), more.eq(Mux(below, more - factor, more + factor) >> 1)]
        with m.If(step == 1):
            m.d.sync += [entry.eq(read.data), more.eq(128)]
        with m.If(step == 7):
            m.d.sync += sine.eq(total)
            with m.If(cosine):
                m.d.sync += [held.eq(self.angle), self.sin.eq(sine), self.cos.eq(total)]
