"""The M/T method."""

from amaranth import Cat, Module, Mux, Signal, Value, ValueLike, signed

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
        counters = super().idle
        stops = (~self._min_periods, ~self._patient_periods)
        return (*counters, IdleCounter("still", -1, stops)) if counters else ()

    def _window(self, m: Module) -> tuple[Value, Value, Value, Value]:
        spec, timer, ends = self._spec, self.gap_timer, self.quotient_velocity.ends
        # By how much a window is older than its last count has so few bits. So many of its length, inverted, are kept;
        # the others follow from the age of the count.
        bits = min((spec.form.max_interval - spec.form.max_periods).bit_length(), spec.widths.interval)
        still = Signal(bits, init=(1 << bits) - 2)
        length = Signal(spec.widths.interval)
        late = Signal()
        late_next = Signal()
        travelled = Signal(signed(signed_width(self._most_travelled)), reset_less=True)
        total = Signal.like(travelled)
        opens = Signal()
        self._opens = opens
        m.d.comb += [
            # The carry tells whether the low bits of the length are less than those of the age.
            length.eq(Cat(~still, (timer.age + still)[bits:])),
            late_next.eq(late),
            opens.eq(ends | ~timer.opened),
            total.eq(travelled + self._way),
        ]
        with m.If(timer.period):
            m.d.sync += still.eq(still - 1)
            with m.If(has_reached(~still, self._min_periods)):
                m.d.comb += late_next.eq(1)
            with m.If(opens):
                m.d.sync += still.eq(~1)
                m.d.comb += late_next.eq(0)
        m.d.sync += late.eq(late_next)
        with m.If(timer.count):
            m.d.sync += travelled.eq(Mux(opens, 0, total))
        may_end: ValueLike = self.quotient_velocity.free_before if spec.form.may_be_late else 1
        if self._cycle_counts > 1:
            may_end = ~self._waits(m, still, opens)
        ends_before = timer.count_before & timer.opened & ~timer.overdue & late_next & may_end
        return ends_before, travelled, total, Mux(ends, length, timer.age)

    def _waits(self, m: Module, still: Signal, opens: Signal) -> Value:
        """Return whether the count of the next clock lies within a cycle that the window is to complete."""
        # Counts since the window opened: as long as none is against the one before, their sum but for the sign.
        counted = Signal(range(self._cycle_counts))
        number = Signal.like(counted)
        cycled = Signal()
        rounds = Signal()
        waived = Signal()
        waives = Signal()
        way, count = self.count_way, self.gap_timer.count
        m.d.comb += [
            number.eq(Mux(opens, 0, counted + count)),
            rounds.eq(~opens & (cycled | (count & counted.all()))),
            waives.eq(~opens & (waived | has_reached(~still, self._patient_periods) | (count & ~way.way.any()))),
        ]
        m.d.sync += [counted.eq(number), cycled.eq(rounds), waived.eq(waives)]
        return rounds & ~number.all() & ~waives & way.moves_before

    @property
    def _way(self) -> Value:
        if not self._spec.form.on_lattice:
            return super()._way
        # All counts of the tick, less the one that meets the same edge again.
        return self.pulse_count + Mux(self._same, 0, Mux(self.pulse_count[-1], 1, -1))
