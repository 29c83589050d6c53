"""Velocity as a quotient of distance and time."""

from amaranth import Module, Mux, Signal, Value, signed
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.divider import Divider
from tachometry.hdl.arithmetic.registers import registers
from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.methods.datapath import stamped
from tachometry.hdl.output.update import update_layout, update_stream
from tachometry.spec.methods.timed import TimedTachometer
from tachometry.spec.tachometer import BOUNDS


class QuotientVelocity(wiring.Component):
    """Divides distance by time, rounds, and holds the result; between measurements the velocity may decay.

    A measurement may begin when `free` is high. When `decay` is high and the divider is idle, it finds 1½ counts over
    the time since the last count: an edge may lie half a count off. If that, rounded, is nearer to 0 than the velocity,
    it becomes the velocity. A measurement that begins meanwhile takes the divider, and the velocity does not decay.

    Latency: an update comes `spec.datapath_latency` clocks after `measure` or `decay`.

    Parameters
    ----------
    spec : TimedTachometer

    Members
    -------
    measure : In(1)
        Only if `free`; `dividend` is valid.
    decay : In(1)
        `divisor` is the time since the last count.
    dividend : In(signed)
        Distance in counts, times the timer periods in a tick.
    divisor : In(spec.interval_width)
        Time in timer periods.
    forced_in, beyond_in : In(1)
        Valid with `measure` and `decay`, as `divisor`.
    free : Out(1)
        No measurement is being divided.
    stamp : In
        Only with an age: number of ticks so far.
    known, was_negative : In(1)
        With `spec.bounds`. `known`: there are bounds. `was_negative`: the sign of the last count.
    updates : Out(stream)
        As those of the datapath.
    """

    def __init__(self, spec: TimedTachometer) -> None:
        self._spec = spec
        self.divider = Divider(
            divisor_width=spec.interval_width,
            # Distances are divided in half counts.
            integer_bits=spec.max_quotient.bit_length() + 1,
            scale_bits=spec.native_frac_bits,
        )
        self.bound_dividers = {
            name: Divider(
                divisor_width=(spec.max_interval + 1).bit_length(),
                integer_bits=spec.max_bound.bit_length() + spec.error_bits,
                scale_bits=spec.native_frac_bits - spec.error_bits,
            )
            for name in (BOUNDS if spec.bounds else ())
        }
        super().__init__(
            {
                "measure": In(1),
                "decay": In(1),
                "dividend": In(signed(len(self.divider.dividend) - 1)),
                "divisor": In(spec.interval_width),
                "forced_in": In(1),
                "beyond_in": In(1),
                "free": Out(1),
                **{name: In(width) for name, width in stamped(spec).items()},
                **({"known": In(1), "was_negative": In(1)} if spec.bounds else {}),
                "updates": Out(update_stream(update_layout(spec))),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._spec
        new = registers(self.updates.p.shape(), "new")
        m.d.comb += self.updates.p.eq(new)
        m.submodules.divider = divider = self.divider
        measuring, rounds, compared = (Signal(name=name) for name in ("measuring", "rounds", "compared"))
        # Where a result may be too large, a clock between the two holds it within its range.
        holds = Signal(name="holds") if spec.saturates else rounds
        # Not before the result of the last division is in `velocity`.
        decays = Signal()
        if spec.decays:
            m.d.comb += decays.eq(self.decay & ~self.measure & ~divider.busy & ~rounds & ~holds & ~compared)
        backward = new.velocity[-1]
        halves = self.dividend << 1
        greatest = Mux(backward, -3 * spec.timer_periods, 3 * spec.timer_periods)
        m.d.sync += [rounds.eq(divider.done & ~self.measure), compared.eq(holds & ~self.measure)]
        m.d.comb += [
            self.free.eq(~(measuring & (divider.busy | rounds | holds))),
            divider.start.eq(self.measure | decays),
            divider.divisor.eq(self.divisor),
            divider.dividend.eq(Mux(self.measure, halves, greatest) if spec.decays else halves),
        ]
        forced, beyond = (Signal(name=name, reset_less=True) for name in ("forced", "beyond"))
        with m.If(divider.start):
            m.d.sync += [
                measuring.eq(self.measure),
                forced.eq(self.forced_in),
                beyond.eq(self.beyond_in),
            ]

        # The last bit of the quotient is a half: it rounds.
        rounded = Signal(signed(len(divider.quotient)), reset_less=True)
        with m.If(divider.done):
            m.d.sync += rounded.eq((divider.quotient + 1) >> 1)
        shown, saturated = rounded, Signal(name="saturated", reset_less=True)
        if spec.saturates:
            held, changed = saturate(m, rounded, spec.max_count << spec.native_frac_bits)
            shown = Signal.like(held, name="shown", reset_less=True)
            m.d.sync += [holds.eq(rounds & ~self.measure), shown.eq(held), saturated.eq(changed)]
        change = Signal(signed(max(len(shown), spec.native_width) + 1))
        m.d.comb += change.eq(shown - new.velocity)
        nearer = Signal(reset_less=True)
        m.d.sync += nearer.eq(Mux(backward, ~change[-1] & change.any(), change[-1]))
        update = compared & (measuring | nearer) if spec.decays else compared
        m.d.sync += self.updates.valid.eq(update)
        with m.If(update):
            m.d.sync += [
                new.velocity.eq(shown),
                new.interval.eq(divider.by),
                new.forced.eq(forced),
            ]
            if spec.flags_range:
                m.d.sync += new.out_of_range.eq(beyond | saturated)
        if spec.stamp_width:
            stamp = Signal(spec.stamp_width, reset_less=True)
            with m.If(divider.start):
                m.d.sync += stamp.eq(self.stamp)
            with m.If(update):
                m.d.sync += new.stamp.eq(stamp)
        if spec.bounds:
            self._bounds(m, new, decays, update)
        return m

    def _bounds(self, m: Module, new: data.View, decays: Value, update: Value) -> None:
        """Two more dividers, with the latency of the first, for the least and the greatest possible velocity."""
        counted = Signal()
        # Distances in 2^−finer counts, and by how much edges may be off.
        finer = self._spec.error_bits
        count = self._spec.timer_periods << finer
        off = int(self._spec.edge_error * count)
        greatest = count + off
        m.d.comb += counted.eq(self.measure & ~self.forced_in)
        known = Signal(reset_less=True)
        with m.If(self.divider.start):
            m.d.sync += known.eq(self.known)
        for name, box in self.bound_dividers.items():
            m.submodules[f"divider_{name}"] = box
            upper = name == "velocity_upper"
            # The upper bound is rounded up: as the negative of what is rounded down.
            distance = -self.dividend if upper else self.dividend
            # While the velocity decays, the shaft is no farther back than its last edge.
            signs = new.velocity[-1], self.was_negative
            still = decays & (signs[0] & signs[1] if upper else ~(signs[0] | signs[1]))
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
            limit = -self._spec.absent_bound
            lower = Signal.like(box.quotient, reset_less=True)
            with m.If(box.done):
                m.d.sync += lower.eq(Mux(none, limit, box.quotient))
            with m.If(update):
                m.d.sync += new[name].eq(-lower if upper else lower)
        with m.If(update):
            m.d.sync += new.bounds_valid.eq(known)
