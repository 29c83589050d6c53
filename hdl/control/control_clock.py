"""When the controller works."""

from amaranth import Module, Signal
from amaranth.lib.wiring import Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.wires.ports import Box, only_if


class ControlClock(Box):
    """Strobes every `period` clocks, for the first time in clock `first` after reset.

    - `tells`: It also tells of a tick in the clock before.
    """

    def __init__(self, first: int, period: int, *, tells: bool = False) -> None:
        self._first, self._period = first, period
        super().__init__(
            tick=Out(1),
            **only_if(tells, coming=Out(1)),  # in the clock before
        )

    @property
    def idle(self) -> tuple[Idle, ...]:
        return (IdleCounter("left", -1, (0,)),)

    def build(self, m: Module) -> None:
        left = Signal(range(max(self._first, self._period)), init=self._first - 1)
        if "coming" in self.signature.members:
            m.d.comb += self.coming.eq(left == 0)
        m.d.sync += [left.eq(left - 1), self.tick.eq(left == 0)]
        with m.If(left == 0):
            m.d.sync += left.eq(self._period - 1)
