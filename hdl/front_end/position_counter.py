"""A counter sums steps to the position."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, only_if


class PositionCounter(Box):
    """Adds up all steps; wraps in two's complement.

    Latency: a step in clock c is in `position` from clock c + `latency` on, as late as `PulseCounter` shows it, so that
    the two agree while `tick` is high.

    - `preset`: What `value` is where nothing drives it; None: the position cannot be set.

    It raises ValueError if `width` is less than 2.
    """

    def __init__(self, width: int, latency: int = 2, preset: int | None = None) -> None:
        if width < 2:
            raise ValueError(f"width must be at least 2, not {width}")
        self._latency = latency
        self._loads = preset is not None
        position = Out(signed(width))
        super().__init__(
            step=In(signed(2)),
            clear=In(1),  # `position` is 0 in the next clock, whatever has been counted
            **only_if(self._loads, load=In(1)),  # `position` is `value` and the step that comes in the next clock
            **only_if(self._loads, value=In(signed(width), init=preset)),
            next=position,  # `position` of the next clock, if it is not cleared
            position=position,
        )

    def build(self, m: Module) -> None:
        (late,) = delay(m, self.step, clocks=self._latency - 1)
        step = Signal.like(self.position)
        m.d.comb += step.eq(late)
        before = Mux(self.load, self.value, self.position) if self._loads else self.position
        m.d.comb += self.next.eq(before + step)
        m.d.sync += self.position.eq(self.next)
        with m.If(self.clear):
            m.d.sync += self.position.eq(0)
