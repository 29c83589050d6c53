"""The whole core for many axes."""

from collections.abc import Sequence
from typing import Any

from amaranth import Module, Signal, Value
from amaranth.lib import wiring

from tachometry.hdl.arithmetic.idle import Idle, IdleRounds, idle_of
from tachometry.hdl.axes.axes_datapath import AxesDatapath
from tachometry.hdl.axes.axes_track_datapath import AxesTrackDatapath
from tachometry.hdl.axes.axis_counters import AxisCounters, of_slot
from tachometry.hdl.axes.axis_filter import AxisFilter
from tachometry.hdl.axes.axis_index import AxisIndex
from tachometry.hdl.axes.axis_tick_counts import AxisTickCounts
from tachometry.hdl.axes.held_outputs import HeldOutputs
from tachometry.hdl.axes.rounds import Rounds
from tachometry.hdl.extras import gates_of, place
from tachometry.hdl.front_end.index_state import in_state
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, by_name, drive, follow, members
from tachometry.hdl.wires.synchronizer import Synchronizer
from tachometry.spec.language.port import INDEX, TICK, UPDATE
from tachometry.spec.methods.axes import AxesSpec
from tachometry.spec.methods.axis import WARM_UP
from tachometry.spec.methods.track_axis import TrackAxis

_Values = dict[str, Value]  # by their names


class AxesTachometer(Box):
    """Pins of many encoders in, their positions and velocities out."""

    def __init__(self, spec: AxesSpec) -> None:
        self._spec = spec
        super().__init__(members(spec.ports))
        longest = spec.axis.tick.longest
        external = (spec.axis.times.min_tick_cycles, longest) if spec.axis.external_tick else None
        self.rounds = Rounds(spec.slots, spec.rounds, WARM_UP, external)
        self.axis_filter: AxisFilter | None = None
        if spec.axis.filter_clocks:
            self.axis_filter = AxisFilter(
                slots=spec.slots, looks=spec.axis.filter_clocks, lines=spec.axis.front_end.lines
            )
        decoded: dict[str, Any] = {"decoding": spec.axis.encoder.decoding, "reverse": spec.axis.encoder.reverse}
        self.axis_counters: AxisCounters
        self.datapath: AxesDatapath | AxesTrackDatapath
        if isinstance(spec.axis, TrackAxis):
            self.axis_counters = AxisTickCounts(slots=spec.slots, form=spec.axis.form, **decoded)
            self.datapath = AxesTrackDatapath(spec)
        else:
            self.axis_counters = AxisCounters(slots=spec.slots, rounds=longest, **decoded)
            self.datapath = AxesDatapath(spec)
        self.axis_index: AxisIndex | None = None
        if spec.axis.index:
            self.axis_index = AxisIndex(
                slots=spec.slots, width=spec.axis.position_width, resets=spec.axis.front_end.index_resets
            )
        self.extras = {extra.name: gates_of(extra, spec) for extra in spec.axis.extras}

    @property
    def spec(self) -> AxesSpec:
        """The spec that this core was built from."""
        return self._spec

    @property
    def idle(self) -> tuple[Idle, ...]:
        """Rounds that a simulation may skip, until the last one of a tick."""
        moving = idle_of({"rounds.sampling_clock": self.rounds.sampling_clock})
        return (IdleRounds("rounds.slot", self._spec.slots, moving),) if moving else ()

    def build(self, m: Module) -> None:
        spec = self._spec
        m.submodules.rounds = rounds = self.rounds
        m.submodules.axis_counters = counters = self.axis_counters
        m.submodules.datapath = datapath = self.datapath
        level: _Values = {pin.name: Signal(pin.width, name=f"level_{pin.name}") for pin in spec.ports.pins}
        for name, pin in by_name(self, level).items():
            m.submodules[f"sync_{name}"] = Synchronizer(pin, level[name])
        if spec.axis.external_tick:
            m.d.comb += [rounds.tick_in.eq(level["tick_in"]), self.tick_error.eq(rounds.tick_error)]
        at, level, known = self._looks(m, {name: level[name] for name in spec.axis.front_end.lines})
        level |= {name: ~level[name] for name in spec.axis.encoder.inverted}
        m.d.comb += [
            counters.slot.eq(at["slot"]),
            counters.first.eq(at["first"]),
            counters.last.eq(at["last"]),
            counters.ready.eq(at["ready"] & known["a"] & known["b"]),
            counters.level_a.eq(level["a"]),
            counters.level_b.eq(level["b"]),
            self.decode_error.eq(counters.decode_error),
            self.decode_error_axis.eq(counters.axis),
        ]
        handed: Sequence[Signal] = counters.complete, counters.axis, counters.count
        if spec.axis.front_end.index_resets:  # the position is a clock later
            handed = delay(m, *handed)
        m.d.comb += [
            box.eq(value) for box, value in zip((datapath.complete, datapath.slot, datapath.count), handed, strict=True)
        ]
        taps = {"ready": at["ready"], "slot": counters.axis, "step": counters.step, "complete": counters.complete}
        taps |= {} if self.axis_index is None else {"index_rises": self.axis_index.index_valid}
        place(m, datapath, self.extras, taps)
        self._show(m, TICK, "axis", datapath)
        self._show(m, UPDATE, "axis", datapath)
        if self.axis_index is not None:
            self._index(m, self.axis_index, at, level, known)

    def _index(self, m: Module, index: AxisIndex, at: _Values, level: _Values, known: _Values) -> None:
        """Capture the position of an axis at its index."""
        m.submodules.axis_index = index
        front = self._spec.axis.front_end
        state, all_known = front.index_state, known["z"] & known["a"] & known["b"]
        m.d.comb += [
            index.slot.eq(at["slot"]),
            index.ready.eq(at["ready"]),
            index.known.eq(at["ready"] & known["z"] if state is None else at["ready"] & all_known),
            index.level_z.eq(level["z"] if state is None else level["z"] & in_state((level["a"], level["b"]), state)),
            index.step.eq(self.axis_counters.step),
        ]
        if front.index_resets:
            m.d.comb += self.datapath.handed_position.eq(index.position)
        self._show(m, INDEX, "index_axis", index)

    def _looks(self, m: Module, levels: _Values) -> tuple[_Values, _Values, _Values]:
        """Return place in the tick and levels of the axis whose slot it is, and whether these are known by then."""
        rounds = self.rounds
        level = {name: of_slot(value, rounds.slot) for name, value in levels.items()}
        names = ("slot", "first", "last", "ready")
        if self.axis_filter is None:
            known = dict.fromkeys(level, rounds.ready)
            return by_name(rounds, names), level, known
        m.submodules.axis_filter = box = self.axis_filter
        follow(m, box, rounds, (*names, "real"))
        drive(m, box, level, "level_{}")
        return by_name(box, names, "seen_{}"), by_name(box, level, "filtered_{}"), by_name(box, level, "known_{}")

    def _show(self, m: Module, name: str, axis_name: str, box: wiring.Component) -> None:
        """Show what is new with a strobe: as it comes, or held for each axis."""
        names, values = [port.name for port in self._spec.axis.ports.outputs if port.held_by == name], _Values()
        for source in (*self.extras.values(), box):
            values |= by_name(source, (one for one in names if one in source.signature.members))
        strobe, axis = values.pop(name), box.axis
        for extra in self.extras.values() if name != INDEX else ():
            strobe = extra.shows  # the box still shows the same
        if self._spec.parallel:
            shapes = {value: signal.shape() for value, signal in values.items()}
            held = HeldOutputs(self._spec.axes, len(axis), shapes)
            m.submodules[f"held_{name}"] = held
            m.d.comb += [held.strobe.eq(strobe), held.axis.eq(axis)]
            drive(m, held, values)
            values = by_name(held, (f"{value}_{k}" for value in shapes for k in range(self._spec.axes)))
            strobe, axis = delay(m, strobe, axis)
        drive(m, self, {name: strobe, **values})
        if name != UPDATE:  # its axis is that of its tick
            drive(m, self, {axis_name: axis})
