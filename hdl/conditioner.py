"""From asynchronous pins to levels of the clock domain."""

from amaranth import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out


class InputConditioner(wiring.Component):
    """Brings the encoder's lines into the clock domain.

    Latency: a level that is sampled at clock edge c is at the output in clock c + 2.

    Members
    -------
    a, b : In(1)
        Asynchronous pins.
    level_a, level_b : Out(1)
        Synchronised levels.
    ready : Out(1)
        High from the first clock in which the level before the present one is real as well.
    """

    def __init__(self) -> None:
        super().__init__({"a": In(1), "b": In(1), "level_a": Out(1), "level_b": Out(1), "ready": Out(1)})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.sync_a = FFSynchronizer(self.a, self.level_a)
        m.submodules.sync_b = FFSynchronizer(self.b, self.level_b)
        # Two clocks for the synchroniser, one for the decoder's memory of the level before.
        clocks_since_reset = Signal(3)
        m.d.sync += clocks_since_reset.eq((clocks_since_reset << 1) | 1)
        m.d.comb += self.ready.eq(clocks_since_reset[2])
        return m
