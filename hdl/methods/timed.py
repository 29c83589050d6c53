"""What the datapaths of the methods have in common that measure the time between counts."""

from amaranth import Module, Mux, Signal, Value, ValueLike, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.methods.gap_timer import GapTimer
from tachometry.hdl.methods.quotient_velocity import QuotientVelocity
from tachometry.hdl.output.members import tick_members, update_members
from tachometry.spec.methods.timed import TimedTachometer
from tachometry.spec.tachometer import BOUNDS


class TimedDatapath(wiring.Component):
    """From counts to velocities; `_window` of a method says when a measurement ends. docs/timed.md has the rules.

    Latency: `velocity_valid` is high `spec.datapath_latency` clocks after the `step`, or the `tick`, that causes it.

    Parameters
    ----------
    spec : TimedTachometer

    Members
    -------
    tick : In(1)
    pulse_count : In(signed)
        m_e, valid with `tick`.
    step : In(signed(2))
        As late as `tick`; only if times are counted in clocks.
    velocity : Out(signed)
        In counts per tick with `native_frac_bits` fraction bits; this and all below are held until the next update.
    velocity_valid : Out(1)
    interval : Out
        Timer periods.
    forced : Out(1)
        Silence alone caused the update.
    stalled : Out(1)
        And there was no count in the maximum time before it either.
    out_of_range : Out(1)
        The velocity was too high to be measured, and is saturated; only if that can be.
    velocity_lower, velocity_upper, bounds_valid : Out
        With `spec.bounds`.
    """

    def __init__(self, spec: TimedTachometer) -> None:
        self._spec = spec
        self.gap_timer = GapTimer(spec.max_periods)
        self.quotient_velocity = QuotientVelocity(spec)
        super().__init__(
            {
                **tick_members(spec),
                **({} if spec.on_lattice else {"step": In(signed(2))}),
                **{port.name: Out(port.width) for port in spec.method_ports},
                **update_members(spec),
            }
        )

    @property
    def probes(self) -> dict[str, Value]:
        """What a waveform should show of the inside."""
        return {"age": self.gap_timer.age}

    @property
    def _size(self) -> Signal:
        """What a timer period counted."""
        size: Signal = self.pulse_count if self._spec.on_lattice else self.step
        return size

    @property
    def _one(self) -> ValueLike:
        """A count of this sign, times the timer periods in a tick."""
        return Mux(self.gap_timer.negative, -self._spec.timer_periods, self._spec.timer_periods)

    @property
    def _same(self) -> Value:
        """Whether it is another edge than that of the last count."""
        if self._spec.paper_exact:
            return Value.cast(1)
        return self.gap_timer.was_negative == self.gap_timer.negative

    def _window(self, m: Module) -> tuple[Value, Value, Value]:
        """Whether a measurement ends with this count, its distance in counts times the timer periods in a tick, and how
        long it was; of anything else the last count's age."""
        raise NotImplementedError

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._spec
        m.submodules.gap_timer = timer = self.gap_timer
        m.submodules.quotient_velocity = quotient = self.quotient_velocity
        size = self._size
        ends, distance, time = self._window(m)
        m.d.comb += [
            timer.period.eq(self.tick if spec.on_lattice else 1),
            timer.count.eq(timer.period & size.any()),
            timer.negative.eq(size[-1]),
            quotient.measure.eq(timer.overdue | ends),
            quotient.decay.eq(self.tick & ~timer.count),
            quotient.dividend.eq(Mux(timer.count, distance, 0)),
            quotient.divisor.eq(time),
            quotient.forced_in.eq(~timer.count),
            quotient.stalled_in.eq(~timer.count & ~timer.opened),
            *(getattr(self, name).eq(getattr(quotient, name)) for name in ("velocity", "velocity_valid", "interval")),
            *(getattr(self, name).eq(getattr(quotient, name)) for name in ("forced", "stalled")),
            *(getattr(self, port.name).eq(getattr(quotient, port.name)) for port in spec.method_ports),
        ]
        if spec.bounds:
            # Of the first period after reset not all was seen.
            begun = Signal()
            with m.If(timer.overdue):
                m.d.sync += begun.eq(1)
            m.d.comb += [
                quotient.was_negative.eq(timer.was_negative),
                quotient.known.eq(~quotient.beyond_in & (begun | timer.opened)),
                *(getattr(self, name).eq(getattr(quotient, name)) for name in (*BOUNDS, "bounds_valid")),
            ]
        return m
