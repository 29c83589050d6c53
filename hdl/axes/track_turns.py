"""One machine of the tracking method, which some axes have in turn."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import data, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.axes.axis_tick_counts import BLOCK, counts_layout
from tachometry.hdl.methods.track_machine import TrackMachine
from tachometry.hdl.output.update import update_layout
from tachometry.spec.formats.tracking import PLACE_BITS
from tachometry.spec.methods.axes import AxesSpec
from tachometry.spec.methods.axis import output_cycles
from tachometry.spec.methods.track_axis import TrackAxis


def tick_layout(axis: TrackAxis) -> data.StructLayout:
    """Return what is new with the tick of an axis."""
    shapes = {"pulse_count": signed(axis.widths.count), "position": signed(axis.position_width)}
    return data.StructLayout({**shapes, "overflow": 1, "stalled": 1})


class TrackTurns(wiring.Component):
    """Gives one machine to one axis after the other, and follows their positions and silences.

    Latency: what is shown of an axis is new `latency` clocks after its turn has begun.

    Parameters
    ----------
    spec : AxesSpec
    machine : int
        Which of `spec.plan.machines` it is.

    Members
    -------
    complete, slot, count, handed_position : In
        As of `AxesTrackDatapath`.
    length : In
        Rounds of the tick.
    valid : Out(1)
        The others are new. They hold until the next turn; but where nothing is converted, and there are other
        machines, they are 0 until then.
    axis : Out(range(axes))
    ticks : Out(tick_layout(axis))
    update : Out(update_layout(axis))
    """

    def __init__(self, spec: AxesSpec, machine: int) -> None:
        axis = spec.axis
        assert isinstance(axis, TrackAxis)
        self._spec, self._axis, self._number = spec, axis, machine
        self._own = range(machine, spec.axes, spec.plan.machines)
        self.machine = TrackMachine(*(axis.at(number, spec.delay(number)).program for number in self._own))
        position = {"handed_position": In(signed(axis.position_width))} if axis.front_end.index_resets else {}
        super().__init__(
            {
                "complete": In(1),
                "slot": In(range(spec.slots)),
                "count": In(counts_layout(axis.form)),
                **position,
                "length": In(range(axis.form.longest_tick + 1)),
                "valid": Out(1),
                "axis": Out(range(max(spec.axes, 2))),
                "ticks": Out(tick_layout(axis)),
                "update": Out(update_layout(axis)),
            }
        )

    @property
    def latency(self) -> int:
        """Clocks from the beginning of a turn to `valid`."""
        return self._axis.program.clocks

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec, axis, machine = self._spec, self._axis, self.machine
        m.submodules.machine = machine
        plan, n = spec.plan, len(self._own)
        # Negative until the first turn begins.
        clock = Signal(signed(plan.cycles.bit_length() + 1))
        running = Signal()
        first = Signal(init=1)  # the memory is not that of a reset
        turn = Signal(range(max(n, 2)))
        whose = Signal.like(self.axis)
        at = {name: running & (clock == place) for name, place in (("begin", 0), ("read", 1), ("add", 2), ("keep", 3))}
        shows = running & (clock == axis.program.clocks - 1)
        ends = running & (clock == plan.cycles - 1)
        m.d.sync += clock.eq(clock + 1)
        with m.If(ends):
            m.d.sync += [clock.eq(0), turn.eq(turn + 1), whose.eq(whose + plan.machines)]
            with m.If(turn == n - 1):
                m.d.sync += [running.eq(0), first.eq(0)]
        with m.If(self.complete & (self.slot == 0)):
            m.d.sync += [running.eq(1), clock.eq(-self._number * plan.apart), turn.eq(0), whose.eq(self._number)]
        counts, position = self._handed(m, whose, at["read"])
        after, pulses, saturated = self._follow(m, turn, first, counts, position, at)
        names = ("number", "times", "places", "last", "moved", "kind", "end", "down")
        m.d.comb += [getattr(machine, name).eq(counts[name]) for name in names]
        m.d.comb += [machine.begin.eq(at["begin"]), machine.length.eq(self.length)]
        if n > 1:
            m.d.comb += machine.axis.eq(turn)
        if plan.machines > 1 and not output_cycles(axis):
            m.d.sync += [self.axis.eq(0), self.ticks.eq(0), self.update.eq(0)]
        with m.If(shows):
            m.d.sync += [self.axis.eq(whose), self.ticks.pulse_count.eq(pulses), self.ticks.overflow.eq(saturated)]
        self._show(m, counts, after, shows)
        return m

    def _handed(self, m: Module, whose: Signal, reads: Signal) -> tuple[data.View, Signal | None]:
        """Return counts of the axis that has its turn, and its position if an index may reset it."""
        names = ("count", "handed_position") if self._axis.front_end.index_resets else ("count",)
        shape = data.StructLayout({name: getattr(self, name).shape() for name in names})
        m.submodules.handed_over = handed = Memory(shape=shape, depth=self._spec.slots, init=[], attrs=BLOCK)
        read = handed.read_port()
        write = handed.write_port()
        taken = Signal(shape)
        m.d.comb += [
            write.addr.eq(self.slot),
            *(write.data[name].eq(getattr(self, name)) for name in names),
            write.en.eq(self.complete),
            read.addr.eq(whose),
        ]
        with m.If(reads):
            m.d.sync += taken.eq(read.data)
        return taken.count, taken.handed_position if self._axis.front_end.index_resets else None

    def _follow(
        self, m: Module, turn: Signal, first: Signal, counts: data.View, position: Signal | None, at: dict[str, Signal]
    ) -> tuple[data.View, Signal, Signal]:
        """Follow position and silence of the axis, whose state is in a memory."""
        axis, most = self._axis, self._axis.timing.max_ticks
        kept = data.StructLayout(
            {
                "position": signed(axis.position_width),
                "elapsed": range(most + 1),
                "counted": 1,
                "silent": range(most + 2),
            }
        )
        m.submodules.state = state = Memory(shape=kept, depth=max(len(self._own), 2), init=[], attrs=BLOCK)
        read = state.read_port()
        write = state.write_port()
        before = Signal(kept)
        after = Signal(kept)
        with m.If(at["read"]):
            m.d.sync += before.eq(read.data)
            with m.If(first):
                m.d.sync += [before.position.eq(0), before.elapsed.eq(most), before.counted.eq(0), before.silent.eq(1)]
        overflow = Signal()
        saturated = Signal()
        pulses = Signal(signed(axis.widths.count))
        m_e: Signal = counts.moved
        if axis.widths.max_count < axis.form.longest_tick:
            m_e, overflow = saturate(m, counts.moved, axis.widths.max_count)
        long = before.silent == most + 1
        waits = before.elapsed + (before.elapsed != most)
        with m.If(at["add"]):
            m.d.sync += [
                after.position.eq(before.position + counts.moved if position is None else position),
                after.elapsed.eq(Mux(before.counted, 1, waits)),
                after.counted.eq(counts.number.any()),
                after.silent.eq(Mux(counts.moved.any(), 0, before.silent + ~long)),
                pulses.eq(m_e),
                saturated.eq(overflow),
            ]
        m.d.comb += [read.addr.eq(turn), write.addr.eq(turn), write.data.eq(after), write.en.eq(at["keep"])]
        return after, pulses, saturated

    def _show(self, m: Module, counts: data.View, after: data.View, shows: Signal) -> None:
        """Show what the machine has found, and what belongs to the tick."""
        axis, machine, new, ticks = self._axis, self.machine, self.update, self.ticks
        shift = PLACE_BITS - axis.fine_bits
        m.d.sync += self.valid.eq(shows)
        with m.If(shows):
            m.d.sync += [
                ticks.position.eq(after.position),
                ticks.stalled.eq(after.silent == axis.timing.max_ticks + 1),
                new.velocity.eq(machine.velocity),
                new.acceleration.eq(machine.acceleration),
                new.quality.eq(machine.quality),
                new.position_fine.eq(
                    (after.position << axis.fine_bits)
                    + (machine.position_fine >> shift)
                    + machine.position_fine[shift - 1]
                ),
                new.interval.eq(after.elapsed),
                new.forced.eq(~counts.number.any()),
            ]
