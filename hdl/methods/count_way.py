"""Which way a count leads."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class CountWay(wiring.Component):
    """The way from the edge of the last count to that of a count; two counts of opposite sign are from one edge.

    It looks a clock ahead, so that all comes from registers, and distances can be added at once.

    Parameters
    ----------
    reversals : bool
        Whether a count of the other sign leads nowhere.

    Members
    -------
    step_before : In(signed(2))
        The step of the next clock.
    was_negative : In(1)
        The sign of the last count before this clock.
    step : Out(signed(2))
        −1, 0 or +1.
    moves, forward, backward : Out(1)
        This step leads to another edge; in this direction.
    """

    def __init__(self, *, reversals: bool) -> None:
        self._reversals = reversals
        super().__init__(
            {
                "step_before": In(signed(2)),
                "was_negative": In(1),
                "step": Out(signed(2)),
                "moves": Out(1),
                "forward": Out(1),
                "backward": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        # Bit 0 of a step tells that it is one, bit 1 its sign.
        counts, negative = self.step_before
        last = Mux(self.step[0], self.step[1], self.was_negative)
        leads = Signal()
        m.d.comb += leads.eq(counts & (negative == last if self._reversals else 1))
        m.d.sync += [
            self.step.eq(self.step_before),
            self.moves.eq(leads),
            self.forward.eq(leads & ~negative),
            self.backward.eq(leads & negative),
        ]
        return m
