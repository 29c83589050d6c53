"""Gates of `spec.core.extras.position_compare`."""

from typing import Any

from amaranth import Module, Mux, ResetInserter, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.fifo import SyncFIFOBuffered
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.output.velocity_output import SerialVelocityOutput
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, only_if
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.position_compare import (
    BACKWARD,
    BOTH,
    COUNT_WIDTH,
    LIST_PINS,
    Compare,
    PositionCompare,
)
from tachometry.spec.formats.carrying import FASTER_BITS, Carrying

# A position, whether it is reached, and what follows when it is.
Awaited = tuple[Value, Value, list[Any]]


class Gates(Box):
    """Makes a pulse when a step in the right direction leads to a position, and waits for the next one.

    A shaft that turns back over a position, and comes again, makes no second pulse there. A pulse that begins while
    another lasts makes it longer. In both directions a position is the edge between it and the one below, so the place
    is the same: a step to it, or a step from it down. A shaft that swings about the edge makes a pulse each time. The
    positions are computed, or come from a list.

    A position that is set does not make a pulse. In both directions the output then goes on by one position a clock,
    without a pulse, until the shaft stands between two of them.

    Latency: a step that is in `position` in clock c begins a pulse in clock c + 1.

    - `aims`: The position may be set. Only with both directions, and without a list.
    - `latency`: Clocks from a step to the position that has it.

    - `step`: The step that is in `position` for the first time `latency` clocks later.
    - `moves`: The position of the next clock is set. Only with `aims`.
    - `position_compare_append`: Append `position_compare_next` to the list; it is awaited two clocks later at the
      earliest.
    """

    def __init__(self, compare: Compare, clocks: int, width: int, *, aims: bool = False, latency: int = 0) -> None:
        self._compare, self._clocks, self._latency, self._aims = compare, clocks, latency, aims
        position = signed(width)
        super().__init__(
            **self._inputs(width),
            position_compare=Out(1),
            position_compare_valid=Out(1),
            position_compare_position=Out(position),
            position_compare_count=Out(COUNT_WIDTH),
            **only_if(compare.depth, **dict(zip(LIST_PINS, (In(position), In(1), In(1)), strict=True))),
            **only_if(compare.depth, position_compare_waiting=Out(range(compare.depth + 1))),
        )

    def _inputs(self, width: int) -> dict[str, Any]:
        return {"position": In(signed(width)), "step": In(signed(2)), **only_if(self._aims, moves=In(1))}

    @classmethod
    def of(cls, extra: PositionCompare, spec: TachometerSpec) -> "Gates":
        places, clocks, width = extra.places, extra.clocks(spec), spec.position_width
        if places.fine and spec.carrying:
            return FineGates(places, clocks, width, spec.carrying, spec.velocity.native)
        aims = places.both and spec.front_end.moves_position
        return cls(places, clocks, width, aims=aims, latency=spec.latency.tick)

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The time that is left of a pulse, which a simulation may move on."""
        return (IdleCounter("left", -1, (1,)),) if self._clocks > 2 else ()

    def build(self, m: Module) -> None:
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

    def _awaited(self, m: Module, reached: Signal) -> Awaited:
        """Return the positions that are awaited in this clock."""
        (step,) = delay(m, self.step, clocks=self._latency)
        return self._listed(m, step, reached) if self._compare.depth else self._computed(m, step)

    def _at(self, step: Value, awaited: Value) -> Value:
        """Return whether this step leads to a position, in a direction that counts."""
        back, direction = step[1], self._compare.direction
        if direction == BOTH:
            return step[0] & ((self.position + back)[: len(self.position)] == awaited[: len(self.position)])
        return step[0] & (back == (direction == BACKWARD)) & (self.position == awaited)

    def _computed(self, m: Module, step: Value) -> Awaited:
        """Return the awaited one of positions that lie equally apart."""
        compare, back = self._compare, step[1]
        aims = self._aims
        # Positions that end do not wrap, and the one behind the last needs another bit where all are compared.
        width = len(self.position) + (aims and compare.count > 0)
        awaited = Signal(signed(width), init=compare.ahead(width))
        if compare.direction != BOTH:
            there = self._at(step, awaited) & (self.position_compare_count != compare.count if compare.count else 1)
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
        return here, self._at(step, here) & Mux(back, behind, left), moves

    def _listed(self, m: Module, step: Value, reached: Signal) -> Awaited:
        """Return the awaited position of a list."""
        fifo = SyncFIFOBuffered(width=len(self.position), depth=self._compare.depth)
        m.submodules.fifo = ResetInserter(self.position_compare_clear)(fifo)
        m.d.comb += [
            fifo.w_data.eq(self.position_compare_next),
            fifo.w_en.eq(self.position_compare_append),
            fifo.r_en.eq(reached),
            self.position_compare_waiting.eq(fifo.level),
        ]
        awaited = fifo.r_data.as_signed()
        return awaited, fifo.r_rdy & self._at(step, awaited), []


class FineGates(Gates):
    """Makes a pulse when `position_fine`, carried on with the velocity, reaches a position, and waits for the next one.

    A place that goes back because of an update makes no second pulse; one that leaps over several positions makes all
    their pulses. The place is that of the shaft at the pins in the first clock of the pulse.

    - `native_valid`, `native_velocity`, `native_position_fine`: An update of the method, which stays until the
      next.
    - `moves`: The position of the next clock does not follow from counts: places that it leaps over have no pulses.
    """

    def __init__(self, compare: Compare, clocks: int, width: int, carrying: Carrying, native_width: int) -> None:
        self._carrying, self._native_width = carrying, native_width
        super().__init__(compare, clocks, width + carrying.position_fine_bits)

    def _inputs(self, width: int) -> dict[str, Any]:
        native = {"native_velocity": In(signed(self._native_width)), "native_position_fine": In(signed(width))}
        return native | dict.fromkeys(("native_valid", "tick", "moves"), In(1))

    def _has_moved(self, m: Module) -> Signal:
        """Return whether the update is of a tick in which something moved the position."""
        moved = Signal()
        of_tick = Signal()
        of_update = Signal()
        m.d.sync += moved.eq(self.moves | (moved & ~self.tick))
        with m.If(self.tick):
            m.d.sync += of_tick.eq(moved)
        with m.If(self.native_valid):
            m.d.sync += of_update.eq(of_tick)
        return of_update

    def _awaited(self, m: Module, reached: Signal) -> Awaited:
        compare, carrying = self._compare, self._carrying
        layout = data.StructLayout({"velocity": signed(len(self.native_velocity) + carrying.shift)})
        m.submodules.per_clock = per_clock = SerialVelocityOutput(carrying.per_clock, layout)
        m.d.comb += [
            per_clock.updates.valid.eq(self.native_valid),
            per_clock.updates.p.velocity.eq(self.native_velocity << carrying.shift),
        ]
        new = per_clock.shown.p.velocity
        # It catches up.
        late = Signal(signed(len(self.native_position_fine) + carrying.more_bits))
        place = Signal.like(late)
        speed = Signal.like(new)
        catching = Signal(range(carrying.waits + carrying.adds + 1))
        loads = Signal()
        m.d.sync += [loads.eq(catching == 1), place.eq(Mux(loads, late, place + speed))]
        with m.If(per_clock.shown.valid):
            m.d.sync += [
                late.eq(self.native_position_fine << carrying.more_bits),
                catching.eq(carrying.waits + carrying.adds),
            ]
        with m.Elif(catching.any()):
            m.d.sync += catching.eq(catching - 1)
            with m.If(catching <= carrying.adds):
                m.d.sync += late.eq(late + (new << FASTER_BITS))
        awaited = Signal.like(
            self.native_position_fine, init=compare.in_lsb(compare.start, carrying.position_fine_bits)
        )
        beyond = Signal.like(awaited)
        m.d.comb += beyond.eq((place >> carrying.more_bits) - awaited)
        ahead = beyond[-1] ^ (compare.direction == BACKWARD)
        armed = Signal()
        m.d.sync += armed.eq((armed | ahead) & ~(loads & self._has_moved(m)))
        with m.If(loads):
            m.d.sync += speed.eq(new)
        there = armed & ~ahead & (self.position_compare_count != compare.count if compare.count else 1)
        return awaited, there, [awaited.eq(awaited + compare.in_lsb(compare.apart, carrying.position_fine_bits))]
