"""From the native velocity to the one that the user wants: its unit, its LSB, its width.

Both boxes form ⌊(v·multiplier + 2^(shift−1)) / 2^shift⌋, which spec/formats/velocity_output.py shows to be within 0.7
LSB, and hold it within bounds. The multiplier is a constant, taken from its lowest bit; what falls below the point is
dropped on the way, which does not change the floor. The one adds v for a bit a clock, the other has an adder for each
digit of the multiplier's canonical form and takes any update rate.
"""

from typing import Any

from amaranth import Const, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.delay import delay
from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.spec.formats import velocity_output


class _VelocityOutput(wiring.Component):
    """What both share.

    Parameters
    ----------
    output : spec.velocity_output.VelocityOutput
    native_width : int
        Bits of v.
    tag_width : int
        Bits that travel along with a value.
    towards : int
        Round to the nearest (0), down (−1) or up (1).

    Members
    -------
    start : In(1)
        `native` and `tag` are new; they stay until the next.
    native, tag : In
    done : Out(1)
    velocity, velocity_overflow, tag_out : Out
        Valid with `done`, and held until the next.
    """

    def __init__(
        self, output: velocity_output.VelocityOutput, *, native_width: int, tag_width: int, towards: int = 0
    ) -> None:
        self._output = output
        self._rounding = output.rounding(towards)
        super().__init__(
            {
                "start": In(1),
                "native": In(signed(native_width)),
                "tag": In(tag_width),
                "done": Out(1),
                "velocity": Out(signed(output.port_width)),
                "velocity_overflow": Out(1),
                "tag_out": Out(tag_width),
            }
        )

    def _shown(self, m: Module, total: Value, tag: Value) -> list[Any]:
        """What lets the outputs take `total`."""
        rounded = Signal.like(total)
        m.d.comb += rounded.eq(total)
        velocity, overflow = rounded, Const(0)
        if self._output.limit < self._output.greatest:
            velocity, overflow = saturate(m, rounded, self._output.limit)
        return [self.velocity.eq(velocity), self.velocity_overflow.eq(overflow), self.tag_out.eq(tag)]


class SerialVelocityOutput(_VelocityOutput):
    """A bit of the multiplier a clock.

    Latency: `done` is high as many clocks after `start` as the multiplier has bits, and three more; `start` may come
    again then.
    """

    def elaborate(self, platform: object) -> Module:
        m = Module()
        output = self._output
        bits = output.multiplier.bit_length()
        running, rounding, complete = Signal(), Signal(), Signal()
        step = Signal(range(bits + 1), reset_less=True)
        bit = Signal(reset_less=True)
        total = Signal(signed(max(len(self.native), bits) + 1), reset_less=True)
        # The low bits of what rounds are there from the start, as bits of the product are dropped on the way.
        high, low = self._rounding >> bits, self._rounding & ((1 << bits) - 1)
        addend = Signal.like(self.native)
        m.d.comb += addend.eq(Mux(rounding, high, Mux(bit, self.native, 0)))
        m.d.sync += [
            step.eq(step + 1),
            bit.eq(Const(output.multiplier >> 1, bits + 1).bit_select(step, 1)),
            total.eq((total + addend) >> 1),
            rounding.eq(running & (step == bits - 1)),
            complete.eq(rounding),
        ]
        with m.If(rounding):
            m.d.sync += running.eq(0)
        with m.If(self.start):
            m.d.sync += [running.eq(1), step.eq(0), bit.eq(output.multiplier & 1), total.eq(low)]
        m.d.sync += self.done.eq(complete)
        shown = self._shown(m, total >> (output.shift - bits - 1), self.tag)
        with m.If(complete):
            m.d.sync += shown
        return m


class PipelinedVelocityOutput(_VelocityOutput):
    """An adder for every digit of the multiplier: `start` may be high in every clock.

    Latency: `done` is high a clock after `start` for every digit but the first, one to round (if anything is to be
    rounded), and one to hold.
    """

    def elaborate(self, platform: object) -> Module:
        m = Module()

        valid, native, tag = self.start, self.native, self.tag
        (place, sign), *others = self._output.digits
        low = self._rounding & ((1 << self._output.digits[-1][0]) - 1)
        width = max(len(native), low.bit_length()) + 2
        total: Value = (native if sign > 0 else -native) + low
        for next_place, digit in others:
            gap = next_place - place
            sum_ = total + (native << gap) if digit > 0 else total - (native << gap)
            valid, native, tag, total = delay(m, valid, native, tag, (sum_ >> gap)[:width].as_signed())
            place = next_place
        left = self._output.shift - place
        if left:
            valid, tag, total = delay(m, valid, tag, ((total + (self._rounding >> place)) >> left).as_signed())
        # As long as `native` and `tag` stay, so does what they become.
        m.d.sync += [self.done.eq(valid), *self._shown(m, total, tag)]
        return m
