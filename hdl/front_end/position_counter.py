"""A counter sums steps to the position."""

from amaranth import Module, Mux, Signal, signed
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
    preset : int or None
        What `value` is where nothing drives it; None: the position cannot be set.

    Members
    -------
    step : In(signed(2))
    clear : In(1)
        `position` is 0 in the next clock, whatever has been counted.
    load : In(1)
        `position` is `value` and the step that comes in the next clock. Only with a preset, as is `value`.
    value : In(signed(width))
    next : Out(signed(width))
        `position` of the next clock, if it is not cleared.
    position : Out(signed(width))

    Raises
    ------
    ValueError
        If `width` is less than 2.
    """

    def __init__(self, width: int, latency: int = 2, preset: int | None = None) -> None:
        if width < 2:
            raise ValueError(f"width must be at least 2, not {width}")
        self._latency = latency
        self._loads = preset is not None
        given = {"load": In(1), "value": In(signed(width), init=preset)} if self._loads else {}
        position = Out(signed(width))
        super().__init__({"step": In(signed(2)), "clear": In(1), **given, "next": position, "position": position})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        (late,) = delay(m, self.step, clocks=self._latency - 1)
        step = Signal.like(self.position)
        m.d.comb += step.eq(late)
        before = Mux(self.load, self.value, self.position) if self._loads else self.position
        m.d.comb += self.next.eq(before + step)
        m.d.sync += self.position.eq(self.next)
        with m.If(self.clear):
            m.d.sync += self.position.eq(0)
        return m
