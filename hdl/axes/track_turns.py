"""One machine of the tracking method, which some axes have in turn."""

from amaranth import Module, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.axes.axis_tick_counts import BLOCK, counts_layout
from tachometry.hdl.methods.track import delay_of
from tachometry.hdl.methods.track_machine import TrackMachine
from tachometry.hdl.output.update import update_layout
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, by_name, drive, only_if
from tachometry.spec.formats.tracking import PLACE_BITS, WIDTH
from tachometry.spec.formats.tracking_code import SMOOTH
from tachometry.spec.methods.axes import AxesSpec
from tachometry.spec.methods.track_axis import TrackAxis

SHOWN_AFTER = 4  # clocks


def shown_of(axis: TrackAxis) -> tuple[str, ...]:
    """Return the names of what an update takes from the machine as it is."""
    return ("velocity", "acceleration", "velocity_std", *(SMOOTH if axis.smooth else ()))


def turn_layout(axis: TrackAxis) -> data.StructLayout:
    """Return what a turn has and finds; `place` is that of `position_fine` with one bit more, relative to `position`.

    A `position` is only there if the index resets it.
    """
    layout = update_layout(axis).members
    return data.StructLayout(
        {
            "first": 1,  # turn of this axis after reset
            "moved": signed(axis.form.moved_bits),
            "counted": 1,
            **({"position": signed(axis.position_width)} if axis.front_end.index_resets else {}),
            **{name: layout[name] for name in (*shown_of(axis), "standstill")},
            "place": signed(WIDTH - PLACE_BITS + axis.position_fine_bits + 1),
        }
    )


class TrackTurns(Box):
    """Gives one machine to one axis after the other."""

    def __init__(self, spec: AxesSpec, machine: int) -> None:
        axis = spec.axis
        assert isinstance(axis, TrackAxis)
        self._spec, self._axis, self._number = spec, axis, machine
        self._own = range(machine, spec.axes, spec.plan.machines)
        self.machine = TrackMachine(*(axis.at(number, spec.delay(number)).program for number in self._own))
        super().__init__(
            # As in `AxesTrackDatapath`.
            complete=In(1),
            slot=In(range(spec.slots)),
            count=In(counts_layout(axis.form)),
            **only_if(axis.front_end.index_resets, handed_position=In(signed(axis.position_width))),
            length=In(range(axis.form.longest_tick + 1)),  # rounds of the tick
            comes=Out(1),  # `SHOWN_AFTER` clocks before the results are shown
            axis=Out(range(max(spec.axes, 2))),  # that has its turn
            # Results hold from the clock before they are shown to the end of the turn, all else from `comes` on.
            turn=Out(turn_layout(axis)),
        )

    def build(self, m: Module) -> None:
        spec, axis, machine = self._spec, self._axis, self.machine
        m.submodules.machine = machine
        plan, n = spec.plan, len(self._own)
        # Negative until the first turn begins.
        clock = Signal(signed(plan.cycles.bit_length() + 1))
        running = Signal()
        first = Signal(init=1)  # the memory is not that of a reset
        turn = Signal(range(max(n, 2)))
        begins, ends = (running & (clock == place) for place in (0, plan.cycles - 1))
        (reads,) = delay(m, begins)
        m.d.sync += clock.eq(clock + 1)
        with m.If(ends):
            m.d.sync += [clock.eq(0), turn.eq(turn + 1)]
            with m.If(turn == n - 1):
                m.d.sync += [running.eq(0), first.eq(0)]
        with m.If(self.complete & (self.slot == 0)):
            m.d.sync += [running.eq(1), clock.eq(-self._number * plan.apart), turn.eq(0)]
        m.d.comb += self.axis.eq(turn * plan.machines + self._number)
        counts, position = self._handed(m, reads)
        names = ("number", "times", "places", "last", "moved", "kind", "end", "down")
        drive(m, machine, {name: counts[name] for name in names})
        m.d.comb += [machine.begin.eq(begins), machine.length.eq(self.length)]
        if n > 1:
            m.d.comb += machine.axis.eq(turn)
        m.d.comb += [
            self.comes.eq(running & (clock == axis.program.clocks - SHOWN_AFTER)),
            self.turn.first.eq(first),
            self.turn.moved.eq(counts.moved),
            self.turn.counted.eq(counts.number.any()),
            *(
                self.turn[name].eq(delay_of(port, axis.form.time_bits) if name == SMOOTH[1] else port)
                for name, port in by_name(machine, (*shown_of(axis), "standstill")).items()
            ),
            self.turn.place.eq(machine.position_fine >> (PLACE_BITS - axis.position_fine_bits - 1)),
        ]
        if position is not None:
            m.d.comb += self.turn.position.eq(position)

    def _handed(self, m: Module, reads: Value) -> tuple[data.View, Signal | None]:
        """Return counts of the axis that has its turn, and its position if an index may reset it."""
        ports = by_name(self, ("count", "handed_position") if self._axis.front_end.index_resets else ("count",))
        shape = data.StructLayout({name: port.shape() for name, port in ports.items()})
        depth = 1 << len(self.slot)  # behind the last turn the axis is one more than there are
        m.submodules.handed_over = handed = Memory(shape=shape, depth=depth, init=[], attrs=BLOCK)
        read = handed.read_port()
        write = handed.write_port()
        taken = Signal(shape)
        m.d.comb += [
            write.addr.eq(self.slot),
            *(write.data[name].eq(port) for name, port in ports.items()),
            write.en.eq(self.complete),
            read.addr.eq(self.axis),
        ]
        with m.If(reads):
            m.d.sync += taken.eq(read.data)
        return taken.count, taken.handed_position if self._axis.front_end.index_resets else None
