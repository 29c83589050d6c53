"""The tracking method for many axes."""

from collections.abc import Sequence
from functools import reduce
from operator import or_

from amaranth import C, Module, Mux, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.saturate import saturate
from tachometry.hdl.axes.axis_tick_counts import BLOCK, counts_layout
from tachometry.hdl.axes.track_turns import SHOWN_AFTER, TrackTurns, shown_of, turn_layout
from tachometry.hdl.output.update import shown_layout, update_layout
from tachometry.hdl.output.velocity_output import PipelinedVelocityOutput
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, by_name, follow, only_if
from tachometry.spec.methods.axes import AxesSpec
from tachometry.spec.methods.axis import output_cycles
from tachometry.spec.methods.track_axis import TrackAxis


def tick_layout(axis: TrackAxis) -> data.StructLayout:
    """Return the values that are new with the tick of an axis."""
    shapes = {"pulse_count": signed(axis.widths.count), "position": signed(axis.position_width)}
    return data.StructLayout({**shapes, "overflow": 1})


def kept_layout(axis: TrackAxis) -> data.StructLayout:
    """Return the values of an axis between two turns: its position, and the time since its last count."""
    most = axis.timing.max_ticks
    shapes = {"position": signed(axis.position_width), "elapsed": range(most + 1), "counted": 1}
    return data.StructLayout(shapes)


class AxesTrackDatapath(Box):
    """Tracking datapath that the axes have in turn; as many machines as all turns of a tick need.

    Latency: the outputs of an axis are new `spec.plan.latency` clocks after its turn has begun.
    """

    def __init__(self, spec: AxesSpec) -> None:
        self._spec = spec
        axis = spec.axis
        assert isinstance(axis, TrackAxis)
        self._axis = axis
        self.machines = [TrackTurns(spec, number) for number in range(spec.plan.machines)]
        layout = update_layout(axis)
        self.velocity_output: PipelinedVelocityOutput | None = None
        if axis.velocity.output is not None:
            self.velocity_output = PipelinedVelocityOutput(axis.velocity.output, layout)
            layout = shown_layout(layout, axis.velocity.output)
        self._update = layout
        super().__init__(
            complete=In(1),  # `count` is handed over; the turns begin with the clock after that of axis 0
            slot=In(range(spec.slots)),  # that the count belongs to
            count=In(counts_layout(axis.form)),
            # With `count`, where the index resets it; else the position is the sum of the counts.
            **only_if(axis.front_end.index_resets, handed_position=In(signed(axis.position_width))),
            tick=Out(1),  # one clock for every axis in every tick
            velocity_valid=Out(1),
            axis=Out(range(max(spec.axes, 2))),  # valid with `tick`, as are all others
            **{name: Out(shape) for name, shape in tick_layout(axis).members.items()},
            **{name: Out(shape) for name, shape in layout.members.items()},
            **only_if(axis.extras, native_velocity=Out(signed(axis.velocity.native))),
        )

    @property
    def probes(self) -> dict[str, Value]:
        return {"turn": self.axis}

    def build(self, m: Module) -> None:
        length = self._length(m)
        for number, turns in enumerate(self.machines):
            m.submodules[f"machine_{number}"] = turns
            follow(m, turns, self, ("complete", "slot", "count"))
            m.d.comb += turns.length.eq(length)
            if self._axis.front_end.index_resets:
                m.d.comb += turns.handed_position.eq(self.handed_position)
        valid, whose, ticks, update = self._shown(m)
        shown: data.View = update
        if self.velocity_output is not None:
            m.submodules.velocity_output = output = self.velocity_output
            m.d.comb += [output.updates.valid.eq(valid), output.updates.p.eq(update)]
            if len(self.machines) > 1:  # else they hold for long enough
                whose, ticks = delay(m, whose, ticks, clocks=output_cycles(self._axis))
            valid, shown = output.shown.valid, output.shown.p
        m.d.comb += [
            self.tick.eq(valid),
            self.velocity_valid.eq(valid),
            self.axis.eq(whose),
            *(port.eq(ticks[name]) for name, port in by_name(self, tick_layout(self._axis).members).items()),
            *(port.eq(shown[name]) for name, port in by_name(self, self._update.members).items()),
        ]
        if self._axis.extras:
            m.d.comb += self.native_velocity.eq(update.velocity)

    def _shown(self, m: Module) -> tuple[Signal, Signal, data.View, data.View]:
        """Return a strobe, whose turn is shown with it, and what is new: it is added up once for all machines."""
        layout = kept_layout(self._axis)
        m.submodules.state = state = Memory(shape=layout, depth=1 << len(self.axis), init=[], attrs=BLOCK)
        read = state.read_port()
        write = state.write_port()
        # Strobes of every machine in four clocks of its turn; no two machines have the same one at once.
        comes = [turns.comes for turns in self.machines]
        reads = delay(m, *comes)
        adds = delay(m, *reads)
        shows = delay(m, *adds)
        m.d.comb += read.addr.eq(self._of(comes, [turns.axis for turns in self.machines]))
        (of_axis,) = delay(m, read.addr, clocks=SHOWN_AFTER - 1)
        known = Signal(turn_layout(self._axis))
        found = Signal(turn_layout(self._axis))
        turns = [Value.cast(turns.turn) for turns in self.machines]
        m.d.comb += [known.eq(self._of(reads, turns)), found.eq(self._of(shows, turns))]
        added = self._added(m, read.data, known)
        m.d.comb += [write.addr.eq(of_axis), write.data.eq(added[0]), write.en.eq(reduce(or_, shows))]
        return self._held(m, write.en, of_axis, added, found)

    def _added(self, m: Module, kept: data.View, known: data.View) -> tuple[data.View, Sequence[Value]]:
        """Return the values to keep of an axis from this turn on, and its counts of the tick with their overflow."""
        axis, most = self._axis, self._axis.timing.max_ticks
        before = Signal(kept_layout(axis))
        after = Signal(kept_layout(axis))
        m.d.sync += before.eq(kept)
        with m.If(known.first):
            m.d.sync += [before.position.eq(0), before.elapsed.eq(most), before.counted.eq(0)]
        moved, counted = delay(m, known.moved, known.counted)
        position: Value = before.position + moved
        if axis.front_end.index_resets:
            (position,) = delay(m, known.position)
        pulses, overflow = moved, C(0)
        if axis.tick.max_count < axis.form.longest_tick:
            pulses, overflow = saturate(m, moved, axis.tick.max_count)
        m.d.sync += [
            after.position.eq(position),
            after.elapsed.eq(Mux(before.counted, 1, before.elapsed + (before.elapsed != most))),
            after.counted.eq(counted),
        ]
        return after, delay(m, pulses, overflow)

    def _held(
        self, m: Module, now: Value, of_axis: Signal, added: tuple[data.View, Sequence[Value]], found: data.View
    ) -> tuple[Signal, Signal, data.View, data.View]:
        """Return a strobe a clock after `now`, and what holds with it from then on."""
        axis, (after, counts) = self._axis, added
        valid = Signal()
        whose = Signal.like(self.axis)
        ticks = Signal(tick_layout(axis))
        new = Signal(update_layout(axis))
        m.d.sync += valid.eq(now)
        rounded = (after.position << axis.position_fine_bits) + (found.place >> 1) + found.place[0]
        with m.If(now):
            m.d.sync += [
                whose.eq(of_axis),
                ticks.position.eq(after.position),
                ticks.pulse_count.eq(counts[0]),
                ticks.overflow.eq(counts[1]),
                *(new[name].eq(found[name]) for name in shown_of(axis)),
                new.position_fine.eq(rounded),
                new.interval.eq(after.elapsed),
                new.forced.eq(~after.counted),
                new.standstill.eq(found.standstill & ~after.counted),
            ]
        return valid, whose, ticks, new

    @staticmethod
    def _of(strobes: Sequence[Signal], values: Sequence[Value]) -> Value:
        """Return the value of the machine whose strobe is high; two never are at once."""
        return reduce(lambda rest, one: Mux(one[0], one[1], rest), zip(strobes[1:], values[1:], strict=True), values[0])

    def _length(self, m: Module) -> Signal:
        """Return the rounds of the tick whose counts have been handed over."""
        form = self._axis.form
        length = Signal(range(form.longest_tick + 1), init=form.tick_cycles)
        if not form.external:
            return length
        rounds = Signal.like(length, init=1)
        with m.If(self.slot == 0):
            m.d.sync += rounds.eq(rounds + 1)
            with m.If(self.complete):
                m.d.sync += [length.eq(rounds), rounds.eq(1)]
        return length
