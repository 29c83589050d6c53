"""A pin can capture the registers."""

from amaranth import Module, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.hdl.wires.synchronizer import Synchronizer


class CapturePin(Box):
    """Captures once when the pin rises; a pin that nothing is connected to stays high, and captures nothing.

    Latency: a rise that is sampled at clock edge c captures in clock c + 2.

    - `pin`: Asynchronous; each level must hold for a clock.
    """

    def __init__(self) -> None:
        super().__init__({"pin": In(1), "capture": Out(1)})

    def build(self, m: Module) -> None:
        level = Signal()
        past = Signal()
        # The synchroniser begins low, whatever the pin is.
        clocks_since_reset = Signal(3)
        m.submodules.sync_capture = Synchronizer(self.pin, level)
        m.d.sync += [past.eq(level), clocks_since_reset.eq((clocks_since_reset << 1) | 1)]
        m.d.comb += self.capture.eq(level & ~past & clocks_since_reset[-1])
