"""Pulses at positions."""

from collections.abc import Mapping
from typing import Any

from amaranth import Module, Mux, ResetInserter, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.fifo import SyncFIFOBuffered
from amaranth.lib.wiring import In, Member, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.spec.core.compare import BACKWARD, BOTH, COUNT_WIDTH, LIST_PINS, Compare

# A position, whether it is reached, and what follows when it is.
Awaited = tuple[Value, Value, list[Any]]


class CompareOutput(wiring.Component):
    """Makes a pulse when a step in the right direction leads to a position, and waits for the next one.

    A shaft that turns back over a position, and comes again, makes no second pulse there. A pulse that begins while
    another lasts makes it longer. In both directions a position is the edge between it and the one below, so the place
    is the same: a step to it, or a step from it down. A shaft that swings about the edge makes a pulse each time. The
    positions are computed, or come from a list.

    Latency: a step that is in `position` in clock c begins a pulse in clock c + 1.

    Parameters
    ----------
    clocks : int
        Of a pulse.
    width : int
        Bits of a position.
    taken : mapping of str to Member or None
        What it is given in place of `position` and `step`.

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
    compare_next : In(signed(width))
    compare_append, compare_clear : In(1)
        Append it to the list, two clocks later at the earliest it is awaited; empty the list. Only with a list.
    compare_waiting : Out
        Positions in the list, with the one that is awaited.
    """

    def __init__(self, compare: Compare, clocks: int, width: int, taken: Mapping[str, Member] | None = None) -> None:
        self._compare = compare
        self._clocks = clocks
        position = signed(width)
        pins = dict(zip(LIST_PINS, (In(position), In(1), In(1)), strict=True))
        of_list = {**pins, "compare_waiting": Out(range(compare.depth + 1))} if compare.depth else {}
        super().__init__(
            {
                **({"position": In(position), "step": In(signed(2))} if taken is None else taken),
                "compare": Out(1),
                "compare_valid": Out(1),
                "compare_position": Out(position),
                "compare_count": Out(COUNT_WIDTH),
                **of_list,
            }
        )

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The time that is left of a pulse, which a simulation may move on."""
        return (IdleCounter("left", -1, (1,)),) if self._clocks > 2 else ()

    def elaborate(self, platform: object) -> Module:
        m = Module()
        reached = Signal()
        awaited, there, moves = self._awaited(m, reached)
        left = Signal(range(self._clocks + 1))
        m.d.comb += reached.eq(there)
        m.d.comb += self.compare.eq(left.any())
        m.d.sync += self.compare_valid.eq(reached)
        with m.If(left.any()):
            m.d.sync += left.eq(left - 1)
        with m.If(reached):
            m.d.sync += [
                left.eq(self._clocks),
                *moves,
                self.compare_position.eq(awaited),
                self.compare_count.eq(self.compare_count + 1),
            ]
        return m

    def _awaited(self, m: Module, reached: Signal) -> Awaited:
        """Return what is awaited in this clock."""
        return self._listed(m, reached) if self._compare.depth else self._computed(m)

    def _at(self, awaited: Value) -> Value:
        """Tell whether this step leads to a position, in a direction that counts."""
        back, direction = self.step[1], self._compare.direction
        if direction == BOTH:
            return self.step[0] & ((self.position + back)[: len(awaited)] == awaited.as_unsigned())
        return self.step[0] & (back == (direction == BACKWARD)) & (self.position == awaited)

    def _computed(self, m: Module) -> Awaited:
        """Return what is awaited of positions that lie equally apart."""
        compare, back = self._compare, self.step[1]
        awaited = Signal.like(self.position, init=compare.ahead(len(self.position)))
        if compare.direction != BOTH:
            there = self._at(awaited) & (self.compare_count != compare.count if compare.count else 1)
            return awaited, there, [awaited.eq(awaited + compare.apart)]
        here = Signal.like(awaited)  # the next one forward, or the one before it backward
        m.d.comb += here.eq(Mux(back, awaited - compare.step, awaited))
        there, moves = self._at(here), [awaited.eq(awaited + Mux(back, -compare.step, compare.step))]
        if compare.count:
            number = Signal(range(compare.count + 1), init=compare.passed)  # of those that lie behind
            there &= Mux(back, number.any(), number != compare.count)
            moves.append(number.eq(Mux(back, number - 1, number + 1)))
        return here, there, moves

    def _listed(self, m: Module, reached: Signal) -> Awaited:
        """Return what is awaited of a list."""
        fifo = SyncFIFOBuffered(width=len(self.position), depth=self._compare.depth)
        m.submodules.fifo = ResetInserter(self.compare_clear)(fifo)
        m.d.comb += [
            fifo.w_data.eq(self.compare_next),
            fifo.w_en.eq(self.compare_append),
            fifo.r_en.eq(reached),
            self.compare_waiting.eq(fifo.level),
        ]
        awaited = fifo.r_data.as_signed()
        return awaited, fifo.r_rdy & self._at(awaited), []
