"""The method of Rairán 2013."""

from collections.abc import Callable
from typing import Any

from amaranth import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.methods.dt_shift import DtShift
from tachometry.hdl.output.members import tick_members, update_members
from tachometry.spec import RairanTachometer


def _ports(spec: RairanTachometer) -> dict[str, Any]:
    """Nep1 and Ndt1, with the values that they have before anything has come."""
    return {port.name: Out(port.width, init=int(port.name == "n_dt1")) for port in spec.method_ports}


class Counters(wiring.Component):
    """Table 1 of Rairán 2013 at every clock: Cep, Cdt, the clock of dt, and what they make of Nep1 and Ndt1.

    Latency: `update` is high in the clock after the count, or the end of dt, that causes it.

    Parameters
    ----------
    spec : RairanTachometer

    Members
    -------
    step : In(signed(2))
    last : Out(1)
        High in the clock in which dt ends; without latency.
    beyond : Out(1)
        There were more counts in this dt than Cep can hold; valid with `last`.
    update : Out(1)
        A new estimate, or an old one found too large.
    n : Out
        Ndt1, or Nep1 − 1 if `high`; 0 stands for the velocity 0. This and all below are held until the next update.
    high, backward : Out(1)
        The regime, and the direction.
    forced, stalled : Out(1)
        Of the last update: it came without a count; and it is that of the maximum time.
    n_ep1, n_dt1 : Out
        Only with `paper_exact`: as in Table 1.
    shift : Out
        Only if dt is adaptive: n is of dt·2^shift.
    loose, unsynced, known : Out(1)
        Only with bounds: n says nothing of the least speed; what it measures did not begin in step with dt; there has
        been a count that dt was in step with.
    """

    def __init__(self, spec: RairanTachometer) -> None:
        self._spec = spec
        super().__init__(
            {
                "step": In(signed(2)),
                "last": Out(1),
                "beyond": Out(1),
                "update": Out(1),
                "n": Out(range(max(spec.max_pulse_count, spec.timing.max_ticks) + 1)),
                "high": Out(1),
                "backward": Out(1),
                "forced": Out(1),
                "stalled": Out(1),
                **(_ports(spec) if spec.paper_exact else {}),
                **({"shift": Out(range(spec.max_shift + 1))} if spec.adaptive else {}),
                **({name: Out(1) for name in ("loose", "unsynced", "known")} if spec.bounds else {}),
            }
        )
        # Cep − 1, and whether there is any.
        self.c_more = Signal(range(max(spec.max_pulse_count, 2)))
        self.any = Signal()
        self.c_dt = Signal(range(spec.timing.max_ticks + 1))
        self.rest = Signal()  # it has come to its end
        self.dt = DtShift(spec, len(self.n)) if spec.adaptive else None

    def elaborate(self, platform: object) -> Module:
        m = Module()
        pulse, opens = Signal(), Signal()
        late = Signal()  # dt has ended since the last count, Cdt ≠ 0
        due = self._clock(m, opens)
        if self.dt is not None:
            m.submodules.dt = self.dt
            m.d.comb += [self.dt.nominal.eq(due), self.dt.opens.eq(opens)]
            due = self.dt.last
        m.d.comb += pulse.eq(self.step.any())
        self._count(m, pulse, opens)
        if self._spec.paper_exact:
            # A count at the end of dt is in neither window.
            m.d.comb += [opens.eq(pulse & late), self.last.eq(due & ~opens)]
            with m.If(self.last):
                m.d.sync += late.eq(1)
            with m.Elif(pulse):
                m.d.sync += late.eq(0)
            self._update_to_the_letter(m, opens)
            return m
        moved = Signal()
        turns = Signal()
        m.d.comb += [
            turns.eq(pulse & moved & (self.step[1] ^ self.backward)),
            self.last.eq(due & ~(pulse & late) & ~turns),
            opens.eq(pulse & (late | due) | turns),
        ]
        with m.If(pulse):
            m.d.sync += [moved.eq(1), self.backward.eq(self.step[1]), late.eq(0)]
        with m.Elif(self.last):
            m.d.sync += late.eq(1)
        if self.dt is not None:
            # With the decay it is low from the second dt on.
            several, stays = self.c_more.any(), self.high & (self._spec.bound_decay | (self.c_dt == 1))
            measured = Mux(late, Mux(stays, self.n, self.c_dt), Mux(several, self.c_more, 1))
            m.d.comb += [self.dt.turns.eq(turns), self.dt.high.eq(Mux(late, stays, several)), self.dt.n.eq(measured)]
        self._update(m, pulse=pulse, opens=opens, turns=turns)
        return m

    def _of_dt(self, constant: Callable[[int], int]) -> Value | int:
        """A constant that depends on k of dt·2^k."""
        return constant(0) if self.dt is None else self.dt.of(constant)

    def _clock(self, m: Module, opens: Signal) -> Value:
        """Count dt from where a window opens, and on; whether it is over."""
        cycles = self._spec.timing.tick_cycles
        if cycles == 1:
            return Const(1)
        # Counts down to −1, as the sampling clock does.
        start = cycles - 2
        left = Signal(signed(start.bit_length() + 1), init=start)
        m.d.sync += left.eq(left - Const(1, left.shape()))
        with m.If(left[-1] | opens):
            m.d.sync += left.eq(start)
        return left[-1]

    def _count(self, m: Module, pulse: Signal, opens: Signal) -> None:
        """Cep, which a window that a count opens begins with that count, and Cdt since the last count."""
        c_more, c_dt, most = self.c_more, self.c_dt, self._spec.max_count
        full: Value = Const(0)
        if most < self._spec.timing.tick_cycles:
            full = self.any & (c_more == self._of_dt(lambda k: (most << k) - 1))
        with m.If(pulse):
            m.d.sync += self.any.eq(1)
            with m.If(full):
                m.d.sync += self.beyond.eq(1)
            with m.Else():
                m.d.sync += c_more.eq(c_more + self.any)
        with m.If(self.last):
            m.d.sync += [c_more.eq(0), self.any.eq(0), self.beyond.eq(0)]
            m.d.sync += self.rest.eq(self._is_longest())
            with m.If(~self._is(self._spec.max_dt)):
                m.d.sync += c_dt.eq(c_dt + 1)
        with m.If(opens):
            m.d.sync += [c_more.eq(0), self.any.eq(1), self.beyond.eq(0)]
        with m.If(pulse & ~self.last if self._spec.paper_exact else pulse):
            m.d.sync += [c_dt.eq(0), self.rest.eq(0)]

    def _is(self, constant: Callable[[int], int]) -> Value:
        """Cdt is a constant that depends on k of dt·2^k."""
        return self.c_dt == self._of_dt(constant)

    def _is_longest(self) -> Value:
        """With this end of dt Cdt is what the maximum time has dt, or has been so before."""
        return self._is(self._spec.max_dt) | self._is(lambda k: self._spec.max_dt(k) - 1)

    def _update(self, m: Module, *, pulse: Signal, opens: Signal, turns: Signal) -> None:
        """What a count or the end of dt makes of the estimate."""
        spec = self._spec
        several, one = self.c_more.any(), self.any
        in_step = Signal()  # the last count opened its window
        waits = Signal()  # dt ends without a count
        with m.If(pulse):
            m.d.sync += in_step.eq(opens)
        known = Signal()
        with m.If(opens):
            m.d.sync += known.eq(1)
        waited = self.c_dt + in_step
        m.d.comb += waits.eq(self.last & ~pulse)
        n: Value = self.n
        if self.dt is not None:
            # n is that of the window before, whose k may be one more or less, until this one has measured.
            differs = (self.shift - self.dt.shift)[:2]
            n = Mux(differs[0], Mux(differs[1], n >> 1, n << 1), n)

        def set_(
            n: Value | int,
            *,
            update: Value | int = 1,
            high: int = 0,
            forced: int = 0,
            stalled: int = 0,
            loose: Value | int = 0,
            unsynced: Value | int = 0,
        ) -> None:
            if self.dt is not None:
                m.d.sync += self.shift.eq(self.dt.shift)
            if spec.bounds:
                m.d.sync += [self.loose.eq(loose), self.unsynced.eq(unsynced), self.known.eq(known)]
            m.d.sync += [
                self.update.eq(update),
                self.n.eq(n),
                self.high.eq(high),
                self.forced.eq(forced),
                self.stalled.eq(stalled),
            ]

        m.d.sync += self.update.eq(0)
        with m.If(turns):
            set_(0)
        with m.Elif(self.last & several):
            set_(self.c_more, high=1)
        with m.Elif(self.last & (pulse | (one & self.high))):
            # Ndt1 ← 1 by a count just at the end of dt, or Nep1 ← 1.
            set_(1, loose=~pulse)
        with m.Elif(opens & ((self.c_dt != 1) | ~self.high)):
            set_(self.c_dt, loose=self.rest, unsynced=~in_step)
        with m.Elif(waits & self._is_longest()):
            # At rest no update would mend it after an upset.
            set_(0, update=~self.rest, forced=1, stalled=1)
        if spec.bound_decay:
            with m.Elif(waits & Mux(self.high, waited != 0, (waited > n) & self.n.any())):
                set_(waited, forced=1, loose=1)

    def _update_to_the_letter(self, m: Module, opens: Signal) -> None:
        """Lines 5 to 9 of Table 1."""
        m.d.sync += self.update.eq(opens | (self.last & self.any))
        with m.If(opens):
            m.d.sync += self.n_dt1.eq(self.c_dt)
            with m.If((self.c_dt != 1) | ~self.high):
                m.d.sync += [self.n.eq(self.c_dt), self.high.eq(0)]
        with m.Elif(self.last & self.any):
            m.d.sync += self.n_ep1.eq(self.c_more + 1)
            with m.If(self.c_more.any()):
                m.d.sync += [self.n.eq(self.c_more), self.high.eq(1)]
            with m.Elif(self.high | ~self.n.any()):
                m.d.sync += [self.n.eq(1), self.high.eq(0)]


class Datapath(wiring.Component):
    """Datapath of Rairán 2013: from steps to velocity with a table, without a divider and without a multiplier.

    Latency: `velocity_valid` is high four clocks after the count or the end of dt that causes it, and that is
    `spec.datapath_latency` clocks after `tick` if it comes with one. There may be an update in every clock. The
    velocity is correctly rounded: within half an LSB of the exact quotient, ties towards +∞.

    Parameters
    ----------
    spec : RairanTachometer

    Members
    -------
    step_now : In(signed(2))
    last : Out(1)
        The present clock is the last of dt, and so of a tick.
    beyond : Out(1)
        And Nep1 is saturated.
    tick, pulse_count : In
        Not used.
    velocity : Out(signed)
        In counts per tick with `native_frac_bits` fraction bits; this and all below are held until the next update.
    velocity_valid : Out(1)
    interval : Out
        Ndt1 at low speeds, else 1.
    forced, stalled : Out(1)
    n_ep1, n_dt1 : Out
        n1 = Nep1/Ndt1 of the velocity; 0 and 1 for the velocity 0. With `paper_exact` as in Table 1.
    dt_shift : Out
        Only if dt is adaptive: both are of dt·2^dt_shift.
    velocity_lower, velocity_upper, bounds_valid : Out
        With `spec.bounds`: n2 and n1, a clock wider and rounded outward.
    """

    def __init__(self, spec: RairanTachometer) -> None:
        super().__init__(
            {
                "step_now": In(signed(2)),
                "last": Out(1),
                "beyond": Out(1),
                **tick_members(spec),
                **_ports(spec),
                **update_members(spec),
            }
        )
        self._spec = spec
        self.counters = Counters(spec)

    @property
    def probes(self) -> dict[str, Value]:
        """What a waveform should show of the inside."""
        return {"c_ep": self.counters.c_more + self.counters.any, "c_dt": self.counters.c_dt}

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._spec
        m.submodules.counters = counters = self.counters
        m.submodules.table = memory = Memory(shape=spec.table_width, depth=spec.depth, init=spec.table)
        read = memory.read_port()
        tag = [counters.n, counters.high, counters.backward, counters.forced, counters.stalled]
        if spec.paper_exact:
            tag += [counters.n_ep1, counters.n_dt1]
        if spec.adaptive:
            tag += [counters.shift]
        update, n, high, backward, forced, stalled, *more = self._later(m, 2, counters.update, *tag)
        entry = Signal(spec.table_width)
        m.d.sync += entry.eq(read.data)
        m.d.comb += [
            counters.step.eq(self.step_now),
            self.last.eq(counters.last),
            self.beyond.eq(counters.beyond),
            read.addr.eq(counters.n[: len(read.addr)]),
        ]
        m.d.sync += self.velocity_valid.eq(update)
        shift = more[0] if spec.adaptive else 0
        low, counts = Mux(high | ~n.any(), 1, n), Mux(high, n + 1, n.any())[: len(self.n_ep1)]
        # At rest no update mends what an upset has done to the outputs.
        shown = update | stalled
        with m.If(shown):
            m.d.sync += [
                self.velocity.eq(self._velocity(n, high, backward, entry, shift)),
                self.interval.eq(low << shift if spec.adaptive else low),
                self.forced.eq(forced),
                self.stalled.eq(stalled),
                Cat(self.n_ep1, self.n_dt1).eq(
                    Cat(*more) if spec.paper_exact else Cat(counts, low[: spec.interval_width])
                ),
            ]
            if spec.adaptive:
                m.d.sync += self.dt_shift.eq(shift)
        if spec.bounds:
            self._bounds(m, shown=shown, backward=backward)
        return m

    def _bounds(self, m: Module, *, shown: Value, backward: Signal) -> None:
        """Both looked up; backwards, the negative of each is the other."""
        spec, counters = self._spec, self.counters
        width = spec.bound_width - 1
        low = ~counters.high & counters.unsynced
        n, above = counters.n, (counters.n - low)[: len(counters.n)]
        if spec.adaptive:
            mark = Mux(counters.high, spec.high_depth << counters.shift, Const(spec.low_depth) >> counters.shift)
            n, above = n | mark, above | mark
        places = {"lower": Mux(counters.loose, 0, Cat(counters.high, n)), "upper": Cat(counters.high, above)}
        entries: dict[str, Signal] = {}
        for name, place in places.items():
            table = getattr(spec, f"{name}_table")
            m.submodules[name] = memory = Memory(shape=width, depth=len(table), init=table)
            read = memory.read_port()
            entries[name] = entry = Signal(width, name=name)
            m.d.comb += read.addr.eq(place[: len(read.addr)])
            m.d.sync += entry.eq(read.data)
        valid = Signal()
        m.d.comb += valid.eq(counters.known & (counters.high | counters.n.any()))
        (valid,) = self._later(m, 2, valid)
        with m.If(shown):
            m.d.sync += [
                self.velocity_lower.eq(Mux(backward, -entries["upper"], entries["lower"])),
                self.velocity_upper.eq(Mux(backward, -entries["lower"], entries["upper"])),
                self.bounds_valid.eq(valid),
            ]

    @staticmethod
    def _later(m: Module, clocks: int, *values: Signal) -> list[Signal]:
        """Registers that follow the values so many clocks later."""
        for _ in range(clocks):
            registers = [Signal.like(value, name=value.name) for value in values]
            m.d.sync += [register.eq(value) for register, value in zip(registers, values, strict=True)]
            values = tuple(registers)
        return list(values)

    def _velocity(self, n: Signal, high: Signal, backward: Signal, entry: Value, shift: Value | int) -> Value:
        """The estimate with its sign: the complement and a carry are −v, so one adder rounds and negates."""
        spec = self._spec
        f = spec.native_frac_bits
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
        padded = Cat(magnitude, Const(0, spec.native_width))[: spec.native_width]
        return (padded ^ backward.replicate(spec.native_width)) + (carry ^ backward)

    def _without_tie(self, n: Signal, backward: Signal, entry: Value, shift: Value | int) -> Value:
        """Half an LSB backwards is rounded to 0."""
        ties = {k: tie for k in range(self._spec.max_shift + 1) if (tie := self._spec.tie(k)) is not None}
        if not ties:
            return entry
        hits = [(n == tie) & (shift == k) if self._spec.adaptive else n == tie for k, tie in ties.items()]
        return Mux(backward & Cat(hits).any() if len(hits) > 1 else backward & hits[0], 0, entry)
