"""The counters of Rairán 2013, Table 1."""

from collections.abc import Callable

from amaranth import Const, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.methods.dt_shift import DtShift
from tachometry.hdl.wires.ports import Box, only_if
from tachometry.spec import RairanTachometer


class RairanCounters(Box):
    """Table 1 of Rairán 2013 at every clock: Cep, Cdt, the clock of dt, and what they make of Nep1 and Ndt1.

    Latency: `update` is high in the clock after the count, or the end of dt, that causes it.
    """

    def __init__(self, spec: RairanTachometer) -> None:
        self._spec = spec
        ratio = spec.method_ports if spec.paper_exact else ()
        super().__init__(
            step=In(signed(2)),
            last=Out(1),  # high in the clock in which dt ends; without latency
            beyond=Out(1),  # there were more counts in this dt than Cep can hold; valid with `last`
            update=Out(1),  # a new estimate, or an old one found too large
            # Ndt1, or Nep1 − 1 if `high`; 0 stands for the velocity 0. As all below, held until the next update.
            n=Out(range(max(spec.widths.max_pulse_count, spec.timing.max_ticks) + 1)),
            high=Out(1),  # the regime
            backward=Out(1),
            forced=Out(1),  # the last update came without a count
            at_rest=Out(1),  # and at the maximum time
            # Nep1 and Ndt1 as they are before anything has come.
            **{port.name: Out(port.width, init=int(port.name == "n_dt1")) for port in ratio},
            **only_if(spec.adaptive, shift=Out(range(spec.times.max_tick_shift + 1))),  # n is that of dt·2^shift
            **only_if(spec.bounds, loose=Out(1)),  # n implies no least speed
            **only_if(spec.bounds, unsynced=Out(1)),  # its measurement did not begin in step with dt
        )
        # Cep − 1, and whether there is any.
        self.c_more = Signal(range(max(spec.widths.max_pulse_count, 2)))
        self.any = Signal()
        self.c_dt = Signal(range(spec.timing.max_ticks + 1))
        self.rest = Signal()  # it has come to its end
        self.longest = Signal()
        self.dt = DtShift(spec, len(self.n)) if spec.adaptive else None

    def build(self, m: Module) -> None:
        pulse = Signal()
        opens = Signal()
        exact = self._spec.paper_exact
        late = Signal(init=not exact)  # dt has ended since the last count, Cdt ≠ 0, or there was none
        due = self._clock(m, opens)
        if self.dt is not None:
            m.submodules.dt = self.dt
            m.d.comb += [self.dt.nominal.eq(due), self.dt.opens.eq(opens)]
            due = self.dt.last
        m.d.comb += pulse.eq(self.step.any())
        self._count(m, pulse, opens)
        if exact:
            # A count at the end of dt is in neither window.
            m.d.comb += [opens.eq(pulse & late), self.last.eq(due & ~opens)]
            with m.If(self.last):
                m.d.sync += late.eq(1)
            with m.Elif(pulse):
                m.d.sync += late.eq(0)
            self._update_to_the_letter(m, opens)
            return
        self._count_windows(m, pulse, opens, late, due)

    def _count_windows(self, m: Module, pulse: Signal, opens: Signal, late: Signal, due: Value) -> None:
        """Open a window at the first count after dt, and at one of the other sign."""
        moved = Signal()
        turns = Signal()
        fresh = Signal()  # the first count after reset or rest
        m.d.comb += [
            fresh.eq(pulse & (~moved | self.rest)),
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
            m.d.comb += [
                self.dt.anew.eq(turns | fresh),
                self.dt.high.eq(Mux(late, stays, several)),
                self.dt.n.eq(measured),
            ]
        self._update(m, pulse=pulse, opens=opens, turns=turns, fresh=fresh)

    def _of_dt(self, constant: Callable[[int], int]) -> Value | int:
        """Return a constant that depends on k of dt·2^k."""
        return constant(0) if self.dt is None else self.dt.of(constant)

    def _clock(self, m: Module, opens: Signal) -> Value:
        """Count the clocks of dt, which each new window restarts; whether dt is over."""
        cycles = self._spec.timing.tick_cycles
        if cycles == 1:
            return Const(1)
        # Counts down to −1, as the sampling clock does.
        start = cycles - 2
        # The first step comes a clock after the reset.
        left = Signal(signed((start + 1).bit_length() + 1), init=start + self._spec.latency.registers_steps)
        m.d.sync += left.eq(left - Const(1, left.shape()))
        with m.If(left[-1] | opens):
            m.d.sync += left.eq(start)
        return left[-1]

    def _count(self, m: Module, pulse: Signal, opens: Signal) -> None:
        """Count Cep, which includes the count that opens a window, and Cdt since the last count."""
        c_more, c_dt, most = self.c_more, self.c_dt, self._spec.tick.max_count
        # Whether Cdt reaches the maximum time with this end of dt, or has reached it before.
        full_dt = self._at_end(m, self._is(self._spec.form.max_dt))
        m.d.comb += self.longest.eq(self._at_end(m, self._is(lambda k: self._spec.form.max_dt(k) - 1)) | full_dt)
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
            m.d.sync += self.rest.eq(self.longest)
            with m.If(~full_dt):
                m.d.sync += c_dt.eq(c_dt + 1)
        with m.If(opens):
            m.d.sync += [c_more.eq(0), self.any.eq(1), self.beyond.eq(0)]
        with m.If(pulse & ~self.last if self._spec.paper_exact else pulse):
            m.d.sync += [c_dt.eq(0), self.rest.eq(0)]

    def _at_end(self, m: Module, value: Value) -> Value:
        """Return a condition, asked at an end of dt without a count, from a register.

        What it depends on has then been the same for a clock at least: another end of dt, or a count that opened a
        window, is a dt ago; and a count that opens none finds and leaves a Cdt of 0, and makes several of one.
        """
        if self._spec.timing.tick_cycles == 1:
            return value
        held = Signal()
        m.d.sync += held.eq(value)
        return held

    def _is(self, constant: Callable[[int], int]) -> Value:
        """Return whether Cdt equals a constant that depends on k of dt·2^k."""
        return self.c_dt == self._of_dt(constant)

    def _update(self, m: Module, *, pulse: Signal, opens: Signal, turns: Signal, fresh: Signal) -> None:
        """Update the estimate at a count or at the end of dt."""
        spec = self._spec
        several, one = self.c_more.any(), self.any
        in_step = Signal()  # the last count opened its window
        waits = Signal()  # dt ends without a count
        with m.If(pulse):
            m.d.sync += in_step.eq(opens)
        waited = self.c_dt + in_step
        m.d.comb += waits.eq(self.last & ~pulse)
        n: Value = self.n
        if self.dt is not None:
            # n is that of the window before, whose k may be one more or less, until this one has measured.
            differs = (self.shift - self.dt.shift)[:2]
            n = Mux(differs[0], Mux(differs[1], n >> 1, n << 1), n)
        # A carry tells whether `waited` is more than n.
        bits = len(self.c_dt)
        more = (self.c_dt + ~n[:bits] + in_step)[bits] & ~n[bits:].any()
        falls = self._at_end(m, Mux(self.high, waited.any(), more & self.n.any()) if spec.bound_decay else Const(0))

        m.d.sync += self.update.eq(0)
        with m.If(turns):
            self._set(m, 0)
        with m.Elif(self.last & several):
            self._set(m, self.c_more, high=1)
        with m.Elif(self.last & (pulse | (one & self.high))):
            # Ndt1 ← 1 by a count just at the end of dt, or Nep1 ← 1.
            self._set(m, 1, loose=~pulse)
        with m.Elif(opens & ~fresh & ((self.c_dt != 1) | ~self.high)):
            self._set(m, self.c_dt, unsynced=~in_step)
        with m.Elif(waits & self.longest):
            # At rest no update would correct it after an upset.
            self._set(m, 0, update=~self.rest, forced=1, at_rest=1)
        if spec.bound_decay:
            with m.Elif(waits & falls):
                self._set(m, waited, forced=1, loose=1)

    def _set(self, m: Module, n: Value | int, **flags: Value | int) -> None:
        """Set the estimate, its flags, and `update` unless that is given; what is not given becomes 0."""
        if self.dt is not None:
            m.d.sync += self.shift.eq(self.dt.shift)
        if self._spec.bounds:
            m.d.sync += [self.loose.eq(flags.get("loose", 0)), self.unsynced.eq(flags.get("unsynced", 0))]
        m.d.sync += [
            self.update.eq(flags.get("update", 1)),
            self.n.eq(n),
            self.high.eq(flags.get("high", 0)),
            self.forced.eq(flags.get("forced", 0)),
            self.at_rest.eq(flags.get("at_rest", 0)),
        ]

    def _update_to_the_letter(self, m: Module, opens: Signal) -> None:
        """Follow lines 5 to 9 of Table 1."""
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
