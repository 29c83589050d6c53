"""The low-pass filter for fluctuating measurement time."""

from contextlib import nullcontext
from typing import Any

from amaranth import Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.output.update import update_stream
from tachometry.hdl.output.update_age import UpdateAge
from tachometry.hdl.wires.ports import Box
from tachometry.hdl.wires.registers import registers
from tachometry.spec.formats import low_pass


class _Waiting:
    """Holds the update that waits, and the ticks since the one before."""

    def __init__(self, layout: Any, elapsed: UpdateAge) -> None:
        self.waiting = Signal()
        self.take = Signal()  # the filter begins with it
        self.following = registers(layout, "following", reset_less=True)
        self.interval = Signal.like(elapsed.age, reset_less=True)


class _Working:
    """Holds the signals of a product of y − u and a factor."""

    def __init__(self, spec: low_pass.LowPass, layout: Any) -> None:
        width = spec.native_width + spec.extra_bits
        self.working = Signal()
        self.adding = Signal()
        self.rounding = Signal()
        self.update = registers(layout, "update", reset_less=True)
        self.y = Signal(signed(width))  # in 2^−extra of an LSB
        self.d = Signal(signed(width + 1), reset_less=True)
        self.total = Signal.like(self.d, reset_less=True)
        self.factor = Signal(spec.factor_bits, reset_less=True)
        self.step = Signal(range(spec.factor_bits + 2), reset_less=True)
        self.second = Signal(reset_less=True)  # of two factors


class LowPass(Box):
    """y ← u + E·(y − u), E = e^(−G·m·T): eq. (22) of Tsuji 2009, with E from a table, multiplied by one bit per clock.

    m is the number of ticks since the update before, so that the overlap of two windows is not filtered twice.
    An update that comes while the filter works waits; one that comes while another waits takes its place and adds its
    ticks.

    Latency: an update is handed on `spec.latency` clocks after it comes, if the filter was at rest.

    - `layout`: Of an update; all of it but the velocity is handed on as it is.
    - `clears`: An update that `rests` is taken as it is, whatever its time.
    """

    def __init__(self, spec: low_pass.LowPass, layout: data.StructLayout, *, clears: bool = False) -> None:
        self._spec, self._clears = spec, clears
        super().__init__(
            tick=In(1),
            updates=In(update_stream(layout)),
            filtered=Out(update_stream(layout)),  # held until the next
        )

    def build(self, m: Module) -> None:
        layout = self.updates.p.shape()
        filtered = registers(layout, "filtered")
        m.d.comb += self.filtered.p.eq(filtered)

        # Ticks since the update before, including one in its clock.
        elapsed = UpdateAge(self._spec.max_interval)
        m.submodules.elapsed = elapsed
        m.d.comb += [elapsed.tick.eq(self.tick), elapsed.update.eq(self.updates.valid)]
        next_one = _Waiting(layout, elapsed)
        self._wait(m, next_one, elapsed)
        self._filter(m, next_one, filtered)

    def _wait(self, m: Module, next_one: _Waiting, elapsed: UpdateAge) -> None:
        """Keep the update that waits; one that comes meanwhile takes its place, and its ticks are added."""
        waiting, take, interval = next_one.waiting, next_one.take, next_one.interval
        with m.If(take):
            m.d.sync += waiting.eq(0)
        with m.If(self.updates.valid):
            m.d.sync += [
                waiting.eq(1),
                next_one.following.eq(self.updates.p),
                # No overflow: those that wait have come since the filter began, fewer clocks ago than it can count.
                interval.eq(elapsed.before + Mux(waiting & ~take, interval, 0)),
            ]

    def _filter(self, m: Module, next_one: _Waiting, filtered: Any) -> None:
        """Move the state towards the update, a bit of the factor a clock."""
        spec, at = self._spec, _Working(self._spec, self.updates.p.shape())
        extra, bits = spec.extra_bits, spec.factor_bits
        take, following, step, total = next_one.take, next_one.following, at.step, at.total
        clear = following.rests if self._clears else Const(0)
        low, *high = self._factors(m, take, next_one.interval)
        last = step == bits + 1
        m.d.comb += take.eq(next_one.waiting & ~at.working & ~at.adding)
        addend = Mux(at.factor[0], at.d, 0)
        m.d.sync += [
            step.eq(step + 1),
            at.factor.eq(at.factor >> 1),
            # The last addition rounds.
            total.eq((Cat(step == bits, total).as_signed() + Cat(step == bits, addend).as_signed()) >> 2),
            at.adding.eq(at.working & last & (at.second if high else 1)),
            at.rounding.eq(at.adding),
            self.filtered.valid.eq(at.rounding),
        ]
        with m.If(step == 0):
            m.d.sync += [at.factor.eq(Mux(at.second, high[0], low) if high else low), total.eq(0)]
        with m.If(last):
            m.d.sync += [step.eq(0), at.d.eq(total), at.second.eq(1)]
            with m.If(at.second) if high else nullcontext():
                m.d.sync += at.working.eq(0)
        with m.If(take):
            m.d.sync += [
                at.working.eq(1),
                step.eq(0),
                at.second.eq(0),
                at.update.eq(following),
                at.d.eq(Mux(clear, 0, at.y - (following.velocity << extra))),
            ]
        with m.If(at.adding):
            m.d.sync += at.y.eq((at.update.velocity << extra) + at.d)
        with m.If(at.rounding):
            m.d.sync += [filtered.eq(at.update), filtered.velocity.eq((at.y + (1 << (extra - 1))) >> extra)]

    def _factors(self, m: Module, take: Signal, interval: Signal) -> list[Signal]:
        """Return E of each table, valid in the clock after `take` and held until the next."""
        found, split = [], self._spec.low_bits
        places = interval[:split], interval[split:]
        for name, table, place in zip(("low", "high"), self._spec.tables, places, strict=False):
            m.submodules[name] = memory = Memory(shape=self._spec.factor_bits, depth=len(table), init=table)
            read = memory.read_port()
            m.d.comb += [read.addr.eq(place), read.en.eq(take)]
            found.append(read.data)
        return found
