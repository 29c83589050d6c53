"""The datapaths of the methods that measure the time between counts share this."""

from amaranth import Const, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.methods.count_way import CountWay
from tachometry.hdl.methods.datapath import datapath_members
from tachometry.hdl.methods.gap_timer import GapTimer
from tachometry.hdl.methods.quotient_velocity import QuotientVelocity
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, only_if
from tachometry.spec.formats.displacement import DISPLACED
from tachometry.spec.methods.timed import TimedTachometer


class TimedDatapath(Box):
    """From counts to velocities; `_window` of a method says when a measurement ends (docs/concepts/timed.md).

    Latency: an update comes `spec.latency.datapath` clocks after the `step`, or the `tick`, that causes it. `interval`
    is in timer periods; `forced`: silence alone caused the update; `out_of_range`: the velocity was too high, and is
    saturated.
    """

    def __init__(self, spec: TimedTachometer) -> None:
        self._spec = spec
        self._opens: Value = Const(1)  # a measurement opens with this count
        self.gap_timer = GapTimer(spec.form.max_periods, on_lattice=spec.form.on_lattice)
        self.quotient_velocity = QuotientVelocity(spec)
        if not spec.form.on_lattice:
            self.count_way = CountWay(
                spec.form.timer_periods,
                decays=spec.form.decays,
                reversals=not spec.paper_exact,
                displacement=spec.displacement,
            )
        members = {
            **datapath_members(spec),
            "coming": In(1),  # `pulse_count` is new in the next clock, and a tick has ended
            **only_if(spec.form.on_lattice, next_count=In(signed(spec.widths.count))),  # the next `pulse_count`
            **only_if(not spec.form.on_lattice, step_before=In(signed(2))),  # the step of the next clock
            **(dict.fromkeys(DISPLACED, In(signed(form.width))) if (form := spec.displacement) else {}),
            **only_if(form and spec.bounds, mapped=In(1)),
        }
        super().__init__({name: member for name, member in members.items() if name != "tick"})
        # On the lattice: the sign of the last count, and whether this count is from another edge than that.
        self._was_negative, self._same = Signal(name="was_negative"), Signal(name="same")

    @property
    def probes(self) -> dict[str, Value]:
        return {"gap": self.gap_timer.age}

    @property
    def idle(self) -> tuple[Idle, ...]:
        if self._spec.form.on_lattice:  # which counts with the tick
            return ()
        return (IdleCounter("gap_timer.age", 1, (self._spec.form.max_periods - 2,)),)

    def _window(self, m: Module) -> tuple[Value, Value, Value, Value]:
        """Return whether a measurement ends next, its distance before this count and with it, and its length.

        Distances are in counts, times the timer periods in a tick. Where nothing ends, the length is the age of the
        last count.
        """
        raise NotImplementedError

    @property
    def _moved(self) -> Value:
        """The way of this count in half counts, times the timer periods in a tick."""
        way, form = self.count_way.way, self._spec.displacement
        return way if form is None else way + (self.displaced << form.low + 1)

    @property
    def _way(self) -> Value:
        """The way of this count, times the timer periods in a tick."""
        return self._moved >> 1

    def build(self, m: Module) -> None:
        spec = self._spec
        m.submodules.gap_timer = timer = self.gap_timer
        m.submodules.quotient_velocity = quotient = self.quotient_velocity
        addend, was_negative = self._added(m)
        ends_before, before, distance, time = self._window(m)
        wiring.connect(m, quotient.updates, wiring.flipped(self.updates))
        m.d.comb += [
            timer.coming.eq(self.coming),
            quotient.ends_before.eq(ends_before),
            quotient.overdue_before.eq(timer.overdue_before),
            quotient.silent_before.eq(timer.silent_before),
            quotient.dividend.eq(Mux(quotient.ends, before << 1, 0)),
            quotient.addend.eq(addend),
            quotient.distance.eq(Mux(quotient.ends, distance, 0)),
            quotient.divisor.eq(time),
        ]
        if spec.widths.stamp:
            m.d.comb += quotient.stamp.eq(self.stamp)
        if spec.bounds:
            # The first period after reset was not seen completely.
            begun = Signal()
            with m.If(timer.overdue):
                m.d.sync += begun.eq(1)
            mapped: Value = Const(1)
            if spec.displacement is not None:
                mapped = _is_mapped(m, self.mapped, count=timer.count, opens=self._opens, ends=quotient.ends)
            m.d.comb += [
                quotient.was_negative.eq(was_negative),
                quotient.known.eq(~quotient.beyond_in & (begun | timer.opened) & mapped),
            ]

    def _added(self, m: Module) -> tuple[Value, Value]:
        """Return the part of the dividend that is known last, in half counts, and the sign of the last count."""
        timer, quotient = self.gap_timer, self.quotient_velocity
        if not self._spec.form.on_lattice:
            m.submodules.count_way = way = self.count_way
            m.d.comb += [
                way.step_before.eq(self.step_before),
                way.decays_before.eq(quotient.decays_before),
                way.negative_before.eq(quotient.negative_before),
                timer.count_before.eq(self.step_before[0]),  # there is a step
            ]
            if self._spec.displacement is not None:
                m.d.comb += way.displaced_before.eq(self.displaced_before)
            return self._moved, way.negative
        negative, was_negative = self.pulse_count[-1], self._was_negative
        m.d.comb += [
            self._same.eq(1 if self._spec.paper_exact else negative == was_negative),
            timer.count_before.eq(self.coming & self.next_count.any()),
        ]
        with m.If(timer.count):
            m.d.sync += was_negative.eq(negative)
        decay = Mux(quotient.decays, Mux(quotient.negative_before, -3, 3), 0)
        return Mux(quotient.ends, self._way << 1, decay), was_negative


def _is_mapped(m: Module, mapped: Value, *, count: Value, opens: Value, ends: Value) -> Value:
    """Return whether the map was used at both ends of a measurement, or at the last count before a silence."""
    (used,) = delay(m, mapped)
    opening, latest = (Signal(name=name) for name in ("opening", "latest"))
    with m.If(count):
        m.d.sync += latest.eq(used)
        with m.If(opens):
            m.d.sync += opening.eq(used)
    return Mux(ends, used & opening, latest)
