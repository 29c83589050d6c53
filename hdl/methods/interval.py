"""The window of a measurement: its length and the pulse numbers at its ends."""

from amaranth import Const, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box


class IntervalAccumulator(Box):
    """Follows the window from its opening tick a to the present tick i, m_s = i − a.

    Inside a window every m_e but the first and the last is the same number, m_e(i−1): that is what "no alteration"
    means. So the sum of eq. (21) of Tsuji 2009 needs no accumulator:

        ω = m_e(i−1) + (d0 + d1)/(2·m_s),   d0 = m_e(a) − m_e(i−1),   d1 = m_e(i) − m_e(i−1)

    and eq. (17) is m_e(i−1) + d1/m_s. After an alteration the next window opens at that tick. At `max_ticks` the update
    is forced, and the window keeps its newer half. Without latency.

    - `max_ticks`, `kept_ticks`: Longest window, and what a forced update leaves of it.
    - `seldom`: A tick has at least three clocks, so that what the numerator has of the ticks before waits in a
      register.

    It raises ValueError if `max_ticks` is less than 2.
    """

    def __init__(
        self, *, max_ticks: int, kept_ticks: int, count_width: int, numerator_width: int, cancel: bool, seldom: bool
    ) -> None:
        if max_ticks < 2:
            raise ValueError(f"max_ticks must be at least 2, not {max_ticks}")
        self._max_ticks, self._kept_ticks, self._cancel, self._seldom = max_ticks, kept_ticks, cancel, seldom
        super().__init__(
            tick=In(1),
            moves=In(1),  # m_s moves on: once for every tick, with it or as long after it as m_s is needed
            alteration=In(1),  # valid from `tick` on, until m_s moves
            pulse_count=In(signed(count_width)),  # m_e(i) from `tick` on, until the next
            next_count=In(signed(count_width)),  # m_e(i), valid in the clock before `tick`
            numerator=Out(signed(numerator_width)),  # d0 + d1, or d1; valid in the clock before `tick`
            m_s=Out(range(max_ticks + 1), init=1),  # ticks; like the next two, from `tick` on until it moves
            closes=Out(1),  # the window closes
            forced=Out(1),  # it closes without an alteration
            update=Out(1),  # the window closes in this tick
            standstill=Out(1),  # from `tick` on: nothing was counted in more than `max_ticks` ticks in a row
        )

    def build(self, m: Module) -> None:
        last = self.pulse_count
        longest = Signal()
        after_forced = self._kept_ticks + 1
        m.d.comb += [
            self.closes.eq(self.alteration | longest),
            self.forced.eq(longest & ~self.alteration),
            self.update.eq(self.tick & self.closes),
        ]
        # One adder for both: where m_s is the longest, this leads to what is kept.
        back = Const((after_forced - self._max_ticks) % (1 << len(self.m_s)), len(self.m_s))
        with m.If(self.moves):
            m.d.sync += [self.m_s.eq(self.m_s + Mux(longest, back, 1)), longest.eq(self.m_s == self._max_ticks - 1)]
            with m.If(longest):
                m.d.sync += longest.eq(after_forced == self._max_ticks)
            with m.If(self.alteration):
                m.d.sync += [self.m_s.eq(1), longest.eq(0)]

        opening = Signal.like(last)
        opens = Signal.like(last)
        known = Signal.like(self.numerator)
        # After a forced update the kept half opens with the number that the window ends with.
        m.d.comb += opens.eq(Mux(self.update, last, opening))
        m.d.sync += opening.eq(opens)
        domain = m.d.sync if self._seldom else m.d.comb
        domain += known.eq((opening if self._seldom else opens) - (last << 1) if self._cancel else -last)
        m.d.comb += self.numerator.eq(known + self.next_count)
        self._rest(m, longest & ~opening.any())

    def _rest(self, m: Module, longest: Value) -> None:
        """Report rest from the tick on in which it is certain; `longest`: a longest window opened without a count."""
        silent = ~self.pulse_count.any()
        was_silent = Signal(init=1)  # m_e(i−1) is 0
        rests = Signal()
        nearly = Signal()  # the last tick ended a longest window, in which only the opening tick had a count
        m.d.comb += self.standstill.eq(
            # A longest window without an alteration goes on as it began, but for its opening tick; and a silence begins
            # in the tick that opens a window, or in the one after it.
            Mux(self.tick, silent & (rests | nearly | (longest & was_silent)), rests)
        )
        m.d.sync += [was_silent.eq(silent), rests.eq(self.standstill)]
        with m.If(self.tick):
            m.d.sync += nearly.eq(self.forced & silent)
