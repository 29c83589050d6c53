"""The M method."""

from typing import Any

from amaranth import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.scaler import PipelinedScaler, SerialScaler
from tachometry.hdl.output.members import tick_members, update_members
from tachometry.spec import MTachometer
from tachometry.spec.tachometer import BOUNDS


class MovingSum(wiring.Component):
    """Sum of the last n pulse numbers, the present one included.

    It is a difference of what had been counted in all up to now and n ticks ago, modulo 2^sum_width: n ticks after an
    upset, both have it. A sum from which the oldest number is taken when a new one is added would keep it for ever.

    Latency: none. What was counted before the first tick after reset is 0, whatever the memory still holds.

    Parameters
    ----------
    length : int
        n.
    count_width, sum_width : int
        Bits of a pulse number and of the sum, both signed.

    Members
    -------
    tick : In(1)
    m_e : In(signed(count_width))
        Valid with `tick`.
    total : Out(signed(sum_width))
        Valid with `tick`.
    empty : Out(1)
        None of the n ticks counted anything; valid with `tick`.
    """

    def __init__(self, length: int, *, count_width: int, sum_width: int) -> None:
        self._length = length
        super().__init__(
            {
                "tick": In(1),
                "m_e": In(signed(count_width)),
                "total": Out(signed(sum_width)),
                "empty": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        if self._length == 1:
            m.d.comb += [self.total.eq(self.m_e), self.empty.eq(~self.m_e.any())]
            return m
        last = self._length - 1
        quiet = Signal(range(self._length), init=last)
        m.d.comb += self.empty.eq(~self.m_e.any() & (quiet >= last))
        with m.If(self.tick):
            with m.If(self.m_e.any()):
                m.d.sync += quiet.eq(0)
            with m.Elif(quiet < last):
                m.d.sync += quiet.eq(quiet + 1)
        if last == 1:
            previous = Signal.like(self.m_e)
            with m.If(self.tick):
                m.d.sync += previous.eq(self.m_e)
            m.d.comb += self.total.eq(previous + self.m_e)
            return m
        # All numbers up to the last tick, and up to this one.
        before, through = Signal.like(self.total), Signal.like(self.total)
        m.d.comb += [through.eq(before + self.m_e), self.total.eq(through - self._earlier(m, before, last))]
        with m.If(self.tick):
            m.d.sync += before.eq(through)
        return m

    def _earlier(self, m: Module, value: Signal, last: int) -> Value:
        """What `value` was `last` ticks ago, valid with `tick`."""
        m.submodules.past = memory = Memory(shape=value.shape(), depth=last, init=[])
        write, read = memory.write_port(), memory.read_port()
        place, following, full = Signal(range(last)), Signal(range(last)), Signal()
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


class MMethod(wiring.Component):
    """M-method datapath, eq. (6) of Tsuji 2009: the mean of the last n pulse numbers, every tick.

    A mean over a power of two is a shift; otherwise the sum is multiplied by a constant, step by step, as in the
    S method's scaler, and correctly rounded like there.

    Latency: `velocity_valid` is high `spec.datapath_latency` clocks after `tick`.

    Parameters
    ----------
    spec : MTachometer

    Members
    -------
    tick : In(1)
    pulse_count : In(signed)
        m_e, valid with `tick`.
    velocity : Out(signed)
        In counts per tick with `native_frac_bits` fraction bits; this and all below are held until the next update.
    velocity_valid : Out(1)
    interval : Out
        n.
    forced : Out(1)
        Never.
    stalled : Out(1)
        None of the n ticks counted anything.
    velocity_lower, velocity_upper, bounds_valid : Out
        With `spec.bounds`: one count more and less in n ticks, rounded outward; valid when none of them is the first.
    """

    def __init__(self, spec: MTachometer) -> None:
        super().__init__(tick_members(spec) | update_members(spec))
        self._spec = spec
        self.moving_sum = MovingSum(spec.average, count_width=spec.count_width, sum_width=spec.sum_width)
        self.scaler: Any = None
        self.bound_scalers: dict[str, Any] = {}
        if spec.shift is None:
            scaler = SerialScaler if spec.serial else PipelinedScaler
            shape = {"numerator_width": spec.numerator_width, "tag_width": 1 + spec.bounds}
            self.scaler = scaler(spec.reciprocal, base_width=spec.count_width, **shape)
            if spec.bounds:
                base_width = spec.bound_width - spec.native_frac_bits
                self.bound_scalers = {
                    name: scaler(spec.reciprocal, base_width=base_width, towards=towards, **shape)
                    for name, towards in BOUNDS.items()
                }

    @property
    def probes(self) -> dict[str, Value]:
        """What a waveform should show of the inside."""
        return {"sum": self.moving_sum.total}

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._spec
        m.submodules.moving_sum = moving_sum = self.moving_sum
        m.d.comb += [
            moving_sum.tick.eq(self.tick),
            moving_sum.m_e.eq(self.pulse_count),
            self.interval.eq(spec.average),
        ]
        known, tags = [moving_sum.empty], [self.stalled]
        if spec.bounds:
            # Of the first tick not all was seen.
            seen = Signal(range(spec.average + 1))
            with m.If(self.tick & (seen < spec.average)):
                m.d.sync += seen.eq(seen + 1)
            known.append(seen >= spec.average)
            tags.append(self.bounds_valid)
        bounds = BOUNDS if spec.bounds else {}
        if self.scaler is None:
            m.d.sync += self.velocity_valid.eq(self.tick)
            with m.If(self.tick):
                m.d.sync += [self.velocity.eq(moving_sum.total << spec.shift), Cat(tags).eq(Cat(known))]
                m.d.sync += [
                    getattr(self, name).eq((moving_sum.total + one) << spec.shift) for name, one in bounds.items()
                ]
            return m
        # The sum has a clock of its own, then the scalers begin.
        start, total, tag = Signal(), Signal.like(moving_sum.total), Signal(len(known))
        m.d.sync += [start.eq(self.tick), total.eq(moving_sum.total), tag.eq(Cat(known))]
        for name, box in {"velocity": self.scaler, **self.bound_scalers}.items():
            m.submodules[name if name in bounds else "scaler"] = box
            m.d.comb += [
                Cat(box.load, box.start).eq(start.replicate(2)),
                box.numerator.eq(total + bounds.get(name, 0)),
                box.tag.eq(tag),
                box.q.eq(spec.reciprocal.value(spec.average)),
                getattr(self, name).eq(box.velocity),
            ]
        m.d.comb += [self.velocity_valid.eq(self.scaler.done), Cat(tags).eq(self.scaler.tag_out)]
        return m
