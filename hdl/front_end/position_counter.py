"""A counter sums steps to the position."""

from amaranth import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay


class PositionCounter(wiring.Component):
    """Adds up all steps; wraps in two's complement.

    Latency: a step in clock c is in `position` from clock c + `latency` on, as late as `PulseCounter` shows it, so that
    the two agree while `tick` is high.

    Parameters
    ----------
    width : int
        Bits of the position.

    Members
    -------
    step : In(signed(2))
    clear : In(1)
        `position` is 0 in the next clock, whatever has been counted.
    next : Out(signed(width))
        `position` of the next clock, if it is not cleared.
    position : Out(signed(width))

    Raises
    ------
    ValueError
        If `width` is less than 2.
    """

    def __init__(self, width: int, latency: int = 2) -> None:
        if width < 2:
            raise ValueError(f"width must be at least 2, not {width}")
        self._latency = latency
        super().__init__(
            {"step": In(signed(2)), "clear": In(1), "next": Out(signed(width)), "position": Out(signed(width))}
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        (late,) = delay(m, self.step, clocks=self._latency - 1)
        step = Signal.like(self.position)
        m.d.comb += step.eq(late)
        m.d.comb += self.next.eq(self.position + step)
        m.d.sync += self.position.eq(self.next)
        with m.If(self.clear):
            m.d.sync += self.position.eq(0)
        return m
