"""Pulses at positions."""

from amaranth import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.spec.core.compare import COUNT_WIDTH, Compare


class CompareOutput(wiring.Component):
    """Makes a pulse when a step in the right direction leads to a position, and waits for the next one.

    A shaft that turns back over a position, and comes again, makes no second pulse there. A pulse that begins while
    another lasts makes it longer.

    Latency: a step that is in `position` in clock c begins a pulse in clock c + 1.

    Parameters
    ----------
    clocks : int
        Of a pulse.
    width : int
        Bits of a position.

    Members
    -------
    position : In(signed(width))
    step : In(signed(2))
        The step that is in `position` for the first clock.
    compare : Out(1)
        The pulse.
    compare_valid : Out(1)
        The first clock of a pulse.
    compare_position : Out(signed(width))
        The position of the latest pulse.
    compare_count : Out(COUNT_WIDTH)
        Number of pulses, which wraps.
    """

    def __init__(self, compare: Compare, clocks: int, width: int) -> None:
        self._compare = compare
        self._clocks = clocks
        position = signed(width)
        super().__init__(
            {
                "position": In(position),
                "step": In(signed(2)),
                "compare": Out(1),
                "compare_valid": Out(1),
                "compare_position": Out(position),
                "compare_count": Out(COUNT_WIDTH),
            }
        )

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The time that is left of a pulse, which a simulation may move on."""
        return (IdleCounter("left", -1, (1,)),) if self._clocks > 2 else ()

    def elaborate(self, platform: object) -> Module:
        m = Module()
        compare = self._compare
        awaited = Signal.like(self.position, init=compare.start)
        left = Signal(range(self._clocks + 1))
        reached = Signal()
        there = self.step[0] & (self.step[1] == compare.backward) & (self.position == awaited)
        m.d.comb += reached.eq(there & (self.compare_count != compare.count if compare.count else 1))
        m.d.comb += self.compare.eq(left.any())
        m.d.sync += self.compare_valid.eq(reached)
        with m.If(left.any()):
            m.d.sync += left.eq(left - 1)
        with m.If(reached):
            m.d.sync += [
                left.eq(self._clocks),
                awaited.eq(awaited + compare.apart),
                self.compare_position.eq(awaited),
                self.compare_count.eq(self.compare_count + 1),
            ]
        return m
