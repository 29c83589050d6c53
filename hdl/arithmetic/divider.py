"""A quotient, bit by bit."""

from amaranth import Cat, Const, Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class Divider(wiring.Component):
    """Signed serial divider, non-restoring: the quotient rounded down, ⌊2^s · dividend / divisor⌋.

    In each step the divisor is taken from the doubled remainder, or added if that is negative; so it stays within
    −divisor … divisor − 1. The signs that it passes through, inverted but for the first, are the digits of the quotient
    in two's complement: Σ ±2^i is their weighted sum, and the last one is the correction to a remainder that is not
    negative. A counter shows when the last digit has come. It ends from any state, unlike a marker among the digits.

    Latency: `done` is high as many clocks after `start` as the quotient has bits; a `start` before `done`, or together
    with it, begins the next division.

    Parameters
    ----------
    divisor_width : int
    integer_bits : int
        Of the quotient, without its sign: |dividend| < 2^integer_bits · divisor.
    scale_bits : int
        s.

    Members
    -------
    start : In(1)
    dividend : In(signed(divisor_width + integer_bits + 1))
    divisor : In(divisor_width)
        Positive; both are valid with `start`.
    busy : Out(1)
        A division is under way or done in this clock.
    done : Out(1)
    quotient : Out(signed(integer_bits + scale_bits + 1))
        Valid with `done`.
    by : Out(divisor_width)
        The divisor, held until the next start.
    """

    def __init__(self, *, divisor_width: int, integer_bits: int, scale_bits: int) -> None:
        self._integer_bits = integer_bits
        self._steps = integer_bits + scale_bits
        super().__init__(
            {
                "start": In(1),
                "dividend": In(signed(divisor_width + integer_bits + 1)),
                "divisor": In(divisor_width),
                "busy": Out(1),
                "done": Out(1),
                "quotient": Out(signed(self._steps + 1)),
                "by": Out(divisor_width),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        # Only the flags of work in progress need a reset; all else is loaded before it is used.
        running = Signal()
        steps = Signal(signed((self._steps - 1).bit_length() + 1), reset_less=True)  # counts down to −1
        remainder = Signal(signed(len(self.by) + 1), reset_less=True)
        left = Signal(self._integer_bits, reset_less=True)
        digits = Signal(self._steps, reset_less=True)
        by = Signal.like(self.by, reset_less=True)
        negative = remainder[-1]
        m.d.comb += [
            self.by.eq(by),
            self.done.eq(running & steps[-1]),
            self.busy.eq(running),
            self.quotient.eq(Cat(~negative, digits[:-1], ~digits[-1])),
        ]
        # 2·remainder ± by with one adder: −by is ~by + 1, and the 1 comes from an additional bit at the adder's end.
        term = Cat(by, Const(0)) ^ (~negative).replicate(len(by) + 1)
        total = Cat(1, left[-1], remainder).as_signed() + Cat(~negative, term).as_signed()
        with m.If(running):
            m.d.sync += [
                remainder.eq(total >> 1),
                left.eq(left << 1),
                steps.eq(steps - 1),
                digits.eq(Cat(~negative, digits)),
            ]
        with m.If(self.done):
            m.d.sync += running.eq(0)
        with m.If(self.start):
            m.d.sync += [
                running.eq(1),
                Cat(left, remainder).eq(self.dividend),
                steps.eq(self._steps - 1),
                by.eq(self.divisor),
            ]
        return m
