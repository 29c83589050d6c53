"""A counter divides the clock into sampling periods."""

from amaranth import Cat, Const, Module, Signal, Value, signed
from amaranth.lib.wiring import Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.wires.ports import Box, only_if

# Bits whose parity makes a shift register of so many bits go through all states but one (Alfke, XAPP 052).
_TAPS = {5: (5, 3), 6: (6, 5), 7: (7, 6), 8: (8, 6, 5, 4), 9: (9, 5), 10: (10, 7), 11: (11, 9), 12: (12, 6, 4, 1)}


def states_of(bits: int) -> tuple[int, ...]:
    """Return all states of a shift register with feedback, in order; empty if its taps are not known."""
    if bits not in _TAPS:
        return ()
    # That of ones alone does not change; of all others only the last has ones below its highest bit.
    state = last = (1 << (bits - 1)) - 1
    found: list[int] = []
    while not found or state != last:
        parity = sum(state >> (tap - 1) for tap in _TAPS[bits]) & 1
        state = (state << 1 | parity ^ 1) & ((1 << bits) - 1)
        found.append(state)
    return tuple(found)


def state_after(state: Value) -> Value:
    """Return the state of a shift register that follows one."""
    return Cat(~Cat(state[tap - 1] for tap in _TAPS[len(state)]).xor(), state[:-1])


class SamplingClock(Box):
    """Divides time into windows of `tick_cycles` clocks by a shift register with feedback, or else by a counter.

    The first window begins with the first clock after reset. Nothing needs its clocks counted, and the shift register
    takes fewer cells. Whatever state an upset brings, it comes to the last one of a window.

    - `lead`: Clocks before the last one of a window in which `early` is high; 0: it has no such output.

    It raises ValueError if `tick_cycles` is less than 1.
    """

    def __init__(self, tick_cycles: int, lead: int = 0) -> None:
        if tick_cycles < 1:
            raise ValueError(f"tick_cycles must be at least 1, not {tick_cycles}")
        self._tick_cycles, self._lead = tick_cycles, lead
        # `last` is high in the last clock of every window.
        super().__init__({"last": Out(1), **only_if(lead, early=Out(1))})

    @property
    def states(self) -> tuple[int, ...]:
        """States of the shift register, the last of a window at the end; empty: it is a counter."""
        return states_of(self._tick_cycles.bit_length())

    @property
    def idle(self) -> tuple[Idle, ...]:
        if self.states:
            return (IdleCounter("state", order=self.states[: len(self.states) - self._lead]),)
        # Of two clocks none is worth skipping, and one bit goes by the name of what it is connected to.
        return (IdleCounter("left", -1, (-1, self._lead - 1)),) if self._tick_cycles > 2 else ()

    def build(self, m: Module) -> None:
        if self._tick_cycles == 1:
            m.d.comb += self.last.eq(1)
            return
        if states := self.states:
            bits = states[-1].bit_length() + 1
            first = states[-self._tick_cycles]
            state = Signal(bits, init=first)
            # Also of ones alone.
            m.d.comb += self.last.eq(state[:-1].all())
            m.d.sync += state.eq(state_after(state))
            if self._lead:
                m.d.comb += self.early.eq(state == states[-1 - self._lead])
            with m.If(self.last):
                m.d.sync += state.eq(first)
            return
        # Counts down to −1: the sign is the flag, so nothing has to be compared.
        start = self._tick_cycles - 2
        left = Signal(signed(start.bit_length() + 1), init=start)
        m.d.comb += self.last.eq(left[-1])
        m.d.sync += left.eq(left - Const(1, left.shape()))
        if self._lead:
            m.d.comb += self.early.eq(left == self._lead - 1)
        with m.If(self.last):
            m.d.sync += left.eq(start)
