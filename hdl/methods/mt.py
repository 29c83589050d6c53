"""The M/T method."""

from amaranth import Module, Mux, Signal, Value

from tachometry.hdl.methods.timed import TimedDatapath
from tachometry.spec import MTTachometer


class MTMethod(TimedDatapath):
    """M/T-method datapath, eqs. (13) to (16) of Tsuji 2009: counts over the time that they take, longer than T_c.

    ½·s(opening) + counts between + ½·s(closing) is a sum over pairs of consecutive counts: a count of the same sign as
    the one before adds one, and a count of the other sign, which meets the same edge again, adds none. On the lattice a
    tick with m_e counts adds m_e, or one count less if their sign is not that before.
    """

    def __init__(self, spec: MTTachometer) -> None:
        super().__init__(spec)
        self._min_periods = spec.min_periods

    def _window(self, m: Module) -> tuple[Value, Value, Value]:
        spec, timer = self._spec, self.gap_timer
        length = Signal(spec.interval_width, init=1)
        late = Signal()
        travelled = Signal.like(self.quotient_velocity.dividend)
        total = Signal.like(travelled)
        ends = Signal()
        opens = Signal()
        m.d.comb += [
            ends.eq(timer.count & timer.opened & late & (self.quotient_velocity.free if spec.may_be_late else 1)),
            opens.eq(ends | ~timer.opened),
            total.eq(travelled + self._distance),
        ]
        with m.If(timer.period):
            m.d.sync += length.eq(length + 1)
            with m.If(length == self._min_periods):
                m.d.sync += late.eq(1)
            with m.If(opens):
                m.d.sync += [length.eq(1), late.eq(0)]
        with m.If(timer.count):
            m.d.sync += travelled.eq(Mux(opens, 0, total))
        return ends, total, Mux(ends, length, timer.age)

    @property
    def _distance(self) -> Value:
        """From the edge of the last count to that of this one; on the lattice, to the last edge of the tick."""
        if not self._spec.on_lattice:
            return Mux(self._same, self._one, 0)
        # All counts of the tick, less the one that meets the same edge again.
        return self._size + Mux(self._same, 0, Mux(self.gap_timer.negative, 1, -1))
