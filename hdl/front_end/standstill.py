"""Detector of a shaft that rests."""

from amaranth import EnableInserter, Module, Mux, ResetInserter, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.front_end.sampling_clock import SamplingClock
from tachometry.hdl.wires.ports import Box, only_if


class Standstill(Box):
    """Reports rest when the ticks in a row that counted nothing are together longer than `max_ticks` nominal ones.

    The tick before the first one counts as empty. Latency: none.

    - `count_width`: Bits of m_e, whose least number, without an opposite, never comes.
    - `max_shift`: A tick may be as long as 2^max_shift nominal ones.
    """

    def __init__(self, max_ticks: int, count_width: int, *, max_shift: int = 0) -> None:
        self._max_ticks = max_ticks
        super().__init__(
            tick=In(1),
            m_e=In(signed(count_width)),  # valid with `tick`
            **only_if(max_shift, shift=In(range(max_shift + 1))),  # with `tick`: it is 2^shift nominal ones
            standstill=Out(1),  # from `tick` on, until the next
        )

    def build(self, m: Module) -> None:
        differs = "shift" in self.signature.members
        shown = Signal()
        silent = ~self.m_e[:-1].any()  # only the least number has nothing but its sign
        if differs:
            # Nominal ticks that may still be empty, those of this tick among them; negative, if none may. So a sign is
            # the flag, and nothing has to be compared.
            most = self._max_ticks
            left = Signal(signed(most.bit_length() + 1), init=most - 1)
            less = Signal.like(left)
            m.d.comb += less.eq(left - (1 << self.shift))
            none = silent & (shown | less[-1])
            with m.If(self.tick):
                m.d.sync += left.eq(Mux(silent, Mux(less[-1], left, less), most))
        else:
            # Ticks are counted one later than m_e, so that a count does what reset does.
            was_silent = Signal(init=1)
            ticks = SamplingClock(self._max_ticks)
            m.submodules.ticks = ResetInserter(self.tick & ~was_silent)(EnableInserter(self.tick)(ticks))
            none = silent & was_silent & (shown | ticks.last)
            with m.If(self.tick):
                m.d.sync += was_silent.eq(silent)
        m.d.comb += self.standstill.eq(Mux(self.tick, none, shown))
        m.d.sync += shown.eq(self.standstill)
