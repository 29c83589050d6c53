"""Whose turn it is to be looked at."""

from amaranth import EnableInserter, Module, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.front_end.external_tick import ExternalTick
from tachometry.hdl.front_end.sampling_clock import SamplingClock
from tachometry.hdl.wires.ports import Box, only_if


class Rounds(Box):
    """Goes round the slots, one a clock; the first round begins with the first clock after reset.

    - `external`: Fewest and most rounds of a tick whose end comes from outside.
    - `warm_up`: Rounds after reset in which there are no two real levels to be compared.
    """

    def __init__(self, slots: int, rounds: int, warm_up: int, external: tuple[int, int] | None = None) -> None:
        self._slots, self._warm_up = slots, warm_up
        # A round is a clock of this box.
        self.sampling_clock = SamplingClock(rounds) if external is None else ExternalTick(*external, synchronous=True)
        super().__init__(
            slot=Out(range(slots)),
            first=Out(1, init=1),  # in the first round of a tick
            last=Out(1),  # in its last round
            ready=Out(1),  # the warm-up is over
            real=Out(1),  # the level is one of the line, though that of the round before need not be
            # Synchronous; if it has been high in a round, and not in the one before, a tick ends with the next.
            **only_if(external, tick_in=In(1)),
            # See `ExternalTick`; in the first clock of the second round after.
            **only_if(external, tick_error=Out(1)),
        )

    def build(self, m: Module) -> None:
        ends = Signal()
        clock = self.sampling_clock
        m.submodules.sampling_clock = EnableInserter(ends)(clock)
        if isinstance(clock, ExternalTick):
            high = Signal()
            seen = Signal()
            m.d.comb += [clock.tick_in.eq(seen), self.tick_error.eq(clock.tick_error & (self.slot == 0))]
            m.d.sync += high.eq((high | self.tick_in) & ~ends)
            with m.If(ends):
                m.d.sync += seen.eq(high | self.tick_in)
        warmed = Signal(self._warm_up)
        m.d.comb += [ends.eq(self.slot == self._slots - 1), self.last.eq(clock.last), self.ready.eq(warmed[-1])]
        m.d.comb += self.real.eq(warmed[-2])
        m.d.sync += self.slot.eq(self.slot + 1)
        with m.If(ends):
            m.d.sync += [self.slot.eq(0), self.first.eq(self.last), warmed.eq((warmed << 1) | 1)]
