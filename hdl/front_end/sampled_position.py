"""Positions that are read once a tick, in place of a decoder and its counters."""

from amaranth import C, Cat, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.front_end.modulo_counter import ModuloCounter
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, by_name, drive, only_if
from tachometry.spec import TachometerSpec
from tachometry.spec.core.sampled import Reach


class SampledPosition(Box):
    """Takes the last good read of each tick: gives the position, and its difference from the read before as m_e.

    Latency: `tick` is high `spec.latency.place` clocks after the window's last clock; a read in that last clock still
    belongs to the window. All outputs but `coming`, `decode_error` and `refused` change with `tick`.

    The lower bits of the position are the read; the upper ones count how often that wraps. `zero` is subtracted. `load`
    makes the position `value` in the next clock; while no read is known, it is left out.
    """

    def __init__(self, spec: TachometerSpec) -> None:
        sampled = spec.encoder.sampled
        assert sampled is not None
        longest = spec.tick.longest
        self._spec, self._sampled, self._most_age = spec, sampled, sampled.most_age(longest)
        count, place = signed(spec.widths.count), signed(spec.position_width)
        self._zeroed, self._loads = spec.encoder.zero is not None, spec.preset is not None
        super().__init__(
            **{port.name: In(port.width) for port in sampled.ports(longest)},
            last=In(1),  # high in the last clock of a window
            **only_if(self._zeroed, zero=In(place, init=spec.encoder.zero or 0)),
            **only_if(self._loads, load=In(1), value=In(place, init=spec.preset or 0)),
            tick=Out(1),
            pulse_count=Out(count),  # counts since the read before; 0 without a read, or without one before
            overflow=Out(1),  # it was saturated
            coming=Out(1),  # `tick` is high in the next clock
            position=Out(place),
            position_valid=Out(1),
            decode_error=Out(1),  # a read is not taken
            number=Out(1),  # of reads that were taken in the tick: the last one, or none
            times=Out(range(self._most_age + longest)),  # clocks from when the shaft was there to its end
            length=Out(range(longest + 1), init=spec.timing.tick_cycles),  # clocks of the tick
            phase=Out(sampled.width),  # the read
            silent=Out(range(spec.timing.max_ticks + 1), init=spec.timing.max_ticks),  # ticks since a read
            forgets=Out(1),  # tracking begins anew after the tick
            refused=Out(1),  # a read is not taken, as it is too far from the one before
            elapsed=Out(range(spec.timing.max_ticks + 1), init=spec.timing.max_ticks),  # from the read before
        )
        self.place = Signal(place, name="place") if self._loads else self.position  # which no load changes
        # Of the window that has not ended.
        self.open_number = Signal()
        self.open_sample = Signal(sampled.width)
        self.open_times = Signal.like(self.times)  # from the strobe of the read
        self.sample_before = Signal(sampled.width)
        self.spent = 0 if spec.reach is None else spec.reach.clocks  # on the check of a read
        self.checks = Signal(self.spent)  # its clock
        self.anew = Signal()  # all that was known is not: a read of the window is far from those before it
        self.turns = Signal(signed(max(spec.position_width - sampled.width, 1)))
        self.around = Signal(signed(spec.remainder.width if spec.remainder else 1))  # has the remainder of the position

    def build(self, m: Module) -> None:
        sampled = self._sampled
        age = by_name(self, ("sample_age",))["sample_age"] if sampled.age is None else sampled.age
        good = Signal()
        open_age = Signal.like(self.times, init=0)  # added late: a load of `open_times` would cost many cells
        read = Signal(sampled.width)
        young = 1 if sampled.age is not None else age <= self._most_age
        m.d.comb += [
            read.eq(-self.sample if self._spec.encoder.reverse else self.sample),
            good.eq(self.sample_valid & self.sample_ok & young & ~self.checks.any()),
            self.decode_error.eq((self.sample_valid & ~good) | self.refused),
            self.coming.eq(*delay(m, self.last, clocks=self._spec.latency.place - 1)),
        ]
        m.d.sync += [self.tick.eq(self.coming), self.open_times.eq(self.open_times + 1)]
        with m.If(self.coming):
            m.d.sync += [self.open_number.eq(0), self.anew.eq(0), self.forgets.eq(self.anew)]
        taken: Value = good
        if (reach := self._spec.reach) is not None:
            values = {"read": read} | ({} if sampled.age is not None else {"age": age})
            late = {name: Signal.like(value, name=f"{name}_late") for name, value in values.items()}
            with m.If(good):
                m.d.sync += [late[name].eq(value) for name, value in values.items()]
            read, age = late["read"], late.get("age", age)
            taken = self._find_jumps(m, reach, good, read)
        with m.If(taken):
            m.d.sync += [self.open_number.eq(1), self.open_sample.eq(read), self.open_times.eq(0), open_age.eq(age)]
        if self._spec.external_tick:
            length = Signal.like(self.length, name="open_length", init=1)
            m.d.sync += length.eq(length + 1)
            with m.If(self.coming):
                m.d.sync += [self.length.eq(length), length.eq(1)]
        self._close(m, open_age)

    def _find_jumps(self, m: Module, reach: Reach, good: Value, read: Value) -> Value:
        """Refuse a good read out of reach of the last one, unless it is within reach of one that was just refused.

        Return whether it is taken, in the last clock of its check.
        """
        held = Signal()  # a read has been taken
        before = Signal(reach.width)  # the good read before, taken or not
        value = Signal(reach.bits, init=reach.first)  # so its load is a reset of registers, which takes no cell
        way = Signal(signed(reach.width))
        far = Signal(2)  # from the read before, and from the one that was taken
        taken = Signal()
        size = Cat(way[-1], (way ^ way[-1].replicate(reach.width))[:-1])
        m.d.comb += [
            way.eq(read - Mux(self.checks[0], self.open_sample, before)),
            self.refused.eq(self.checks[-1] & held & far.all()),
            taken.eq(self.checks[-1] & ~self.refused),
        ]
        m.d.sync += [
            self.checks.eq(Cat(good, self.checks)),
            far.eq(Cat(Cat(C(0, 1), value[reach.frac_bits :]) < size, far)),
        ]
        with m.If(~value[-1]):
            m.d.sync += value.eq(value + reach.step)
        with m.If(taken):
            m.d.sync += [held.eq(1), value.eq(reach.first)]
        with m.If(self.checks[-1]):
            m.d.sync += before.eq(read)
            with m.If(held & far[1] & ~far[0]):
                m.d.sync += self.anew.eq(1)
        return taken

    def _close(self, m: Module, open_age: Value) -> None:
        """Take the read of a window that has ended."""
        width, most_ticks = self._sampled.width, self._spec.timing.max_ticks
        known = self.position_valid & self.open_number & ~self.anew
        off = Signal(width + 1)
        moved = Signal(signed(width))
        m.d.comb += [
            off.eq(self.open_sample - self.sample_before),
            moved.eq(off),
            self.position_valid.eq(self.silent != most_ticks),
            self.phase.eq(self.sample_before),
        ]
        form = self._spec.remainder
        rounds = None if form is None else ModuloCounter(form.turns, latency=1)
        self._place(m, rounds)
        held, overflow = saturate(m, moved, self._spec.widths.max_pulse_count)
        waited = self.silent + self.position_valid
        turn = Signal(signed(2))  # how the read has wrapped
        m.d.comb += turn.eq(Cat(off[-1] ^ off[width - 1], ~off[-1] & off[width - 1]))
        if rounds is not None:
            m.submodules.rounds = rounds
            begins = self.coming & self.open_number & ~known
            drive(m, rounds, {"step": Mux(self.coming, turn, 0), "clear": begins})
        with m.If(self.coming):
            m.d.sync += [
                self.pulse_count.eq(held),
                self.overflow.eq(overflow),
                self.number.eq(self.open_number),
                self.times.eq(self.open_times + open_age),
                self.elapsed.eq(waited),
                self.silent.eq(Mux(self.open_number, 0, waited)),
            ]
            with m.If(~known):
                m.d.sync += [self.pulse_count.eq(0), self.overflow.eq(0)]
            with m.If(self.open_number):
                m.d.sync += [
                    self.sample_before.eq(self.open_sample),
                    self.turns.eq(Mux(known, self.turns + turn, 0)),
                ]

    def _place(self, m: Module, rounds: ModuloCounter | None) -> None:
        """Drive the position: the read with its turns, minus zero and preset."""
        whole = Cat(self.sample_before, self.turns)
        around = Cat(self.sample_before, () if rounds is None else rounds.count)
        if self._zeroed:
            zero = Signal.like(self.zero, name="zero_before")
            with m.If(self.coming):
                m.d.sync += zero.eq(self.zero)
            whole, around = whole - zero, around - zero
        m.d.comb += self.place.eq(whole)
        if rounds is not None:
            m.d.comb += self.around.eq(around)
        if self._loads:
            ahead = Signal.like(self.place)
            with m.If(self.load & self.position_valid):
                m.d.sync += ahead.eq(self.place - self.value)
            m.d.comb += self.position.eq(self.place - ahead)
