"""The sampling period."""

from amaranth import Const, Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from tachometry.hdl.arithmetic.idle import IdleCounter


class SamplingClock(wiring.Component):
    """Divides time into windows of `tick_cycles` clocks, the first of which begins with the first clock after reset.

    Parameters
    ----------
    tick_cycles : int
        T, clocks in a window.

    Members
    -------
    last : Out(1)
        High in the last clock of every window.

    Raises
    ------
    ValueError
        If `tick_cycles` is less than 1.
    """

    def __init__(self, tick_cycles: int) -> None:
        if tick_cycles < 1:
            raise ValueError(f"tick_cycles must be at least 1, not {tick_cycles}")
        self._tick_cycles = tick_cycles
        super().__init__({"last": Out(1)})

    @property
    def idle_counters(self) -> tuple[IdleCounter, ...]:
        """See `IdleCounter`."""
        # For two clocks it is one bit, and that is `last`.
        return (IdleCounter("left", -1, (-1,)),) if self._tick_cycles > 2 else ()

    def elaborate(self, platform: object) -> Module:
        m = Module()
        if self._tick_cycles == 1:
            m.d.comb += self.last.eq(1)
            return m
        # Counts down to −1: the sign is the flag, so nothing has to be compared.
        start = self._tick_cycles - 2
        left = Signal(signed(start.bit_length() + 1), init=start)
        m.d.comb += self.last.eq(left[-1])
        m.d.sync += left.eq(left - Const(1, left.shape()))
        with m.If(self.last):
            m.d.sync += left.eq(start)
        return m
