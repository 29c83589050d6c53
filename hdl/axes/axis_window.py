"""The window of a measurement, for an axis whose state is in a memory."""

from amaranth import Module, Mux, signed
from amaranth.lib import data
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box


class AxisWindow(Box):
    """Does the work of `AlterationDetector` and `IntervalAccumulator`; their registers come in and go out. No latency.

    - `max_ticks`, `kept_ticks`: Longest window, and what a forced update leaves of it.
    """

    def __init__(
        self, *, max_ticks: int, kept_ticks: int, count_width: int, numerator_width: int, cancel: bool
    ) -> None:
        self._max_ticks, self._kept_ticks, self._cancel = max_ticks, kept_ticks, cancel
        count = signed(count_width)
        state = data.StructLayout(
            {
                "previous": count,  # m_e(i−1)
                "offset": count,  # of the last tick that did not alter
                "opening": count,  # of the tick that opened the window
                "m_s": range(max_ticks + 1),  # length of the window
                "rests": 1,
                "nearly": 1,  # the window before was silent
            }
        )
        super().__init__(
            clears=In(1),  # the next state is that of a reset
            state=In(state),
            m_e=In(count),  # of this tick; 0 with `clears`
            next=Out(state),
            numerator=Out(signed(numerator_width)),
            update=Out(1),  # the window closes
            forced=Out(1),  # it closes without an alteration
        )

    def build(self, m: Module) -> None:
        state, after, m_e = self.state, self.next, self.m_e
        alteration = (m_e != state.previous) & (m_e != state.offset) & ~self.clears
        longest = state.m_s == self._max_ticks
        silent = ~m_e.any()
        d1 = m_e - state.previous
        restarts = alteration | self.clears
        goes_on = Mux(longest, self._kept_ticks + 1, state.m_s + 1)
        m.d.comb += [
            self.update.eq((alteration | longest) & ~self.clears),
            self.forced.eq(longest & ~restarts),
            self.numerator.eq(state.opening - state.previous + d1 if self._cancel else d1),
            after.previous.eq(m_e),
            after.offset.eq(Mux(alteration, state.offset, m_e)),
            after.opening.eq(Mux(alteration | longest | self.clears, m_e, state.opening)),
            after.m_s.eq(Mux(restarts, 1, goes_on)),
            after.nearly.eq(self.forced & silent),
            after.rests.eq(
                silent
                & ~self.clears
                & (state.rests | state.nearly | (longest & ~(state.opening | state.previous).any()))
            ),
        ]
