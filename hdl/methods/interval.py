"""The window of a measurement: its length and the pulse numbers at its ends."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class IntervalAccumulator(wiring.Component):
    """Follows the window from its opening tick a to the present tick i, m_s = i − a.

    Inside a window every m_e but the first and the last is the same number, m_e(i−1): that is what "no alteration"
    means. So the sum of eq. (21) of Tsuji 2009 needs no accumulator:

        ω = m_e(i−1) + (d0 + d1)/(2·m_s),   d0 = m_e(a) − m_e(i−1),   d1 = m_e(i) − m_e(i−1)

    and eq. (17) is m_e(i−1) + d1/m_s. After an alteration the next window opens at that tick. At `max_ticks` the update
    is forced, and the window keeps its newer half. Without latency.

    Parameters
    ----------
    max_ticks, kept_ticks : int
        Longest window, and what a forced update leaves of it.
    count_width, numerator_width : int
        Bits of m_e and of the numerator.
    cancel : bool
        Eq. (21) instead of eq. (17).

    Members
    -------
    tick, alteration : In(1)
    m_e, previous : In(signed(count_width))
        m_e(i) and m_e(i−1), valid with `tick`.
    m_s : Out(range(max_ticks + 1))
        Length of the window in ticks; as all outputs valid with `tick`.
    numerator : Out(signed(numerator_width))
        d0 + d1, or d1.
    update : Out(1)
        The window closes.
    forced : Out(1)
        The window closes without an alteration.
    stalled : Out(1)
        Nothing was counted in more than `max_ticks` ticks in a row; from `tick` on, until the next.

    Raises
    ------
    ValueError
        If `max_ticks` is less than 2.
    """

    def __init__(
        self, *, max_ticks: int, kept_ticks: int, count_width: int, numerator_width: int, cancel: bool
    ) -> None:
        if max_ticks < 2:
            raise ValueError(f"max_ticks must be at least 2, not {max_ticks}")
        self._max_ticks = max_ticks
        self._kept_ticks = kept_ticks
        self._cancel = cancel
        super().__init__(
            {
                "tick": In(1),
                "alteration": In(1),
                "m_e": In(signed(count_width)),
                "previous": In(signed(count_width)),
                "m_s": Out(range(max_ticks + 1), init=1),
                "numerator": Out(signed(numerator_width)),
                "update": Out(1),
                "forced": Out(1),
                "stalled": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        opening = Signal.like(self.m_e)
        silent = ~self.m_e.any()
        rests = Signal()
        nearly = Signal()  # the last tick ended a longest window, in which only the opening tick had a count
        longest = Signal()
        after_forced = self._kept_ticks + 1
        d1 = self.m_e - self.previous
        m.d.comb += [
            self.update.eq(self.tick & (self.alteration | longest)),
            self.forced.eq(longest & ~self.alteration),
            # A longest window without an alteration goes on as it began, but for its opening tick; and a silence begins
            # in the tick that opens a window, or in the one after it.
            self.stalled.eq(
                Mux(self.tick, silent & (rests | nearly | (longest & ~(opening | self.previous).any())), rests)
            ),
            self.numerator.eq(opening - self.previous + d1 if self._cancel else d1),
        ]
        m.d.sync += rests.eq(self.stalled)
        with m.If(self.tick):
            m.d.sync += nearly.eq(self.forced & silent)
            m.d.sync += [self.m_s.eq(self.m_s + 1), longest.eq(self.m_s == self._max_ticks - 1)]
            with m.If(longest):
                m.d.sync += [self.m_s.eq(after_forced), longest.eq(after_forced == self._max_ticks)]
            with m.If(self.alteration):
                m.d.sync += [self.m_s.eq(1), longest.eq(0)]
            with m.If(self.update):
                # After a forced update the kept half opens with the number that the window ends with.
                m.d.sync += opening.eq(self.m_e)
        return m
