"""From asynchronous pins to levels of the clock domain."""

from amaranth import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from tachometry.hdl.glitch_filter import GlitchFilter


class InputConditioner(wiring.Component):
    """Brings the encoder's lines into the clock domain, and keeps glitches out of it.

    Latency: a level that is sampled at clock edge c is at the output in clock c + 2 + `filter_clocks`.

    Parameters
    ----------
    filter_clocks : int
        Clocks for which a level must hold; 0 for no filter.

    Members
    -------
    a, b : In(1)
        Asynchronous pins.
    level_a, level_b : Out(1)
        Synchronised and filtered levels.
    ready : Out(1)
        High from the first clock in which the level before the present one is real as well.
    swallowed_edges : Out(16)
        Edges that the filter has kept out, two for each glitch; stays at 65534.
    """

    def __init__(self, filter_clocks: int = 0) -> None:
        self._filter_clocks = filter_clocks
        super().__init__(
            {
                "a": In(1),
                "b": In(1),
                "level_a": Out(1),
                "level_b": Out(1),
                "ready": Out(1),
                "swallowed_edges": Out(16),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        level_a, level_b = Signal(), Signal()
        m.submodules.sync_a = FFSynchronizer(self.a, level_a)
        m.submodules.sync_b = FFSynchronizer(self.b, level_b)
        # Two clocks for the synchroniser, one for the filter, one for the decoder's memory of the level before.
        clocks_since_reset = Signal(4 if self._filter_clocks else 3)
        m.d.sync += clocks_since_reset.eq((clocks_since_reset << 1) | 1)
        m.d.comb += self.ready.eq(clocks_since_reset[-1])
        if not self._filter_clocks:
            m.d.comb += [self.level_a.eq(level_a), self.level_b.eq(level_b)]
            return m
        m.submodules.filter_a = filter_a = GlitchFilter(self._filter_clocks)
        m.submodules.filter_b = filter_b = GlitchFilter(self._filter_clocks)
        m.d.comb += [
            filter_a.level.eq(level_a),
            filter_b.level.eq(level_b),
            Cat(filter_a.load, filter_b.load).eq((~clocks_since_reset[2]).replicate(2)),
            self.level_a.eq(filter_a.filtered),
            self.level_b.eq(filter_b.filtered),
        ]
        glitches, sum_ = Signal(15), Signal(16)
        m.d.comb += [
            sum_.eq(glitches + (filter_a.swallowed + filter_b.swallowed)),
            self.swallowed_edges.eq(Cat(0, glitches)),
        ]
        m.d.sync += glitches.eq(sum_)
        with m.If(sum_[-1]):
            m.d.sync += glitches.eq(0x7FFF)
        return m
