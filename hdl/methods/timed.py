"""The datapaths of the methods that measure the time between counts share this."""

from amaranth import Cat, Const, Module, Mux, Signal, Value, ValueLike, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.methods.count_way import CountWay
from tachometry.hdl.methods.datapath import datapath_members
from tachometry.hdl.methods.gap_timer import GapTimer
from tachometry.hdl.methods.quotient_velocity import QuotientVelocity
from tachometry.spec.methods.timed import TimedTachometer


class TimedDatapath(wiring.Component):
    """From counts to velocities; `_window` of a method says when a measurement ends (docs/concepts/timed.md).

    Latency: an update comes `spec.latency.datapath` clocks after the `step`, or the `tick`, that causes it.

    Members
    -------
    tick : In(1)
    pulse_count : In(signed)
        m_e, valid with `tick`.
    step_before : In(signed(2))
        The step of the next clock, steps being as late as `tick`; only if times are counted in clocks.
    updates : Out(stream)
        `interval` is in timer periods. `forced`: silence alone caused the update. `out_of_range`, only if that is
        possible: the velocity was too high to be measured, and is saturated.
    """

    def __init__(self, spec: TimedTachometer) -> None:
        self._spec = spec
        self.gap_timer = GapTimer(spec.form.max_periods, on_lattice=spec.form.on_lattice)
        self.quotient_velocity = QuotientVelocity(spec)
        if not spec.form.on_lattice:
            self.count_way = CountWay(reversals=not spec.paper_exact)
        super().__init__({**datapath_members(spec), **({} if spec.form.on_lattice else {"step_before": In(signed(2))})})

    @property
    def probes(self) -> dict[str, Value]:
        """Signals of the inside that a waveform should show."""
        return {"gap": self.gap_timer.age}

    @property
    def idle(self) -> tuple[Idle, ...]:
        """Counters that a simulation may skip: `IdleCounter`."""
        if self._spec.form.on_lattice:  # which counts with the tick
            return ()
        return (IdleCounter("gap_timer.age", 1, (self._spec.form.max_periods - 2,)),)

    @property
    def _size(self) -> Signal:
        """The count of a timer period."""
        size: Signal = self.pulse_count if self._spec.form.on_lattice else self.count_way.step
        return size

    @property
    def _one(self) -> ValueLike:
        """A count of this sign, times the timer periods in a tick."""
        return Mux(self.gap_timer.negative, -self._spec.form.timer_periods, self._spec.form.timer_periods)

    @property
    def _same(self) -> Value:
        """Whether this count is from another edge than the last count."""
        if not self._spec.form.on_lattice:
            return self.count_way.moves
        if self._spec.paper_exact:
            return Value.cast(1)
        return self.gap_timer.was_negative == self.gap_timer.negative

    @property
    def _way(self) -> Value:
        """From the edge of the last count to that of this one, times the timer periods in a tick; 0 without a count."""
        periods = self._spec.form.timer_periods
        # No bit is a gate: each is one of the registers.
        way = self.count_way
        bits = {(0, 0): Const(0), (1, 0): way.forward, (0, 1): way.backward, (1, 1): way.moves}
        return Cat(bits[periods >> k & 1, -periods >> k & 1] for k in range(periods.bit_length() + 1)).as_signed()

    def _window(self, m: Module) -> tuple[Value, Value, Value]:
        """Tell whether a measurement ends with this count, its distance, and its length.

        The distance is in counts, times the timer periods in a tick. Where nothing ends, the length is the age of the
        last count.
        """
        raise NotImplementedError

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._spec
        m.submodules.gap_timer = timer = self.gap_timer
        m.submodules.quotient_velocity = quotient = self.quotient_velocity
        size = self._size
        if not spec.form.on_lattice:
            m.submodules.count_way = way = self.count_way
            m.d.comb += [way.step_before.eq(self.step_before), way.was_negative.eq(timer.was_negative)]
        ends, distance, time = self._window(m)
        wiring.connect(m, quotient.updates, wiring.flipped(self.updates))
        m.d.comb += [
            timer.tick.eq(self.tick),
            timer.period.eq(self.tick if spec.form.on_lattice else 1),
            # Bit 0 of a step tells that it is one.
            timer.count.eq(self.tick & size.any() if spec.form.on_lattice else size[0]),
            timer.negative.eq(size[-1]),
            quotient.measure.eq(timer.overdue | ends),
            quotient.decay.eq(timer.silent),
            quotient.dividend.eq(Mux(timer.overdue, 0, distance)),
            quotient.divisor.eq(time),
            quotient.forced_in.eq(~timer.count),
        ]
        if spec.widths.stamp:
            m.d.comb += quotient.stamp.eq(self.stamp)
        if spec.bounds:
            # The first period after reset was not seen completely.
            begun = Signal()
            with m.If(timer.overdue):
                m.d.sync += begun.eq(1)
            m.d.comb += [
                quotient.was_negative.eq(timer.was_negative),
                quotient.known.eq(~quotient.beyond_in & (begun | timer.opened)),
            ]
        return m
