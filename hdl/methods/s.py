"""The S method."""

from amaranth import Module, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleDivision
from tachometry.hdl.arithmetic.quotient import Quotient
from tachometry.hdl.methods.alteration import AlterationDetector
from tachometry.hdl.methods.datapath import datapath_members, quotients, stamped
from tachometry.hdl.methods.interval import IntervalAccumulator
from tachometry.hdl.methods.window_ends import WindowEnds
from tachometry.hdl.wires.ports import Box, follow
from tachometry.spec import STachometer
from tachometry.spec.formats.displacement import DISPLACED
from tachometry.spec.formats.reciprocal import DividedReciprocal

_OF_EDGES = (*DISPLACED, "step_before")


class SMethod(Box):
    """S-method datapath, eqs. (17) and (21) of Tsuji 2009: from pulse numbers to velocity without a divider.

    Latency: an update comes `spec.latency.datapath` clocks after `tick`. The velocity is correctly rounded: within half
    an LSB of the exact quotient, ties towards +∞. All of an update is held until the next. Its bounds are those of one
    count more and less in the window, rounded outward; they are not valid for the first window.
    """

    def __init__(self, spec: STachometer) -> None:
        self._spec = spec
        off, ticks, once = spec.displacement, spec.timing.max_ticks, spec.tick.room <= 1
        self.ends = None if off is None else WindowEnds(off, ticks, spec.form.kept_ticks, every_clock=once)
        super().__init__(
            **datapath_members(spec),
            coming=In(1),  # `tick` is high in the next clock
            next_count=In(signed(spec.widths.count)),  # what `pulse_count` is then; valid with `coming`
            standstill=Out(1),  # of the tick, see `IntervalAccumulator`
            **({} if self.ends is None else {name: self.ends.signature.members[name] for name in _OF_EDGES}),
        )
        self.alteration = AlterationDetector(spec.widths.count, seldom=spec.latency.serial)
        self.interval_accumulator = IntervalAccumulator(
            max_ticks=spec.timing.max_ticks,
            kept_ticks=spec.form.kept_ticks,
            count_width=spec.widths.count,
            numerator_width=spec.form.numerator_width,
            cancel=spec.cancel,
            seldom=spec.latency.serial,
        )
        self.quotient = Quotient(
            spec.form.reciprocal,
            quotients=quotients(spec),
            numerator_width=spec.form.numerator_width,
            tag=data.StructLayout({"forced": 1, **stamped(spec), **({"bounds_valid": 1} if spec.bounds else {})}),
            serial=spec.latency.serial,
        )

    @property
    def probes(self) -> dict[str, Value]:
        return {
            "alteration": self.alteration.alteration & self.tick,
            "m_s": self.interval_accumulator.m_s,
            "numerator": self.interval_accumulator.numerator,
        }

    @property
    def idle(self) -> tuple[Idle, ...]:
        """Divisions that a simulation may skip: q is read from the next tick on."""
        found = self._spec.form.reciprocal
        if not isinstance(found, DividedReciprocal) or found.steps > 62:
            return ()
        box = "quotient.reciprocal"
        return (IdleDivision(f"{box}.digits", f"{box}.less_one", "interval.m_s", found.steps),)

    def build(self, m: Module) -> None:
        m.submodules.alteration = alteration = self.alteration
        m.submodules.interval = interval = self.interval_accumulator
        m.submodules.quotient = quotient = self.quotient
        found, new = quotient.results, self.updates.p
        # m_s stays until the result has come, so that no register needs to keep it.
        moves = (self.tick & ~interval.closes) | found.valid if self._spec.latency.serial else self.tick
        for box in (alteration, interval):
            m.d.comb += [
                box.tick.eq(self.tick),
                box.pulse_count.eq(self.pulse_count),
                box.next_count.eq(self.next_count),
            ]
        m.d.comb += [
            alteration.coming.eq(self.coming),
            interval.moves.eq(moves),
            interval.alteration.eq(alteration.alteration),
            quotient.m.eq(interval.m_s),
            quotient.moves.eq(moves),
            quotient.load.eq(self.coming),
            quotient.start.eq(interval.update),
            quotient.base.eq(self.pulse_count),
            quotient.numerator.eq(self._displaced(m, interval.numerator << self._spec.form.finer)),
            quotient.tag.forced.eq(interval.forced),
            self.standstill.eq(interval.standstill),
            self.updates.valid.eq(found.valid),
            new.interval.eq(found.p.m),
            *(new[name].eq(found.p[name]) for name in found.p.shape().members if name != "m"),
        ]
        if self._spec.widths.stamp:
            m.d.comb += quotient.tag.stamp.eq(self.stamp)
        if self._spec.bounds:
            # The first window has begun before there was anything to be seen.
            later = Signal()
            with m.If(moves & interval.closes):
                m.d.sync += later.eq(1)
            m.d.comb += quotient.tag.bounds_valid.eq(later)

    def _displaced(self, m: Module, numerator: Value) -> Value:
        """Return a numerator with the displacements of the edges at both ends of the window."""
        if (ends := self.ends) is None:
            return numerator
        m.submodules.ends = ends
        follow(m, ends, self, (*_OF_EDGES, "coming", "tick"))
        follow(m, ends, self.interval_accumulator, ("closes", "forced", "m_s"))
        m.d.comb += ends.rises.eq(self.next_count > self.pulse_count)
        return numerator + ends.difference
