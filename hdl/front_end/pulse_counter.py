"""A counter finds m_e, the pulse number of a tick."""

from amaranth import Const, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.saturate import raised_for, saturate_raised
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, only_if


class PulseCounter(Box):
    """Adds up the steps of a tick: m_e of Tsuji 2009, Sec. IV-A.

    Latency: `tick` is high two clocks after the window's last clock, or four. A step in the clock of the hand-over
    belongs to the next window; none is lost.

    - `tick_cycles`: Most steps in a window.
    - `max_count`: Bound of |m_e|; beyond it m_e saturates.
    - `stretched`: Windows may be longer, and hold any number of steps: once their sum has left ±`max_count`, m_e is
      saturated, whatever comes after.
    - `staged`: A register for the step, and one for the sum that has been held within its bound, so that `next_count`
      comes from a register, and `tick` two clocks later.

    It raises ValueError if `max_count` is not in 1 … `tick_cycles`.
    """

    def __init__(self, tick_cycles: int, max_count: int, *, stretched: bool = False, staged: bool = False) -> None:
        if not 1 <= max_count <= tick_cycles:
            raise ValueError(f"max_count must be from 1 to {tick_cycles}, not {max_count}")
        self._tick_cycles, self._max_count, self._stretched, self._staged = tick_cycles, max_count, stretched, staged
        count = signed(max_count.bit_length() + 1)
        super().__init__(
            step=In(signed(2)),
            last=In(1),  # high in the last clock of a window
            **only_if(stretched, beyond=In(1)),  # with `last`: `overflow` is to be raised for this window anyway
            tick=Out(1),  # one clock, when `pulse_count` is new
            pulse_count=Out(count),  # m_e, held until the next tick
            overflow=Out(1),  # m_e was saturated; held as long as m_e
            coming=Out(1),  # `tick` is high in the next clock
            next_count=Out(count),  # what `pulse_count` is then; valid with `coming`
            # Sum of the steps after the latest `tick`'s window, up to the clock before; if staged, up to two clocks
            # before that.
            **only_if(not stretched, open_sum=Out(signed(tick_cycles.bit_length() + 1))),
        )

    def build(self, m: Module) -> None:
        most = self._max_count + 1 if self._stretched else self._tick_cycles
        start = 0 if self._stretched else raised_for(self._tick_cycles, self._max_count)
        count = Signal(signed(most.bit_length() + 1))
        raised = count
        if start:
            raised = Signal(signed((most + start).bit_length() + 1), init=start)
            m.d.comb += count.eq(raised - start)
        step = Signal.like(count)
        complete = Signal()
        new, last = delay(m, self.step, self.last, clocks=int(self._staged))
        m.d.comb += step.eq(new)
        m.d.sync += [complete.eq(last), self.tick.eq(self.coming), raised.eq(raised + step)]
        held: Value = count
        overflow: Value = Const(0)
        if self._stretched:
            held, overflow = self._stay(m, count, step, complete)
        elif start:
            held, overflow = saturate_raised(m, raised, self._max_count)
        fresh: Value = step + start if start else step
        with m.If(complete):
            m.d.sync += raised.eq(fresh)
        coming: Value = complete
        open_sum: Value = count
        if self._staged:
            coming, open_sum, held, overflow = delay(m, complete, count, held, overflow)
        if not self._stretched:
            m.d.comb += self.open_sum.eq(open_sum)
        m.d.comb += [self.coming.eq(coming), self.next_count.eq(held)]
        with m.If(coming):
            m.d.sync += [self.pulse_count.eq(held), self.overflow.eq(overflow)]

    def _stay(self, m: Module, count: Signal, step: Signal, complete: Signal) -> tuple[Value, Value]:
        """Let the sum stay beyond its bound, which a register knows, so that nothing waits for a comparison."""
        left = Signal()
        beyond = Signal()
        with m.If(step[0] & (count == Mux(step[-1], -self._max_count, self._max_count))):
            m.d.sync += left.eq(1)
        with m.If(left):
            m.d.sync += count.eq(count)
        with m.If(complete):
            m.d.sync += left.eq(0)
        m.d.sync += beyond.eq(self.beyond)
        return Mux(left, Mux(count[-1], -self._max_count, self._max_count), count), left | beyond
