"""A timer measures the time since the last count."""

from amaranth import Cat, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class GapTimer(wiring.Component):
    """Counts timer periods from count to count, and reports when too many periods have had no count.

    Reset is treated as a count in the period before the first one; this count opens no window. Without latency.

    Parameters
    ----------
    max_periods : int
        Periods without a count after which `overdue` is high, and the time begins anew.
    on_lattice : bool
        Timer periods are ticks.

    Members
    -------
    tick : In(1)
    period : In(1)
        A timer period ends; one does with every tick.
    count : In(1)
        Something was counted in this period.
    negative : In(1)
        The sign of this count.
    age : Out(range(max_periods + 1), init=1)
        Periods since the last count, this one included; as the flags valid with `period`.
    opened : Out(1)
        There was a count in the last `max_periods`.
    was_negative : Out(1)
        The sign of the last count.
    overdue : Out(1)
        The last count was `max_periods` ago, and this period has none.
    silent : Out(1)
        A tick ends in which there was no count.
    """

    def __init__(self, max_periods: int, *, on_lattice: bool) -> None:
        self._max_periods = max_periods
        self._on_lattice = on_lattice
        super().__init__(
            {
                "tick": In(1),
                "period": In(1),
                "count": In(1),
                "negative": In(1),
                "age": Out(range(max_periods + 1), init=1),
                "opened": Out(1),
                "was_negative": Out(1),
                "overdue": Out(1),
                "silent": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        longest = Signal()
        m.d.comb += self.overdue.eq(self.period & longest & ~self.count)
        earlier = Signal()  # a count in an earlier period of this tick
        m.d.comb += self.silent.eq(self.tick & ~self.count & ~earlier)
        if not self._on_lattice:
            m.d.sync += earlier.eq(~self.tick & (self.count | earlier))
        more = (self.age + 1)[: len(self.age)]
        with m.If(self.period):
            m.d.sync += [self.age.eq(more), longest.eq(has_reached(more, self._max_periods))]
            with m.If(longest | self.count):
                m.d.sync += [self.age.eq(1), longest.eq(0), self.opened.eq(self.count)]
            with m.If(self.count):
                m.d.sync += self.was_negative.eq(self.negative)
        return m


def has_reached(counter: Value, number: int) -> Value:
    """Tell whether a counter that goes up from below is at this number for the first time: all its ones are there."""
    return Cat(counter[bit] for bit in range(number.bit_length()) if number >> bit & 1).all()
