"""The method of Rairán 2013."""

from amaranth import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.methods.datapath import datapath_members
from tachometry.hdl.methods.rairan_counters import RairanCounters
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, only_if
from tachometry.hdl.wires.registers import registers
from tachometry.spec import RairanTachometer


class RairanMethod(Box):
    """Datapath of Rairán 2013: from steps to velocity with a table, without a divider and without a multiplier.

    Latency: an update comes four clocks after the count or the end of dt that causes it, and that is
    `spec.latency.datapath` clocks after `tick` if it comes with one. There may be an update in every clock. The
    velocity is correctly rounded: within half an LSB of the exact quotient, ties towards +∞.

    `interval` is Ndt1 at low speeds, else 1. n1 = `n_ep1`/`n_dt1` of the velocity, 0 and 1 for the velocity 0; with
    `paper_exact` as in Table 1. If dt is adaptive, both are for dt·2^`dt_shift`. The bounds are n2 and n1, a clock
    wider and rounded outward.
    """

    def __init__(self, spec: RairanTachometer) -> None:
        super().__init__(
            step_now=In(signed(2)),
            last=Out(1),  # the present clock is the last of dt, and so of a tick
            beyond=Out(1),  # Nep1 is saturated; valid with `last`
            **datapath_members(spec),
            # With `tick`: k of its window.
            **only_if(spec.adaptive, tick_shift=Out(range(spec.times.max_tick_shift + 1))),
        )
        self._spec = spec
        self.counters = RairanCounters(spec)

    @property
    def probes(self) -> dict[str, Value]:
        return {"c_ep": self.counters.c_more + self.counters.any, "c_dt": self.counters.c_dt}

    @property
    def idle(self) -> tuple[Idle, ...]:
        return (IdleCounter("counters.left", -1, (-1,)),) if self._spec.timing.tick_cycles > 1 else ()

    def build(self, m: Module) -> None:
        spec = self._spec
        m.submodules.counters = counters = self.counters
        tag = [counters.n, counters.high, counters.backward, counters.forced, counters.at_rest]
        if spec.paper_exact:
            tag += [counters.n_ep1, counters.n_dt1]
        if spec.adaptive:
            tag += [counters.shift]
        update, n, high, backward, forced, at_rest, *more = delay(m, counters.update, *tag, clocks=2)
        m.d.comb += [counters.step.eq(self.step_now), self.last.eq(counters.last), self.beyond.eq(counters.beyond)]
        entry = self._entry(m)
        if counters.dt is not None:
            m.d.comb += self.tick_shift.eq(*delay(m, counters.dt.shift, clocks=2))
        m.d.sync += self.updates.valid.eq(update)
        shift = more[0] if spec.adaptive else 0
        low, counts = Mux(high | ~n.any(), 1, n), Mux(high, n + 1, n.any())
        new = registers(self.updates.p.shape(), "new", init={"n_dt1": 1})
        m.d.comb += self.updates.p.eq(new)
        stamp = delay(m, self.stamp) if spec.widths.stamp else []
        # At rest no update corrects what an upset has done to the outputs.
        shown = update | at_rest
        with m.If(shown):
            m.d.sync += [
                new.velocity.eq(self._velocity(n, high, backward, entry, shift)),
                new.interval.eq(low << shift if spec.adaptive else low),
                new.forced.eq(forced),
                Cat(new.n_ep1, new.n_dt1).eq(
                    Cat(*more) if spec.paper_exact else Cat(counts[: len(new.n_ep1)], low[: spec.widths.interval])
                ),
            ]
            if spec.adaptive:
                m.d.sync += new.dt_shift.eq(shift)
            m.d.sync += [new.stamp.eq(value) for value in stamp]
            if "rests" in new.shape().members:
                m.d.sync += new.rests.eq(at_rest)
        if spec.bounds:
            self._bounds(m, new, shown=shown, backward=backward)

    def _entry(self, m: Module) -> Signal:
        """Return the entry of the table, two clocks after the counters have changed."""
        form = self._spec.form
        m.submodules.table = memory = Memory(shape=form.table_width, depth=form.depth, init=form.table)
        read = memory.read_port()
        entry = Signal(form.table_width)
        m.d.sync += entry.eq(read.data)
        m.d.comb += read.addr.eq(self.counters.n[: len(read.addr)])
        return entry

    def _bounds(self, m: Module, new: data.View, *, shown: Value, backward: Signal) -> None:
        """Look up both bounds; backwards, they are negated and exchanged."""
        spec, counters = self._spec, self.counters
        width = spec.velocity.bound_width - 1
        low = ~counters.high & counters.unsynced
        n, above = counters.n, (counters.n - low)[: len(counters.n)]
        if spec.adaptive:
            mark = Mux(
                counters.high, spec.form.high_depth << counters.shift, Const(spec.form.low_depth) >> counters.shift
            )
            n, above = n | mark, above | mark
        lowest = Cat(counters.high, n)
        if spec.bound.edge_error:
            # What implies no least speed has the other half of the table.
            half = (len(spec.form.lower_table) - 1).bit_length() - 1
            lowest = Cat(lowest, Const(0, half))[:half]
            lowest = Cat(lowest, counters.loose)
        else:
            lowest = Mux(counters.loose, 0, lowest)
        upper = Cat(counters.high, above)
        places = {"lower": (lowest, spec.form.lower_table), "upper": (upper, spec.form.upper_table)}
        entries: dict[str, Signal] = {}
        for name, (place, table) in places.items():
            m.submodules[name] = memory = Memory(shape=width, depth=len(table), init=table)
            read = memory.read_port()
            entries[name] = entry = Signal(width, name=name)
            m.d.comb += read.addr.eq(place[: len(read.addr)])
            m.d.sync += entry.eq(read.data)
        valid = Signal()
        m.d.comb += valid.eq(counters.high | counters.n.any())
        valid, *negative = delay(m, valid, *([counters.loose] if spec.bound.edge_error else []), clocks=2)
        lower = Mux(negative[0], -entries["lower"], entries["lower"]) if negative else entries["lower"]
        with m.If(shown):
            m.d.sync += [
                new.velocity_lower.eq(Mux(backward, -entries["upper"], lower)),
                new.velocity_upper.eq(Mux(backward, -lower, entries["upper"])),
                new.bounds_valid.eq(valid),
            ]

    def _velocity(self, n: Signal, high: Signal, backward: Signal, entry: Value, shift: Value | int) -> Value:
        """Return the estimate with its sign: the complement and a carry are −v, so one adder rounds and negates."""
        spec = self._spec
        f = spec.velocity.native_frac_bits
        whole = (n + 1 if spec.estimate == "n1" else n) & high.replicate(len(n) + 1)
        carry: Value = Const(0)
        if spec.estimate != "n3":
            entry = self._without_tie(n, backward, entry, shift)
        if spec.adaptive:
            # With three more bits, high: 2^f·(2n + 1)/2 − 2^f/(2q), rounded down, as below; the shift drops the rest.
            part = ~Cat(entry, Const(0, f + 2 - len(entry))) if spec.estimate == "n3" else Const(0, f + 2)
            magnitude = Mux(high, Cat(part, Const(0, 1), whole), entry << 2) >> shift
            magnitude, carry = magnitude[3:], magnitude[2]
        elif spec.estimate == "n3":
            # Low: ⌊(h + 1)/2⌋. High: 2^(f−1) − ⌊(h + 4)/8⌋, and 2^(f−1) − 1 − ⌊h/8⌋ is the complement of ⌊h/8⌋.
            eighth = ~Cat(entry[3:], Const(0, 1))
            part, carry = Mux(high, eighth, entry[1:]), Mux(high, ~entry[2], entry[0])
            magnitude = Cat(part, whole)
        else:
            magnitude = Mux(high, whole << f, entry)
        padded = Cat(magnitude, Const(0, spec.velocity.native))[: spec.velocity.native]
        return (padded ^ backward.replicate(spec.velocity.native)) + (carry ^ backward)

    def _without_tie(self, n: Signal, backward: Signal, entry: Value, shift: Value | int) -> Value:
        """Return half an LSB backwards is rounded to 0."""
        ties = {
            k: tie for k in range(self._spec.times.max_tick_shift + 1) if (tie := self._spec.form.tie(k)) is not None
        }
        if not ties:
            return entry
        hits = [(n == tie) & (shift == k) if self._spec.adaptive else n == tie for k, tie in ties.items()]
        return Mux(backward & Cat(hits).any() if len(hits) > 1 else backward & hits[0], 0, entry)
