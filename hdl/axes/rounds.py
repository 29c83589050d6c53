"""Whose turn it is to be looked at."""

from amaranth import EnableInserter, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from tachometry.hdl.front_end.sampling_clock import SamplingClock


class Rounds(wiring.Component):
    """Goes round the slots, one a clock; the first round begins with the first clock after reset.

    Parameters
    ----------
    slots : int
        Clocks of a round.
    rounds : int
        Rounds of a tick.
    warm_up : int
        Rounds after reset in which there are no two real levels to be compared.

    Members
    -------
    slot : Out(range(slots))
    first, last : Out(1)
        High in the first and in the last round of a tick.
    ready : Out(1)
        The warm-up is over.
    """

    def __init__(self, slots: int, rounds: int, warm_up: int) -> None:
        self._slots = slots
        self._rounds = rounds
        self._warm_up = warm_up
        super().__init__(
            {"slot": Out(range(slots)), "first": Out(1, init=1), "last": Out(1), "ready": Out(1)},
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        ends = Signal()
        # A round is a clock of this box.
        m.submodules.sampling_clock = clock = EnableInserter(ends)(SamplingClock(self._rounds))
        warmed = Signal(self._warm_up)
        m.d.comb += [ends.eq(self.slot == self._slots - 1), self.last.eq(clock.last), self.ready.eq(warmed[-1])]
        m.d.sync += self.slot.eq(self.slot + 1)
        with m.If(ends):
            m.d.sync += [self.slot.eq(0), self.first.eq(self.last), warmed.eq((warmed << 1) | 1)]
        return m
