"""When the pulse number alters."""

from amaranth import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class AlterationDetector(wiring.Component):
    """Pulse alteration of Tsuji 2009, Sec. V-A: an occasional pulse upon a constant offset, Fig. 4(c).

    A tick alters when m_e(i) differs from m_e(i−1) and from b, the pulse number of the last tick that did not alter.
    So the 4 in 3 3 4 3 3 is one alteration and the return to 3 is none. Before the first tick m_e and b are 0.
    Without latency.

    Parameters
    ----------
    count_width : int
        Bits of m_e.

    Members
    -------
    tick : In(1)
    m_e : In(signed(count_width))
        Valid with `tick`.
    previous : Out(signed(count_width))
        m_e(i−1).
    alteration : Out(1)
        Valid with `tick`.
    """

    def __init__(self, count_width: int) -> None:
        shape = signed(count_width)
        super().__init__({"tick": In(1), "m_e": In(shape), "previous": Out(shape), "alteration": Out(1)})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        offset = Signal.like(self.m_e)
        m.d.comb += self.alteration.eq((self.m_e != self.previous) & (self.m_e != offset))
        with m.If(self.tick):
            m.d.sync += self.previous.eq(self.m_e)
            with m.If(~self.alteration):
                m.d.sync += offset.eq(self.m_e)
        return m
