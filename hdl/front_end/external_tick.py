"""The sampling period comes from outside."""

from amaranth import Const, Module, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box
from tachometry.hdl.wires.synchronizer import Synchronizer


class ExternalTick(Box):
    """Ends a window when `tick_in` rises, as a PWM carrier or a fieldbus sync does.

    A rise that comes too early for the datapath is ignored, and its window goes on. If no rise has come for
    `max_cycles` clocks, the window ends without one, so that nothing freezes and nothing overflows. Both raise
    `tick_error`.

    Latency: a rise that is sampled at clock edge c makes c + 2 the last clock of its window; `tick_error` is high
    `latency` clocks after its cause. For a tick that did not come it is high together with `tick`.

    - `latency`: That of `tick`, at least 2.
    - `synchronous`: `tick_in` is of the clock domain already, and a rise in a clock makes it the last of its window.

    It raises ValueError if `min_cycles` is not in 2 … `max_cycles`.
    """

    def __init__(self, min_cycles: int, max_cycles: int, latency: int = 2, *, synchronous: bool = False) -> None:
        if not 2 <= min_cycles <= max_cycles:
            raise ValueError(f"min_cycles must be from 2 to {max_cycles}, not {min_cycles}")
        self._min_cycles, self._max_cycles, self._latency = min_cycles, max_cycles, latency
        self._synchronous = synchronous
        super().__init__(
            tick_in=In(1),  # asynchronous; each level must hold for a clock
            last=Out(1),  # high in the last clock of every window
            tick_error=Out(1),  # a tick came too early, or did not come
        )

    def build(self, m: Module) -> None:
        level = Signal()
        past = Signal()
        if self._synchronous:
            m.d.comb += level.eq(self.tick_in)
        else:
            m.submodules.sync_tick_in = Synchronizer(self.tick_in, level)
        # Two clocks for the synchroniser, which has no reset, one for the level before.
        clocks_since_reset = Signal(3)
        m.d.sync += [past.eq(level), clocks_since_reset.eq((clocks_since_reset << 1) | 1)]
        rises = level & ~past & clocks_since_reset[-1]

        # Counts down to −1, as the sampling clock does.
        start = self._max_cycles - 2
        left = Signal(signed(start.bit_length() + 1), init=start)
        late = left[-1]
        enough = Signal()  # this clock is at least the `min_cycles`-th of the window
        error = Signal()
        m.d.comb += self.last.eq((rises & enough) | late)
        m.d.sync += [left.eq(left - Const(1, left.shape())), error.eq(rises ^ self.last)]
        m.d.comb += self.tick_error.eq(*delay(m, error, clocks=self._latency - 1))
        # Lower bits tell the first clock that may end a window from all before it; later, `enough` is high anyway.
        first = self._min_cycles - 2
        bits = first.bit_length()
        with m.If(left[:bits] == (start - first) % (1 << bits)):
            m.d.sync += enough.eq(1)
        with m.If(self.last):
            m.d.sync += [left.eq(start), enough.eq(0)]
