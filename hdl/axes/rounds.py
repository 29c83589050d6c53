"""Whose turn it is to be looked at."""

from amaranth import EnableInserter, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.front_end.external_tick import ExternalTick
from tachometry.hdl.front_end.sampling_clock import SamplingClock


class Rounds(wiring.Component):
    """Goes round the slots, one a clock; the first round begins with the first clock after reset.

    Parameters
    ----------
    slots : int
        Clocks of a round.
    rounds : int
        Rounds of a tick.
    external : tuple of int or None
        Fewest and most rounds of a tick whose end comes from outside.
    warm_up : int
        Rounds after reset in which there are no two real levels to be compared.

    Members
    -------
    slot : Out(range(slots))
    first, last : Out(1)
        High in the first and in the last round of a tick.
    ready : Out(1)
        The warm-up is over.
    real : Out(1)
        The level is one of the line, though that of the round before need not be.
    tick_in : In(1)
        Only with `external`: synchronous; if it has been high in a round, and not in the one before, a tick ends with
        the next.
    tick_error : Out(1)
        Only with `external`: see `ExternalTick`; in the first clock of the second round after.
    """

    def __init__(self, slots: int, rounds: int, warm_up: int, external: tuple[int, int] | None = None) -> None:
        self._slots = slots
        self._warm_up = warm_up
        # A round is a clock of this box.
        self.sampling_clock = SamplingClock(rounds) if external is None else ExternalTick(*external, synchronous=True)
        outside = {"tick_in": In(1), "tick_error": Out(1)} if external else {}
        super().__init__(
            {
                "slot": Out(range(slots)),
                "first": Out(1, init=1),
                **dict.fromkeys(("last", "ready", "real"), Out(1)),
                **outside,
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
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
        return m
