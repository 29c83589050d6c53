"""The displacements of the edges at the ends of a window."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box
from tachometry.spec.formats.displacement import DISPLACED, Displacement


class WindowEnds(Box):
    """How far the edges at the end of a window are off their places, less that of its opening.

    Eq. (21) of Tsuji 2009 places both ends in the middle of a tick. A tick of more counts than the one before has
    caught edges near its ends: it is off by the displacements of its first and its last edge. Any other tick is off by
    those of the next edges beyond its ends.

    Latency: `difference` is valid with `coming`, which is three clocks after the last one of a tick; all steps of the
    tick are seen by then.

    - `max_ticks`, `kept_ticks`: See `IntervalAccumulator`.
    - `every_clock`: `coming` may come with the `tick` of the tick before.
    """

    def __init__(self, form: Displacement, max_ticks: int, kept_ticks: int, *, every_clock: bool) -> None:
        self._form, self._every_clock = form, every_clock
        self._moved_on, self._is_next = max_ticks - kept_ticks, max_ticks == 2 * kept_ticks
        super().__init__(
            **dict.fromkeys(DISPLACED, In(signed(form.width))),
            step_before=In(signed(2)),  # the step of the next clock
            coming=In(1),
            rises=In(1),  # with `coming`: the tick has more counts than the one before
            tick=In(1),
            closes=In(1),  # with `tick`, like the next two: it closes a window
            forced=In(1),
            m_s=In(range(max_ticks + 1)),
            difference=Out(signed(form.width + 2)),  # the sum of both edges
        )

    def build(self, m: Module) -> None:
        pair = signed(self._form.width + 1)
        end, opening, kept, begun = (Signal(pair, name=name) for name in ("end", "opening", "kept", "begun"))
        closes = self.tick & self.closes
        above, below, above_was, below_was = (
            Signal(signed(self._form.width), name=name) for name in ("above", "below", "above_was", "below_was")
        )
        was = Signal()
        now = Signal(pair)
        (latest,) = delay(m, self.displaced_before)
        back = Mux(self.step_before[0], self.step_before[1], was)
        m.d.sync += was.eq(back)
        m.d.comb += [
            above.eq(Mux(back, latest, self.displaced)),
            below.eq(Mux(back, self.displaced, latest)),
            now.eq(Mux(self.rises, above_was, below_was) + Mux(self.rises, below, above)),
            begun.eq(Mux(self.forced, kept, end)),
            self.difference.eq(now - (Mux(closes, begun, opening) if self._every_clock else opening)),
        ]
        with m.If(self.coming):
            m.d.sync += [above_was.eq(above), below_was.eq(below), end.eq(now)]
        with m.If(closes):
            m.d.sync += opening.eq(begun)
        # With this tick the half of a window opens that a forced update keeps.
        with m.If(self.tick & ((self.m_s == self._moved_on) | (self.forced if self._is_next else 0))):
            m.d.sync += kept.eq(end)
