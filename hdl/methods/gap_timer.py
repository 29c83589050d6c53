"""A timer measures the time since the last count."""

from amaranth import Cat, Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box


class GapTimer(Box):
    """Counts timer periods from count to count, and reports when too many periods have had no count.

    Reset is treated as a count in the period before the first one; this count opens no window. Without latency: it
    looks a clock ahead, so that a division starts from registers.

    - `max_periods`: Periods without a count after which `overdue` is high, and the time begins anew.
    """

    def __init__(self, max_periods: int, *, on_lattice: bool) -> None:
        self._max_periods, self._on_lattice = max_periods, on_lattice
        super().__init__(
            coming=In(1),  # a tick ends in the next clock
            count_before=In(1),  # there is a count in the next clock; on the lattice only if `coming`
            period=Out(1),  # a timer period ends; one does with every tick
            count=Out(1),  # something was counted in this period
            age=Out(range(max_periods + 1), init=1),  # periods since the last count with this; with `period`
            opened=Out(1),  # there was a count in the last `max_periods`; valid with `period`
            overdue=Out(1),  # the last count was `max_periods` ago, and this period has none
            overdue_before=Out(1),  # the same a clock earlier
            silent_before=Out(1),  # in the next clock a tick ends in which there was no count
        )

    def build(self, m: Module) -> None:
        tick = Signal()
        ends = self.count | self.overdue
        with m.If(self.period):
            m.d.sync += self.age.eq(self.age + 1)
            with m.If(ends):
                m.d.sync += [self.age.eq(1), self.opened.eq(self.count)]
        m.d.sync += [tick.eq(self.coming), self.count.eq(self.count_before), self.overdue.eq(self.overdue_before)]
        silent = self.coming & ~self.count_before
        if self._on_lattice:
            last = Signal()
            later = Mux(tick, ~ends & has_reached(self.age + 1, self._max_periods), last)
            longest = later & self.coming
            m.d.comb += [self.period.eq(tick), self.silent_before.eq(silent)]
            m.d.sync += last.eq(later)
        else:
            nearly = Signal()  # the next period may be the last one
            longest = nearly & ~self.count
            earlier = Signal()  # a count in an earlier period of this tick
            counted = ~tick & (self.count | earlier)
            m.d.comb += [self.period.eq(1), self.silent_before.eq(silent & ~counted)]
            last_but_one = has_reached(self.age, self._max_periods - 2) & ~nearly
            m.d.sync += [earlier.eq(counted), nearly.eq(last_but_one & ~ends)]
        m.d.comb += self.overdue_before.eq(longest & ~self.count_before)


def has_reached(counter: Value, number: int) -> Value:
    """Return whether a counter that goes up from below is at this number for the first time: all its ones are there."""
    return Cat(counter[bit] for bit in range(number.bit_length()) if number >> bit & 1).all()
