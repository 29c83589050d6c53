"""From the native velocity to the one that the user wants: its unit, its LSB, its width.

Both boxes form ⌊(v·multiplier + 2^(shift−1)) / 2^shift⌋, which spec/formats/velocity_output.py shows to be within 0.7
LSB, and hold it within bounds. The multiplier is a constant, taken from its lowest bit; bits below the point are
dropped after each addition, which does not change the floor. One box adds v for one bit per clock. The other has an
adder for each digit of the multiplier's canonical form, and accepts any update rate.
"""

from amaranth import Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.output.update import VELOCITIES, shown_layout, update_stream
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box
from tachometry.hdl.wires.registers import registers
from tachometry.spec.formats import velocity_output


class _VelocityOutput(Box):
    """Holds the parts that both share.

    - `layout`: Of an update in counts per tick. All its velocities become those of the unit, bounds rounded outward;
      the rest is handed on as it is.
    """

    def __init__(self, output: velocity_output.VelocityOutput, layout: data.StructLayout) -> None:
        self._output = output
        # What rounds each velocity.
        self._rounding = {
            name: output.rounding(towards) for name, towards in VELOCITIES.items() if name in layout.members
        }
        super().__init__(
            updates=In(update_stream(layout)),  # an update stays until the next
            # The update in the unit of the output, with `velocity_overflow`; held until the next.
            shown=Out(update_stream(shown_layout(layout, output))),
        )

    def _show(self, m: Module, update: data.View, totals: dict[str, Value]) -> data.View:
        """Return what the outputs take: each velocity from its total, and the rest of the update."""
        shown = registers(self.shown.p.shape(), "taken")
        for name, total in totals.items():
            rounded = Signal.like(total, name=f"rounded_{name}")
            m.d.comb += rounded.eq(total)
            velocity, overflow = rounded, Const(0)
            if self._output.limit < self._output.greatest:
                velocity, overflow = saturate(m, rounded, self._output.limit)
            m.d.comb += shown[name].eq(velocity)
            if name == "velocity":
                m.d.comb += shown.velocity_overflow.eq(overflow)
        m.d.comb += [shown[name].eq(update[name]) for name in update.shape().members if name not in totals]
        return shown


class SerialVelocityOutput(_VelocityOutput):
    """Takes a bit of the multiplier a clock.

    Latency: an update is shown as many clocks after it comes as the multiplier has bits, and three more; the next may
    come then.
    """

    def build(self, m: Module) -> None:
        output, update = self._output, self.updates.p
        bits = output.multiplier.bit_length()
        running = Signal()
        rounding = Signal()
        complete = Signal()
        step = Signal(range(bits + 1), reset_less=True)
        bit = Signal(reset_less=True)
        with m.If(running):
            m.d.sync += step.eq(step + 1)
        m.d.sync += [
            bit.eq(Const(output.multiplier >> 1, bits + 1).bit_select(step, 1)),
            rounding.eq(running & (step == bits - 1)),
            complete.eq(rounding),
            self.shown.valid.eq(complete),
        ]
        with m.If(rounding):
            m.d.sync += running.eq(0)
        with m.If(self.updates.valid):
            m.d.sync += [running.eq(1), step.eq(0), bit.eq(output.multiplier & 1)]
        totals = {}
        for name, half in self._rounding.items():
            native = update[name]
            # The low bits of what rounds are there from the start, as bits of the product are dropped on the way.
            high, low = half >> bits, half & ((1 << bits) - 1)
            total = Signal(signed(max(len(native), bits) + 1), name=f"total_{name}", reset_less=True)
            addend = Signal.like(native, name=f"addend_{name}")
            m.d.comb += addend.eq(Mux(rounding, high, Mux(bit, native, 0)))
            m.d.sync += total.eq((total + addend) >> 1)
            with m.If(self.updates.valid):
                m.d.sync += total.eq(low)
            totals[name] = total >> (output.shift - bits - 1)
        shown = self._show(m, update, totals)
        new = registers(self.shown.p.shape(), "new")
        m.d.comb += self.shown.p.eq(new)
        with m.If(complete):
            m.d.sync += new.eq(shown)


class PipelinedVelocityOutput(_VelocityOutput):
    """Has an adder for every digit of the multiplier: there may be an update in every clock.

    Latency: an update is shown a clock after it comes for every digit but the first, one to round (if anything is to be
    rounded), and one to hold.
    """

    def build(self, m: Module) -> None:
        valid, update = self.updates.valid, self.updates.p
        (place, sign), *others = self._output.digits
        totals, widths = {}, {}
        for name, half in self._rounding.items():
            low = half & ((1 << self._output.digits[-1][0]) - 1)
            widths[name] = max(len(update[name]), low.bit_length()) + 2
            totals[name] = (update[name] if sign > 0 else -update[name]) + low
        for next_place, digit in others:
            gap = next_place - place
            for name, total in totals.items():
                native = update[name]
                sum_ = total + (native << gap) if digit > 0 else total - (native << gap)
                totals[name] = (sum_ >> gap)[: widths[name]].as_signed()
            valid, update, *delayed = delay(m, valid, update, *totals.values())
            totals = dict(zip(totals, delayed, strict=True))
            place = next_place
        left = self._output.shift - place
        if left:
            for name, half in self._rounding.items():
                totals[name] = ((totals[name] + (half >> place)) >> left).as_signed()
            valid, update, *delayed = delay(m, valid, update, *totals.values())
            totals = dict(zip(totals, delayed, strict=True))
        # As long as an update stays, so does what becomes of it.
        new = registers(self.shown.p.shape(), "new")
        m.d.comb += self.shown.p.eq(new)
        m.d.sync += [self.shown.valid.eq(valid), new.eq(self._show(m, update, totals))]
