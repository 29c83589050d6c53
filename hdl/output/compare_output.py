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
_Taken = Mapping[str, Member] | None


class CompareOutput(wiring.Component):
    """Makes a pulse when a step in the right direction leads to a position, and waits for the next one.

    A shaft that turns back over a position, and comes again, makes no second pulse there. A pulse that begins while
    another lasts makes it longer. In both directions a position is the edge between it and the one below, so the place
    is the same: a step to it, or a step from it down. A shaft that swings about the edge makes a pulse each time. The
    positions are computed, or come from a list.

    A position that is set does not make a pulse. In both directions the output then goes on by one position a clock,
    without a pulse, until the shaft stands between two of them.

    Latency: a step that is in `position` in clock c begins a pulse in clock c + 1.

    Parameters
    ----------
    clocks : int
        Of a pulse.
    width : int
        Bits of a position.
    taken : mapping of str to Member or None
        What it is given in place of `position` and `step`.
    aims : bool
        The position may be set. Only with both directions, and without a list.

    Members
    -------
    position : In(signed(width))
    step : In(signed(2))
        The step that is in `position` for the first clock.
    moves : In(1)
        The position of the next clock is set. Only with `aims`.
    position_compare : Out(1)
        The pulse.
    position_compare_valid : Out(1)
        The first clock of a pulse.
    position_compare_position : Out(signed(width))
        The position of the latest pulse.
    position_compare_count : Out(COUNT_WIDTH)
        Number of pulses, which wraps.
    position_compare_next : In(signed(width))
    position_compare_append, position_compare_clear : In(1)
        Append it to the list, two clocks later at the earliest it is awaited; empty the list. Only with a list.
    position_compare_waiting : Out
        Positions in the list, with the one that is awaited.
    """

    def __init__(self, compare: Compare, clocks: int, width: int, taken: _Taken = None, *, aims: bool = False) -> None:
        self._compare = compare
        self._clocks = clocks
        position = signed(width)
        pins = dict(zip(LIST_PINS, (In(position), In(1), In(1)), strict=True))
        of_list = {**pins, "position_compare_waiting": Out(range(compare.depth + 1))} if compare.depth else {}
        counted = {"position": In(position), "step": In(signed(2)), **({"moves": In(1)} if aims else {})}
        super().__init__(
            {
                **(counted if taken is None else taken),
                "position_compare": Out(1),
                "position_compare_valid": Out(1),
                "position_compare_position": Out(position),
                "position_compare_count": Out(COUNT_WIDTH),
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
        m.d.comb += self.position_compare.eq(left.any())
        m.d.sync += self.position_compare_valid.eq(reached)
        with m.If(left.any()):
            m.d.sync += left.eq(left - 1)
        with m.If(reached):
            m.d.sync += [
                left.eq(self._clocks),
                *moves,
                self.position_compare_position.eq(awaited),
                self.position_compare_count.eq(self.position_compare_count + 1),
            ]
        return m

    def _awaited(self, m: Module, reached: Signal) -> Awaited:
        """Return what is awaited in this clock."""
        return self._listed(m, reached) if self._compare.depth else self._computed(m)

    def _at(self, awaited: Value) -> Value:
        """Return whether this step leads to a position, in a direction that counts."""
        back, direction = self.step[1], self._compare.direction
        if direction == BOTH:
            return self.step[0] & ((self.position + back)[: len(self.position)] == awaited[: len(self.position)])
        return self.step[0] & (back == (direction == BACKWARD)) & (self.position == awaited)

    def _computed(self, m: Module) -> Awaited:
        """Return what is awaited of positions that lie equally apart."""
        compare, back = self._compare, self.step[1]
        aims = hasattr(self, "moves")
        # Positions that end do not wrap, and the one behind the last needs another bit where all are compared.
        width = len(self.position) + (aims and compare.count > 0)
        awaited = Signal(signed(width), init=compare.ahead(width))
        if compare.direction != BOTH:
            there = self._at(awaited) & (self.position_compare_count != compare.count if compare.count else 1)
            return awaited, there, [awaited.eq(awaited + compare.apart)]
        here = Signal.like(awaited)  # the next one forward, or the one before it backward
        m.d.comb += here.eq(Mux(back, awaited - compare.step, awaited))
        turn = Signal()
        behind, left = Value.cast(1), Value.cast(1)  # whether there are positions
        moves = [awaited.eq(awaited + Mux(turn, -compare.step, compare.step))]
        if compare.count:
            number = Signal(range(compare.count + 1), init=compare.passed)  # of those that lie behind
            behind, left = number.any(), number != compare.count
            moves.append(number.eq(Mux(turn, number - 1, number + 1)))
        m.d.comb += turn.eq(back)
        if aims:
            beyond = Signal(signed(width + (compare.count > 0)))
            aiming = Signal()
            m.d.comb += beyond.eq(self.position - awaited)
            above, below = (beyond >= 0) & left, (beyond < -compare.step) & behind
            m.d.sync += aiming.eq(self.moves | (aiming & (above | below)))
            with m.If(aiming & (above | below)):
                m.d.comb += turn.eq(below)  # so does a step that leads to a position now
                m.d.sync += moves
        return here, self._at(here) & Mux(back, behind, left), moves

    def _listed(self, m: Module, reached: Signal) -> Awaited:
        """Return what is awaited of a list."""
        fifo = SyncFIFOBuffered(width=len(self.position), depth=self._compare.depth)
        m.submodules.fifo = ResetInserter(self.position_compare_clear)(fifo)
        m.d.comb += [
            fifo.w_data.eq(self.position_compare_next),
            fifo.w_en.eq(self.position_compare_append),
            fifo.r_en.eq(reached),
            self.position_compare_waiting.eq(fifo.level),
        ]
        awaited = fifo.r_data.as_signed()
        return awaited, fifo.r_rdy & self._at(awaited), []
