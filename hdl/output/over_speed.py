"""A speed that must not be."""

from amaranth import Module, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class OverSpeed(wiring.Component):
    """Trips when a velocity is beyond a limit, and stays so.

    Latency: an update in clock c that is beyond trips in clock c + 1.

    Parameters
    ----------
    limit : int
        The greatest magnitude that does not trip.
    width : int
        Bits of the velocity.

    Members
    -------
    velocity_valid : In(1)
    velocity : In(signed(width))
    clear : In(1)
        It has not tripped in the next clock.
    beyond : Out(1)
        This velocity is beyond the limit.
    over_speed : Out(1)
    """

    def __init__(self, limit: int, width: int) -> None:
        self._limit = limit
        flags = {"velocity_valid": In(1), "clear": In(1), "beyond": Out(1), "over_speed": Out(1)}
        super().__init__({"velocity": In(signed(width)), **flags})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        above, below = self.velocity > self._limit, self.velocity < -self._limit
        m.d.comb += self.beyond.eq(self.velocity_valid & (above | below))
        with m.If(self.beyond):
            m.d.sync += self.over_speed.eq(1)
        with m.If(self.clear):
            m.d.sync += self.over_speed.eq(0)
        return m
