"""Velocity as a quotient of distance and time."""

from amaranth import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.divider import Divider
from tachometry.hdl.methods.datapath import stamped
from tachometry.hdl.output.update import update_layout, update_stream
from tachometry.hdl.wires.ports import Box, only_if
from tachometry.hdl.wires.registers import registers
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.methods.timed import TimedTachometer


def _bound_divider(spec: TimedTachometer) -> Divider:
    scale_bits = spec.velocity.native_frac_bits - spec.bound.error_bits
    return Divider(
        divisor_width=(spec.form.max_interval + 1).bit_length(),
        integer_bits=spec.form.quotient_bits - scale_bits,
        scale_bits=scale_bits,
    )


class QuotientVelocity(Box):
    """Divides distance by time, rounds, and holds the result; between measurements the velocity may decay.

    A measurement may begin when `free_before` is high. When `silent_before` is high and the divider is idle, it finds
    1½ counts over the time since the last count: an edge may lie half a count off. If that, rounded, is nearer to 0
    than the velocity, it becomes the velocity. A measurement that begins meanwhile takes the divider, and the velocity
    does not decay. What begins is told a clock before, so that registers start the divider.

    Latency: an update comes `spec.latency.datapath` clocks after `ends` or `decays`, or what would force a 0.
    """

    def __init__(self, spec: TimedTachometer) -> None:
        self._spec = spec
        f = spec.velocity.native_frac_bits
        # Distances are divided in half counts.
        self.divider = Divider(
            divisor_width=spec.widths.interval,
            integer_bits=spec.form.quotient_bits - (f - 1),
            scale_bits=f - 1,
            nearest=True,
            zeros=spec.form.zeros,
        )
        self.bound_dividers = {name: _bound_divider(spec) for name in (BOUNDS if spec.bounds else ())}
        super().__init__(
            # In the next clock
            ends_before=In(1),  # a measurement ends with a count, only if `free_before`
            overdue_before=In(1),  # a 0 is forced
            silent_before=In(1),  # a tick was silent
            free_before=Out(1),  # no measurement is being divided
            decays_before=Out(1),
            negative_before=Out(1),  # the velocity is negative
            # In this clock
            ends=Out(1),
            decays=Out(1),  # a division begins that lets the velocity decay
            # Two distances in half counts, times the timer periods in a tick, whose sum is divided: those of a
            # measurement, of a decay, or 0.
            dividend=In(signed(spec.form.distance_width + 1)),
            addend=In(signed(spec.form.distance_width + 1)),
            distance=In(signed(spec.form.distance_width)),  # with `ends`: their sum in counts, else 0
            divisor=In(spec.widths.interval),  # time in timer periods
            beyond_in=In(1),  # with `dividend`: the velocity is too high to be measured
            **{name: In(width) for name, width in stamped(spec).items()},
            **only_if(spec.bounds, known=In(1)),  # there are bounds
            **only_if(spec.bounds, was_negative=In(1)),  # the last count was
            updates=Out(update_stream(update_layout(spec))),
        )

    def build(self, m: Module) -> None:
        spec = self._spec
        new = registers(self.updates.p.shape(), "new")
        m.d.comb += self.updates.p.eq(new)
        m.submodules.divider = divider = self.divider
        measuring, forced, beyond = self._start(m)
        nearer, beyond_most, velocity = self._bounded(m, measuring, new.velocity, measuring & self._too_far(m))
        update = Signal()
        m.d.comb += update.eq(divider.done & (measuring | nearer if spec.form.decays else 1))
        m.d.sync += self.updates.valid.eq(update)
        with m.If(update):
            m.d.sync += [new.velocity.eq(velocity), new.interval.eq(divider.by), new.forced.eq(forced)]
            if spec.form.flags_range:
                m.d.sync += new.out_of_range.eq(beyond | beyond_most)
        if spec.widths.stamp:
            stamp = Signal(spec.widths.stamp, reset_less=True)
            with m.If(divider.start):
                m.d.sync += stamp.eq(self.stamp)
            with m.If(update):
                m.d.sync += new.stamp.eq(stamp)
        if spec.bounds:
            self._bounds(m, new, update)

    def _start(self, m: Module) -> tuple[Signal, Signal, Signal]:
        """Start the divider; return whether it measures, whether a 0 is forced, and whether the speed is too high."""
        spec, divider = self._spec, self.divider
        measuring = Signal()
        start = Signal()
        if spec.form.decays:
            # Not before the result of the last division is in `velocity`.
            idle = ~start & ~divider.running
            m.d.comb += self.decays_before.eq(self.silent_before & ~self.overdue_before & idle)
        m.d.comb += [
            self.free_before.eq(~Mux(start, ~self.decays, measuring & divider.running & ~divider.last)),
            divider.start.eq(start),
            divider.dividend.eq(self.dividend),
            divider.addend.eq(self.addend),
            divider.divisor.eq(self.divisor),
        ]
        m.d.sync += [
            self.ends.eq(self.ends_before),
            self.decays.eq(self.decays_before),
            start.eq(self.ends_before | self.overdue_before | self.decays_before),
        ]
        forced, beyond = (Signal(name=name, reset_less=True) for name in ("forced", "beyond"))
        with m.If(start):
            m.d.sync += [measuring.eq(~self.decays), forced.eq(~self.ends), beyond.eq(self.beyond_in)]
        return measuring, forced, beyond

    def _too_far(self, m: Module) -> Value:
        """Return whether the distance that is divided is more than the divider takes.

        Only with a greatest speed is the divider so narrow; a way that it does not take is too fast in any time.
        """
        if len(self.distance) < len(self.divider.dividend):
            return Const(0)
        # One bit less than its register has, so that the first remainder can be doubled: then the second digit of a
        # quotient that is too great for all digits is always another one than that of the greatest speed.
        way = self.distance[len(self.divider.dividend) - 3 :]
        upper = Signal(len(way), reset_less=True)
        with m.If(self.divider.start):
            m.d.sync += upper.eq(way)
        return upper != upper[-1].replicate(len(upper))

    def _bounded(self, m: Module, measuring: Signal, velocity: Value, too_far: Value) -> tuple[Value, Value, Value]:
        """Return the quotient held within a bound: whether it was nearer to 0, or beyond, and what it is then.

        The bound of a measurement is the greatest speed, that of a decay the velocity. The digits of highest weight
        come first: so the first that differs from the bound's decides, and if the quotient is beyond, all that follow
        are the bound's. A quotient that needs more digits than are made differs from any bound in the second of them.
        A copy of the velocity goes around in step with the digits of a decay, and takes up those of the result.
        """
        spec, divider = self._spec, self.divider
        bits = spec.form.quotient_bits + 1
        copy = Signal(bits, init=1 << (bits - 1))
        result = Cat(copy[:-1], ~copy[-1]).as_signed()
        m.d.comb += self.negative_before.eq(~copy[-1])
        if not (spec.form.decays or spec.form.saturates):
            with m.If(divider.running):
                m.d.sync += copy.eq(Cat(divider.digit, copy))
            return Const(0), Const(0), result
        nearer = Signal(reset_less=True)
        farther = Signal(reset_less=True)
        comes_nearer = Signal()
        passes = Signal()
        bound: Value = copy[-1]
        negative: Value = velocity[-1]
        bounded: Value = ~measuring
        if spec.form.saturates:
            negative, most = self._greatest(m)
            bound = Mux(measuring, most, bound) if spec.form.decays else most
            bounded = Const(1)
        m.d.comb += [
            comes_nearer.eq(nearer | (~farther & (bound != negative) & (divider.digit == negative))),
            passes.eq(bounded & (farther | too_far | (~nearer & (bound == negative) & (divider.digit != negative)))),
        ]
        with m.If(divider.running):
            m.d.sync += [
                Cat(nearer, farther).eq(Cat(comes_nearer, passes)),
                copy.eq(Cat(Mux(passes, bound, divider.digit), copy)),
            ]
        with m.If(divider.start):
            m.d.sync += Cat(nearer, farther).eq(0)
        return nearer, farther if spec.form.saturates else Const(0), result

    def _greatest(self, m: Module) -> tuple[Signal, Signal]:
        """Return the sign of the quotient, and the digit of the greatest speed with this sign."""
        divider = self.divider
        negative = Signal(reset_less=True)
        most = Signal(reset_less=True)
        limit = self._spec.tick.max_count << self._spec.velocity.native_frac_bits
        m.d.sync += most.eq(Mux(negative, divider.next_digit_of(-limit), divider.next_digit_of(limit)))
        sign = Mux(self.decays, self.negative_before, self.distance[-1])
        with m.If(divider.start):
            m.d.sync += [negative.eq(sign), most.eq(~sign)]
        return negative, most

    def _bounds(self, m: Module, new: data.View, update: Value) -> None:
        """Add two more dividers, with the latency of the first, for the least and the greatest possible velocity."""
        counted = Signal()
        # Distances in 2^−finer counts, and by how much edges may be off.
        finer = self._spec.bound.error_bits
        count = self._spec.form.timer_periods << finer
        off = int(self._spec.bound.edge_error * count)
        greatest = (self._spec.form.silent_way << finer) + off
        m.d.comb += counted.eq(self.ends)
        known = Signal(reset_less=True)
        with m.If(self.divider.start):
            m.d.sync += known.eq(self.known)
        for name, box in self.bound_dividers.items():
            m.submodules[f"divider_{name}"] = box
            upper = name == "velocity_upper"
            # The upper bound is rounded up: as the negative of what is rounded down.
            distance = -self.distance if upper else self.distance
            # While the velocity decays, the shaft is no farther back than its last edge.
            signs = new.velocity[-1], self.was_negative
            still = self.decays & (signs[0] & signs[1] if upper else ~(signs[0] | signs[1]))
            end = Signal.like(box.dividend)
            none = Signal(reset_less=True)
            m.d.comb += [
                end.eq(Mux(counted, (distance << finer) - off, Mux(still, -off, -greatest))),
                box.start.eq(self.divider.start),
                box.dividend.eq(end),
                # Each edge lies within one period before the count that reports it.
                box.divisor.eq(self.divisor + Mux(counted, Mux(end[-1], -1, 1), 0)),
            ]
            with m.If(self.divider.start):
                m.d.sync += none.eq(counted & end[-1] & (self.divisor == 1))
            limit = -self._spec.velocity.absent_bound
            lower = Mux(none, limit, box.quotient)
            with m.If(update):
                m.d.sync += new[name].eq(-lower if upper else lower)
        with m.If(update):
            m.d.sync += new.bounds_valid.eq(known)
