"""Rises of an input."""

from amaranth import Module, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box


class PinRise(Box):
    """Pulse when an input rises, or when a program asks for the same.

    Latency: if `level` rises in clock c, `rises` is high in clock c + `latency` - 1, in which the position takes the
    step of clock c. What is asked for is told at once.

    - `latency`: That of the position, at least 2.
    """

    def __init__(self, latency: int) -> None:
        self._latency = latency
        super().__init__(
            level=In(1),
            ready=In(1),  # the level before the present one is real
            asked=In(1),
            rises=Out(1),
        )

    def build(self, m: Module) -> None:
        level, ready = delay(m, self.level, self.ready, clocks=self._latency - 2)
        past = Signal()
        seen = Signal()
        m.d.sync += [past.eq(level), seen.eq(level & ~past & ready)]
        m.d.comb += self.rises.eq(seen | self.asked)
