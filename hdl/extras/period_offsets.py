"""Gates of `spec.core.extras.period_offsets`."""

from typing import Self

from amaranth import Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.period_offsets import PeriodOffsets
from tachometry.spec.formats.tracking_sampled import OFFSET_BITS


class Gates(Box):
    """A write waits until the machine begins, which reads no offset then; the first time it forgets them all."""

    def __init__(self) -> None:
        word = signed(OFFSET_BITS)
        super().__init__(
            tick=In(1),
            period_write=In(1),
            period_address=In(3),
            period_data=In(OFFSET_BITS),
            period_offset=Out(word),
            offset_written=Out(1),
            offset_at=Out(3),
            offset_value=Out(word),
            offset_read=In(word),
        )

    @classmethod
    def of(cls, extra: PeriodOffsets, spec: TachometerSpec) -> Self:
        """Return the gates of this core."""
        return cls()

    def build(self, m: Module) -> None:
        begun = Signal()
        waits = Signal()
        shows = Signal()  # the memory has been read
        m.d.comb += [
            self.offset_written.eq(self.tick & begun & waits),
            self.offset_at.eq(self.period_address),
            self.offset_value.eq(self.period_data),
            self.period_offset.eq(Mux(shows, self.offset_read, 0)),
        ]
        m.d.sync += shows.eq(begun)
        m.d.sync += waits.eq((waits & ~self.offset_written) | self.period_write)
        with m.If(self.tick):
            m.d.sync += begun.eq(1)
