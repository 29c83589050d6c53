"""Whether the shaft rests."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class Standstill(wiring.Component):
    """Reports rest when the ticks in a row that counted nothing are together longer than `max_ticks` nominal ones.

    The tick before the first one counts as empty. Latency: none.

    Parameters
    ----------
    max_ticks : int
    count_width : int
        Bits of m_e.
    max_shift : int
        A tick may be as long as 2^max_shift nominal ones.

    Members
    -------
    tick : In(1)
    m_e : In(signed(count_width))
        Valid with `tick`.
    shift : In(range(max_shift + 1))
        Only if `max_shift` is not 0: this tick is 2^shift nominal ones; valid with `tick`.
    stalled : Out(1)
        From `tick` on, until the next.
    """

    def __init__(self, max_ticks: int, count_width: int, *, max_shift: int = 0) -> None:
        self._max_ticks = max_ticks
        super().__init__(
            {
                "tick": In(1),
                "m_e": In(signed(count_width)),
                **({"shift": In(range(max_shift + 1))} if max_shift else {}),
                "stalled": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        shown = Signal()
        # Nominal ticks that may be empty after this one; negative, if this one must not be. So a sign is the flag, and
        # nothing has to be compared. Where the length of a tick comes with it, its own ticks are still among them.
        differs = "shift" in self.signature.members
        most = self._max_ticks if differs else self._max_ticks - 1
        left = Signal(signed(most.bit_length() + 1), init=most - 1)
        less = Signal.like(left)
        silent = ~self.m_e.any()
        none = less[-1] if differs else left[-1]
        m.d.comb += [
            less.eq(left - (1 << self.shift if differs else 1)),
            self.stalled.eq(Mux(self.tick, silent & (shown | none), shown)),
        ]
        m.d.sync += shown.eq(self.stalled)
        with m.If(self.tick & ~none):
            m.d.sync += left.eq(less)
        with m.If(self.tick & ~silent):
            m.d.sync += left.eq(most)
        return m
