"""Gates of `spec.core.extras.over_speed`."""

from typing import Self

from amaranth import Module, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.over_speed import OverSpeed


class Gates(Box):
    """An update in clock c that is beyond the limit trips in clock c + 1; `beyond` is high in clock c.

    `clear` wins over an update in the same clock.
    """

    def __init__(self, limit: int, width: int) -> None:
        self._limit = limit
        flags = {"velocity_valid": In(1), "clear": In(1), "beyond": Out(1), "over_speed": Out(1)}
        super().__init__({"velocity": In(signed(width)), **flags})

    @classmethod
    def of(cls, extra: OverSpeed, spec: TachometerSpec) -> Self:
        return cls(extra.greatest(spec), spec.velocity.width)

    def build(self, m: Module) -> None:
        above, below = self.velocity > self._limit, self.velocity < -self._limit
        m.d.comb += self.beyond.eq(self.velocity_valid & (above | below))
        with m.If(self.beyond):
            m.d.sync += self.over_speed.eq(1)
        with m.If(self.clear):
            m.d.sync += self.over_speed.eq(0)
