"""A register keeps the position at the latest tick."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box


class TickPosition(Box):
    """Keeps `position` of the clock of the latest tick, that of a tick in this clock included.

    Latency: none. Where `open_sum` is the sum of all steps since, and nothing sets the position to 0, a subtraction
    gives it without a register.

    - `sum_width`: Bits of `open_sum`; 0 if there is none, and a register keeps the position.
    """

    def __init__(self, width: int, sum_width: int = 0) -> None:
        self._sum_width = sum_width
        position = signed(width)
        inputs = {}
        if sum_width:
            # The position of the next clock, and the sum of the steps in it after the latest tick.
            inputs = {"next": In(position), "open_sum": In(signed(sum_width))}
        super().__init__({"tick": In(1), "position": In(position), **inputs, "latest": Out(position)})

    def build(self, m: Module) -> None:
        if self._sum_width:
            m.d.comb += self.latest.eq(self.next - self.open_sum)
        else:
            kept = Signal.like(self.position)
            m.d.comb += self.latest.eq(Mux(self.tick, self.position, kept))
            m.d.sync += kept.eq(self.latest)
