"""m_e, the pulse number of a tick."""

from amaranth import Const, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


def saturate(m: Module, value: Signal, limit: int) -> tuple[Signal, Signal]:
    """`value` held within −limit … +limit, and a flag that is high where that changed it."""
    held = Signal(signed(limit.bit_length() + 1))
    changed = Signal()
    above, below = Signal(), Signal()
    m.d.comb += [
        above.eq(value > Const(limit, value.shape())),
        below.eq(value < Const(-limit, value.shape())),
        held.eq(Mux(above, limit, Mux(below, -limit, value))),
        changed.eq(above | below),
    ]
    return held, changed


class PulseCounter(wiring.Component):
    """Adds up the steps of a tick: m_e of Tsuji 2009, Sec. IV-A.

    Latency: `tick` is high two clocks after the window's last clock. A step in the clock of the hand-over belongs to
    the next window; none is lost.

    Parameters
    ----------
    tick_cycles : int
        Most steps in a window.
    max_count : int
        Bound of |m_e|; beyond it m_e saturates.

    Members
    -------
    step : In(signed(2))
    last : In(1)
        High in the last clock of a window.
    tick : Out(1)
        One clock, when `pulse_count` is new.
    pulse_count : Out(signed)
        m_e, held until the next tick.
    overflow : Out(1)
        m_e was saturated; held as long as m_e.

    Raises
    ------
    ValueError
        If `max_count` is not in 1 … `tick_cycles`.
    """

    def __init__(self, tick_cycles: int, max_count: int) -> None:
        if not 1 <= max_count <= tick_cycles:
            raise ValueError(f"max_count must be from 1 to {tick_cycles}, not {max_count}")
        self._tick_cycles = tick_cycles
        self._max_count = max_count
        super().__init__(
            {
                "step": In(signed(2)),
                "last": In(1),
                "tick": Out(1),
                "pulse_count": Out(signed(max_count.bit_length() + 1)),
                "overflow": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        count = Signal(signed(self._tick_cycles.bit_length() + 1))
        step = Signal.like(count)
        complete = Signal()
        m.d.comb += step.eq(self.step)
        m.d.sync += [complete.eq(self.last), self.tick.eq(complete), count.eq(count + step)]
        with m.If(complete):
            m.d.sync += count.eq(step)
        if self._max_count == self._tick_cycles:
            held, overflow = count, 0
        else:
            held, overflow = saturate(m, count, self._max_count)
        with m.If(complete):
            m.d.sync += [self.pulse_count.eq(held), self.overflow.eq(overflow)]
        return m
