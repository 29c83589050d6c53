"""Position within so many counts."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay


class ModuloCounter(wiring.Component):
    """Adds up all steps modulo N, from 0 to N - 1.

    Latency: that of `PositionCounter`.

    - `modulus`: N, at least 2.
    """

    def __init__(self, modulus: int, latency: int = 2) -> None:
        self._modulus = modulus
        self._latency = latency
        super().__init__(
            {
                "step": In(signed(2)),
                "clear": In(1),  # the count is 0 in the next clock, whatever has been counted
                "count": Out(range(modulus)),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        (late,) = delay(m, self.step, clocks=self._latency - 1)
        ends = Signal()
        m.d.comb += ends.eq(self.count == Mux(late[1], 0, self._modulus - 1))
        with m.If(late[0]):
            m.d.sync += self.count.eq(Mux(ends, Mux(late[1], self._modulus - 1, 0), self.count + late))
        with m.If(self.clear):
            m.d.sync += self.count.eq(0)
        return m
