"""The T method."""

from amaranth import Module, Mux, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.gap_timer import GapTimer
from tachometry.hdl.quotient_velocity import QuotientVelocity
from tachometry.spec import TTachometer


class Datapath(wiring.Component):
    """T-method datapath, eq. (9) of Tsuji 2009: one count over the time since the count before.

    docs/timed.md has the rules of every case.

    Latency: `velocity_valid` is high `spec.datapath_latency` clocks after the `step`, or the `tick`, that causes it.

    Parameters
    ----------
    spec : TTachometer

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
    """

    def __init__(self, spec: TTachometer) -> None:
        self._spec = spec
        self.gap_timer = GapTimer(spec.max_periods)
        self.quotient_velocity = QuotientVelocity(spec)
        super().__init__(
            {
                "tick": In(1),
                "pulse_count": In(signed(spec.count_width)),
                **({} if spec.on_lattice else {"step": In(signed(2))}),
                "velocity": Out(signed(spec.native_width)),
                "velocity_valid": Out(1),
                "interval": Out(spec.interval_width),
                "forced": Out(1),
                "stalled": Out(1),
                **{port.name: Out(port.width) for port in spec.method_ports},
            }
        )

    @property
    def probes(self) -> dict[str, Value]:
        """What a waveform should show of the inside."""
        return {"age": self.gap_timer.age}

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._spec
        m.submodules.gap_timer = timer = self.gap_timer
        m.submodules.quotient_velocity = quotient = self.quotient_velocity
        size = self.pulse_count if spec.on_lattice else self.step
        many = size.any() & (size != 1) & (size != -1) if spec.on_lattice else Value.cast(0)
        same = Value.cast(1) if spec.paper_exact else timer.was_negative == timer.negative
        one = Mux(timer.negative, -spec.timer_periods, spec.timer_periods)
        m.d.comb += [
            timer.period.eq(self.tick if spec.on_lattice else 1),
            timer.count.eq(timer.period & size.any()),
            timer.negative.eq(size[-1]),
            quotient.measure.eq(timer.overdue | (timer.count & (timer.opened | many) & quotient.free)),
            quotient.sink.eq(self.tick & ~timer.count),
            quotient.dividend.eq(Mux(timer.count & (same | many), one, 0)),
            quotient.divisor.eq(Mux(many, 1, timer.age)),
            quotient.forced_in.eq(~timer.count),
            quotient.stalled_in.eq(~timer.count & ~timer.opened),
            quotient.beyond_in.eq(many),
            *(getattr(self, name).eq(getattr(quotient, name)) for name in ("velocity", "velocity_valid", "interval")),
            *(getattr(self, name).eq(getattr(quotient, name)) for name in ("forced", "stalled")),
            *(getattr(self, port.name).eq(getattr(quotient, port.name)) for port in spec.method_ports),
        ]
        return m
