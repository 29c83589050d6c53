"""When the pulse number alters."""

from amaranth import Module, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box


class AlterationDetector(Box):
    """Pulse alteration of Tsuji 2009, Sec. V-A: an occasional pulse upon a constant offset, Fig. 4(c).

    A tick alters when m_e(i) differs from m_e(i−1) and from b, the pulse number of the last tick that did not alter.
    So the 4 in 3 3 4 3 3 is one alteration and the return to 3 is none. Before the first tick m_e and b are 0.

    Latency: `alteration` is there with `tick`, a clock after m_e.

    - `seldom`: `tick` and `coming` are never high together.
    """

    def __init__(self, count_width: int, *, seldom: bool = False) -> None:
        self._seldom = seldom
        shape = signed(count_width)
        super().__init__(
            coming=In(1),  # `tick` follows
            tick=In(1),
            next_count=In(shape),  # m_e(i), valid with `coming`
            pulse_count=In(shape),  # the last m_e whose `tick` has come; valid with `coming` and with `tick`
            alteration=Out(1),  # from `tick` on, until the next
        )

    def build(self, m: Module) -> None:
        offset = Signal.like(self.pulse_count)
        regular = self.tick & ~self.alteration  # b is the number of this tick
        with m.If(regular):
            m.d.sync += offset.eq(self.pulse_count)
        differs = self.next_count != offset
        if not self._seldom:
            differs |= regular
        with m.If(self.coming):
            m.d.sync += self.alteration.eq((self.next_count != self.pulse_count) & differs)
