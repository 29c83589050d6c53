"""The M/T method."""

from amaranth import Module, Mux, Signal, Value, ValueLike, signed

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.methods.gap_timer import has_reached
from tachometry.hdl.methods.timed import TimedDatapath
from tachometry.spec import MTTachometer
from tachometry.spec.language.units import signed_width


class MTMethod(TimedDatapath):
    """M/T-method datapath, eqs. (13) to (16) of Tsuji 2009: counts over the time that they take, longer than T_c.

    ½·s(opening) + counts between + ½·s(closing) is a sum over pairs of consecutive counts: a count of the same sign as
    the one before adds one, and a count of the other sign, which meets the same edge again, adds none. On the lattice a
    tick with m_e counts adds m_e, or one count less if their sign is not that before.

    With `spec.form.cycle_counts` more than 1, a window that has completed a cycle without a reversal waits for the end
    of the next one, until `spec.form.patient_periods` are over.
    """

    def __init__(self, spec: MTTachometer) -> None:
        super().__init__(spec)
        self._min_periods = spec.form.min_periods
        self._most_travelled = spec.form.most_travelled
        self._patient_periods = spec.form.patient_periods
        self._cycle_counts = spec.form.cycle_counts

    @property
    def idle(self) -> tuple[Idle, ...]:
        """Counters that a simulation may skip: `IdleCounter`."""
        counters = super().idle
        stops = (self._min_periods, self._patient_periods)
        return (*counters, IdleCounter("length", 1, stops)) if counters else ()

    def _window(self, m: Module) -> tuple[Value, Value, Value]:
        spec, timer = self._spec, self.gap_timer
        length = Signal(spec.widths.interval, init=1)
        late = Signal()
        travelled = Signal(signed(signed_width(self._most_travelled)), reset_less=True)
        total = Signal.like(travelled)
        ends = Signal()
        opens = Signal()
        may_end: ValueLike = self.quotient_velocity.free if spec.form.may_be_late else 1
        if self._cycle_counts > 1:
            may_end = ~self._waits(m, length, opens)
        m.d.comb += [
            ends.eq(timer.count & timer.opened & late & may_end),
            opens.eq(ends | ~timer.opened),
            total.eq(travelled + self._distance),
        ]
        with m.If(timer.period):
            m.d.sync += length.eq(length + 1)
            with m.If(has_reached(length, self._min_periods)):
                m.d.sync += late.eq(1)
            with m.If(opens):
                m.d.sync += [length.eq(1), late.eq(0)]
        with m.If(timer.count):
            m.d.sync += travelled.eq(Mux(opens, 0, total))
        return ends, total, Mux(ends, length, timer.age)

    def _waits(self, m: Module, length: Signal, opens: Signal) -> Value:
        """Tell whether this count lies within a cycle that the window is to complete."""
        # Counts since the window opened: as long as none is against the one before, their sum but for the sign.
        counted = Signal(range(self._cycle_counts))
        number = Signal.like(counted)
        cycled = Signal()
        waived = Signal()
        m.d.comb += number.eq(counted + 1)
        with m.If(has_reached(length, self._patient_periods)):
            m.d.sync += waived.eq(1)
        with m.If(self.gap_timer.count):
            m.d.sync += [counted.eq(number), cycled.eq(cycled | (number == 0))]
            with m.If(~self._same):
                m.d.sync += waived.eq(1)
        with m.If(opens):
            m.d.sync += [counted.eq(0), cycled.eq(0), waived.eq(0)]
        return cycled & (number != 0) & ~waived & self._same

    @property
    def _distance(self) -> Value:
        """From the edge of the last count to that of this one; on the lattice, to the last edge of the tick."""
        if not self._spec.form.on_lattice:
            return self._way
        # All counts of the tick, less the one that meets the same edge again.
        return self._size + Mux(self._same, 0, Mux(self.gap_timer.negative, 1, -1))
