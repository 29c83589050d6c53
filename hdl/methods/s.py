"""The S method."""

from typing import Any

from amaranth import Cat, Module, Signal, Value
from amaranth.lib import wiring

from tachometry.hdl.arithmetic.carried_reciprocal import CarriedReciprocal
from tachometry.hdl.arithmetic.reciprocal import Reciprocal
from tachometry.hdl.arithmetic.remainder_scaler import PipelinedRemainderScaler, SerialRemainderScaler
from tachometry.hdl.arithmetic.scaler import PipelinedScaler, SerialScaler
from tachometry.hdl.methods.alteration import AlterationDetector
from tachometry.hdl.methods.interval import IntervalAccumulator
from tachometry.hdl.output.members import tick_members, update_members
from tachometry.spec import STachometer
from tachometry.spec.formats import carried_reciprocal
from tachometry.spec.tachometer import BOUNDS


class SMethod(wiring.Component):
    """S-method datapath, eqs. (17) and (21) of Tsuji 2009: from pulse numbers to velocity without a divider.

    Latency: `velocity_valid` is high `spec.tick_to_velocity` clocks after `tick`. The velocity is correctly rounded:
    within half an LSB of the exact quotient, ties towards +∞.

    Parameters
    ----------
    spec : STachometer

    Members
    -------
    tick : In(1)
    pulse_count : In(signed)
        m_e, valid with `tick`.
    velocity : Out(signed)
        In counts per tick with `native_frac_bits` fraction bits; this and all below are held until the next update.
    velocity_valid : Out(1)
        One clock per update.
    interval : Out
        m_s in ticks.
    forced, stalled : Out(1)
    velocity_lower, velocity_upper, bounds_valid : Out
        With `spec.bounds`: one count more and less in the window, rounded outward; not valid for the first window.
    """

    def __init__(self, spec: STachometer) -> None:
        super().__init__(tick_members(spec) | update_members(spec))
        self._spec = spec
        self.alteration = AlterationDetector(spec.count_width)
        self.interval_accumulator = IntervalAccumulator(
            max_ticks=spec.timing.max_ticks,
            kept_ticks=spec.kept_ticks,
            count_width=spec.count_width,
            numerator_width=spec.numerator_width,
            cancel=spec.cancel,
        )
        self._carried = isinstance(spec.reciprocal, carried_reciprocal.CarriedReciprocal)
        if isinstance(spec.reciprocal, carried_reciprocal.CarriedReciprocal):
            self.reciprocal: Any = CarriedReciprocal(spec.reciprocal)
            scaler: Any = SerialRemainderScaler if spec.serial else PipelinedRemainderScaler
        else:
            self.reciprocal = Reciprocal(spec.reciprocal)
            scaler = SerialScaler if spec.serial else PipelinedScaler
        shape = {"numerator_width": spec.numerator_width, "tag_width": spec.interval_width + 2 + spec.bounds}
        self.scaler = scaler(spec.reciprocal, base_width=spec.count_width, **shape)
        self.bound_scalers = {
            name: scaler(spec.reciprocal, base_width=spec.bound_width - spec.native_frac_bits, towards=towards, **shape)
            for name, towards in BOUNDS.items()
            if spec.bounds
        }

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
        m.submodules.reciprocal = reciprocal = self.reciprocal
        m.submodules.scaler = scaler = self.scaler
        known = [interval.m_s, interval.forced, interval.stalled]
        tags = [self.interval, self.forced, self.stalled]
        if self._spec.bounds:
            # The first window has begun before there was anything to be seen.
            later = Signal()
            with m.If(interval.update):
                m.d.sync += later.eq(1)
            known.append(later)
            tags.append(self.bounds_valid)
        m.d.comb += [
            alteration.tick.eq(self.tick),
            alteration.m_e.eq(self.pulse_count),
            interval.tick.eq(self.tick),
            interval.m_e.eq(self.pulse_count),
            interval.previous.eq(alteration.previous),
            interval.alteration.eq(alteration.alteration),
            reciprocal.m.eq(interval.m_s),
            reciprocal.enable.eq(self.tick),
            self.velocity.eq(scaler.velocity),
            self.velocity_valid.eq(scaler.done),
            Cat(tags).eq(scaler.tag_out),
        ]

        def feed(scaler: Any, numerator: Value) -> None:
            m.d.comb += [
                scaler.load.eq(self.tick),
                scaler.start.eq(interval.update),
                scaler.base.eq(alteration.previous),
                scaler.numerator.eq(numerator),
                scaler.tag.eq(Cat(known)),
                scaler.q.eq(reciprocal.q),
                *([scaler.r.eq(reciprocal.r)] if self._carried else []),
            ]

        feed(scaler, interval.numerator)
        for name, box in self.bound_scalers.items():
            m.submodules[name] = box
            feed(box, interval.numerator + BOUNDS[name] * self._spec.whole)
            m.d.comb += getattr(self, name).eq(box.velocity)
        return m
