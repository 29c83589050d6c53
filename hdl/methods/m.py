"""The M method."""

from amaranth import Module, Mux, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.quotient import Quotient
from tachometry.hdl.methods.datapath import datapath_members, quotients, stamped
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box
from tachometry.hdl.wires.registers import registers
from tachometry.spec import MTachometer


class MovingSum(Box):
    """Sums the last n pulse numbers, the present one included.

    It is the difference of two totals modulo 2^sum_width: all counts up to now, and all counts up to n ticks ago. n
    ticks after an upset, both totals contain its error, which cancels. A running sum, from which the oldest number is
    subtracted when a new one is added, would keep the error for ever.

    Latency: none. What was counted before the first tick after reset is 0, whatever the memory still holds.
    """

    def __init__(self, length: int, *, count_width: int, sum_width: int) -> None:
        self._length = length
        super().__init__(
            tick=In(1),
            m_e=In(signed(count_width)),  # valid with `tick`
            total=Out(signed(sum_width)),  # valid with `tick`
        )

    def build(self, m: Module) -> None:
        if self._length == 1:
            m.d.comb += self.total.eq(self.m_e)
            return
        last = self._length - 1
        if last == 1:
            previous = Signal.like(self.m_e)
            with m.If(self.tick):
                m.d.sync += previous.eq(self.m_e)
            m.d.comb += self.total.eq(previous + self.m_e)
            return
        # All numbers up to the last tick, and up to this one.
        before = Signal.like(self.total)
        through = Signal.like(self.total)
        m.d.comb += [through.eq(before + self.m_e), self.total.eq(through - self._earlier(m, before, last))]
        with m.If(self.tick):
            m.d.sync += before.eq(through)

    def _earlier(self, m: Module, value: Signal, last: int) -> Value:
        """Return what `value` was `last` ticks ago, valid with `tick`."""
        m.submodules.past = memory = Memory(shape=value.shape(), depth=last, init=[])
        write = memory.write_port()
        read = memory.read_port()
        place = Signal(range(last))
        following = Signal(range(last))
        full = Signal()
        wrap = place >= last - 1
        m.d.comb += [
            following.eq(Mux(self.tick, Mux(wrap, 0, place + 1), place)),
            read.addr.eq(following),
            write.addr.eq(place),
            write.data.eq(value),
            write.en.eq(self.tick),
        ]
        m.d.sync += [place.eq(following), full.eq(full | (self.tick & wrap))]
        return Mux(full, read.data, 0)


class MMethod(Box):
    """M-method datapath, eq. (6) of Tsuji 2009: the mean of the last n pulse numbers, every tick.

    A mean over a power of two is a shift; otherwise the sum is multiplied by a constant, as in the S method, and
    correctly rounded like there.

    Latency: an update comes `spec.latency.datapath` clocks after `tick`. All of it is held until the next. Its bounds
    are those of one count more and less in n ticks, rounded outward; they are valid if the first tick is not in these.
    """

    def __init__(self, spec: MTachometer) -> None:
        super().__init__(datapath_members(spec))
        self._spec = spec
        # Verilog has no signals of no bits.
        tag = {**stamped(spec), **({"bounds_valid": 1} if spec.bounds else {})}
        self._tag = data.StructLayout(tag or {"forced": 1})
        self.moving_sum = MovingSum(spec.average, count_width=spec.widths.count, sum_width=spec.form.sum_width)
        self.quotient: Quotient | None = None
        if spec.form.shift is None:
            self.quotient = Quotient(
                spec.form.reciprocal,
                quotients=quotients(spec),
                numerator_width=spec.form.numerator_width,
                tag=self._tag,
                serial=spec.latency.serial,
                constant=spec.average,
            )

    @property
    def probes(self) -> dict[str, Value]:
        return {"sum": self.moving_sum.total}

    def build(self, m: Module) -> None:
        spec = self._spec
        m.submodules.moving_sum = moving_sum = self.moving_sum
        known = Signal(self._tag)
        m.d.comb += [
            moving_sum.tick.eq(self.tick),
            moving_sum.m_e.eq(self.pulse_count),
            self.updates.p.interval.eq(spec.average),
        ]
        if spec.widths.stamp:
            m.d.comb += known.stamp.eq(self.stamp)
        if spec.bounds:
            # The first tick was not seen completely.
            seen = Signal(range(spec.average + 1))
            with m.If(self.tick & (seen < spec.average)):
                m.d.sync += seen.eq(seen + 1)
            m.d.comb += known.bounds_valid.eq(seen >= spec.average)
        valid, new = self._divided(m, known)
        m.d.comb += self.updates.valid.eq(valid)
        m.d.comb += [self.updates.p[name].eq(new[name]) for name in new.shape().members]

    def _divided(self, m: Module, known: data.View) -> tuple[Signal, data.View]:
        """Return the mean and its bounds, with what is known of the sum."""
        total, shift = self.moving_sum.total, self._spec.form.shift
        if self.quotient is not None:
            m.submodules.quotient = quotient = self.quotient
            # The sum takes one clock.
            load, total = delay(m, self.tick, total)
            kept = Signal.like(known)
            with m.If(self.tick):
                m.d.sync += kept.eq(known)
            start, tag = delay(m, load, kept)
            m.d.comb += [
                quotient.load.eq(load),
                quotient.start.eq(start),
                quotient.numerator.eq(total << self._spec.bound.error_bits),
                quotient.tag.eq(tag),
            ]
            return quotient.results.valid, quotient.results.p
        assert shift is not None
        velocities, finer = quotients(self._spec), self._spec.bound.error_bits
        left = shift - finer
        valid = Signal()
        layout = {name: signed(width) for name, (width, _, _) in velocities.items()} | self._tag.members
        new = registers(data.StructLayout(layout), "new")
        m.d.sync += valid.eq(self.tick)
        with m.If(self.tick):
            m.d.sync += [
                new[name].eq(((total << finer) + margin) << left) for name, (_, _, margin) in velocities.items()
            ]
            m.d.sync += [new[name].eq(known[name]) for name in self._tag.members]
        return valid, new
