"""The S method."""

from amaranth import Module, Signal, Value
from amaranth.lib import data, wiring
from amaranth.lib.wiring import Out

from tachometry.hdl.arithmetic.quotient import Quotient
from tachometry.hdl.methods.alteration import AlterationDetector
from tachometry.hdl.methods.datapath import datapath_members, quotients, stamped
from tachometry.hdl.methods.interval import IntervalAccumulator
from tachometry.spec import STachometer


class SMethod(wiring.Component):
    """S-method datapath, eqs. (17) and (21) of Tsuji 2009: from pulse numbers to velocity without a divider.

    Latency: an update comes `spec.datapath_latency` clocks after `tick`. The velocity is correctly rounded: within half
    an LSB of the exact quotient, ties towards +∞.

    Parameters
    ----------
    spec : STachometer

    Members
    -------
    tick : In(1)
    pulse_count : In(signed)
        m_e, valid with `tick`.
    stalled : Out(1)
        Of the tick, see `IntervalAccumulator`.
    updates : Out(stream)
        `velocity` has `native_frac_bits` fraction bits, `interval` is m_s in ticks. The bounds are those of one count
        more and less in the window, rounded outward; they are not valid for the first window. All is held until the
        next update.
    """

    def __init__(self, spec: STachometer) -> None:
        super().__init__({**datapath_members(spec), "stalled": Out(1)})
        self._spec = spec
        self.alteration = AlterationDetector(spec.count_width)
        self.interval_accumulator = IntervalAccumulator(
            max_ticks=spec.timing.max_ticks,
            kept_ticks=spec.kept_ticks,
            count_width=spec.count_width,
            numerator_width=spec.numerator_width,
            cancel=spec.cancel,
        )
        self.quotient = Quotient(
            spec.reciprocal,
            quotients=quotients(spec),
            numerator_width=spec.numerator_width,
            tag=data.StructLayout({"forced": 1, **stamped(spec), **({"bounds_valid": 1} if spec.bounds else {})}),
            serial=spec.serial,
            margin=spec.margin,
        )

    @property
    def probes(self) -> dict[str, Value]:
        """What a waveform should show of the inside."""
        return {
            "alteration": self.alteration.alteration & self.tick,
            "m_s": self.interval_accumulator.m_s,
            "numerator": self.interval_accumulator.numerator,
        }

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.alteration = alteration = self.alteration
        m.submodules.interval = interval = self.interval_accumulator
        m.submodules.quotient = quotient = self.quotient
        found, new = quotient.results, self.updates.p
        m.d.comb += [
            alteration.tick.eq(self.tick),
            alteration.m_e.eq(self.pulse_count),
            interval.tick.eq(self.tick),
            interval.m_e.eq(self.pulse_count),
            interval.previous.eq(alteration.previous),
            interval.alteration.eq(alteration.alteration),
            quotient.m.eq(interval.m_s),
            quotient.enable.eq(self.tick),
            quotient.load.eq(self.tick),
            quotient.start.eq(interval.update),
            quotient.base.eq(alteration.previous),
            quotient.numerator.eq(interval.numerator << self._spec.finer),
            quotient.tag.forced.eq(interval.forced),
            self.stalled.eq(interval.stalled),
            self.updates.valid.eq(found.valid),
            new.interval.eq(found.p.m),
            *(new[name].eq(found.p[name]) for name in found.p.shape().members if name != "m"),
        ]
        if self._spec.stamp_width:
            m.d.comb += quotient.tag.stamp.eq(self.stamp)
        if self._spec.bounds:
            # The first window has begun before there was anything to be seen.
            later = Signal()
            with m.If(interval.update):
                m.d.sync += later.eq(1)
            m.d.comb += quotient.tag.bounds_valid.eq(later)
        return m
