"""Position within a part of a revolution."""

import math
from fractions import Fraction

from amaranth import Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box


class ModuloCounter(Box):
    """Counts the steps since the latest multiple of N, rounded up to a whole count.

    Latency: that of `PositionCounter`.

    - `modulus`: N, at least 2. If it is not whole, every part has N rounded down or up.
    """

    def __init__(self, modulus: Fraction | int, latency: int = 2) -> None:
        self._modulus, self._latency = modulus, latency
        super().__init__(
            step=In(signed(2)),
            clear=In(1),  # the count is 0 in the next clock, whatever has been counted
            count=Out(range(math.ceil(modulus))),
        )

    def build(self, m: Module) -> None:
        (late,) = delay(m, self.step, clocks=self._latency - 1)
        ends = Signal()
        counts, parts = self._modulus.as_integer_ratio()
        last = self._last(m, late[1], late[0] & ends) if parts > 1 else counts - 1
        m.d.comb += ends.eq(self.count == Mux(late[1], 0, last))
        with m.If(late[0]):
            m.d.sync += self.count.eq(Mux(ends, Mux(late[1], last, 0), self.count + late))
        with m.If(self.clear):
            m.d.sync += self.count.eq(0)

    def _last(self, m: Module, back: Value, ends: Value) -> Value:
        """Return the last count of the present part, or backward of the part before it; `ends` leaves the part."""
        parts = self._modulus.denominator
        counts, more = divmod(self._modulus.numerator, parts)
        rest = Signal(range(parts))  # count 0 is so much ahead of the multiple of N, in 1/parts
        moved = Mux(back, rest + more, rest - more)
        wraps = Mux(back, moved >= parts, moved < 0)
        with m.If(ends):
            m.d.sync += rest.eq(moved + Mux(wraps, Mux(back, -parts, parts), 0))
        with m.If(self.clear):
            m.d.sync += rest.eq(0)
        return counts - 1 + wraps
