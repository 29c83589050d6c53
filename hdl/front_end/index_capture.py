"""A register keeps the position at the index."""

from amaranth import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay


class IndexCapture(wiring.Component):
    """Captures the position when the index line Z rises.

    Latency: if `level_z` rises in clock c, `index_valid` is high in clock c + `latency`, and `index_position` is the
    sum of all steps through clock c. `position` has this value in that clock, unless the index sets it to 0.

    Parameters
    ----------
    width : int
        Bits of the position.
    latency : int
        That of the position, at least 2.

    Members
    -------
    level_z : In(1)
    ready : In(1)
        The level before the present one is real.
    position : In(signed(width))
        The position of the next clock.
    rises : Out(1)
        High a clock before `index_valid`.
    index_position : Out(signed(width))
        Held until the next index.
    index_valid : Out(1)
        One clock per index.
    """

    def __init__(self, width: int, latency: int = 2) -> None:
        self._latency = latency
        super().__init__(
            {
                "level_z": In(1),
                "ready": In(1),
                "position": In(signed(width)),
                "rises": Out(1),
                "index_position": Out(signed(width)),
                "index_valid": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        level, ready = delay(m, self.level_z, self.ready, clocks=self._latency - 2)
        past_z = Signal()
        m.d.sync += [past_z.eq(level), self.rises.eq(level & ~past_z & ready), self.index_valid.eq(self.rises)]
        with m.If(self.rises):
            m.d.sync += self.index_position.eq(self.position)
        return m
