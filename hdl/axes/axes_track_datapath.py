"""The tracking method for many axes."""

from functools import reduce
from operator import or_

from amaranth import Module, Signal, Value, signed
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.axes.axis_tick_counts import counts_layout
from tachometry.hdl.axes.track_turns import TrackTurns, tick_layout
from tachometry.hdl.output.update import shown_layout, update_layout
from tachometry.hdl.output.velocity_output import PipelinedVelocityOutput
from tachometry.hdl.wires.delay import delay
from tachometry.spec.methods.axes import AxesSpec
from tachometry.spec.methods.track_axis import TrackAxis


class AxesTrackDatapath(wiring.Component):
    """Tracking datapath that the axes have in turn; as many machines as all turns of a tick need.

    Latency: the outputs of an axis are new `spec.plan.latency` clocks after its turn has begun.

    Parameters
    ----------
    spec : AxesSpec

    Members
    -------
    complete : In(1)
        `count` is handed over. The turns begin with the clock after that of axis 0.
    slot : In(range(slots))
        Whose count it is.
    count : In(counts_layout(form))
    handed_position : In(signed)
        Of this axis, only where the index resets it; else it is the sum of the counts.
    tick, velocity_valid : Out(1)
        One clock for every axis in every tick.
    axis : Out(range(axes))
        Valid with `tick`, as are all other outputs, by the names of the ports.
    """

    def __init__(self, spec: AxesSpec) -> None:
        self._spec = spec
        axis = spec.axis
        assert isinstance(axis, TrackAxis)
        self._axis = axis
        self.machines = [TrackTurns(spec, number) for number in range(spec.plan.machines)]
        layout = update_layout(axis)
        self.velocity_output: PipelinedVelocityOutput | None = None
        if axis.scale.output is not None:
            self.velocity_output = PipelinedVelocityOutput(axis.scale.output, layout)
            layout = shown_layout(layout, axis.scale.output)
        self._update = layout
        position = {"handed_position": In(signed(axis.position_width))} if axis.front_end.index_resets else {}
        super().__init__(
            {
                "complete": In(1),
                "slot": In(range(spec.slots)),
                "count": In(counts_layout(axis.form)),
                **position,
                "tick": Out(1),
                "velocity_valid": Out(1),
                "axis": Out(range(max(spec.axes, 2))),
                **{name: Out(shape) for name, shape in tick_layout(axis).members.items()},
                **{name: Out(shape) for name, shape in layout.members.items()},
            }
        )

    @property
    def probes(self) -> dict[str, Value]:
        """Signals of the inside that a waveform should show."""
        return {"turn": self.axis}

    def elaborate(self, platform: object) -> Module:
        m = Module()
        length = self._length(m)
        for number, turns in enumerate(self.machines):
            m.submodules[f"machine_{number}"] = turns
            m.d.comb += [getattr(turns, name).eq(getattr(self, name)) for name in ("complete", "slot", "count")]
            m.d.comb += turns.length.eq(length)
            if self._axis.front_end.index_resets:
                m.d.comb += turns.handed_position.eq(self.handed_position)
        valid = [turns.valid for turns in self.machines]
        update = Signal(self.machines[0].update.shape())
        m.d.comb += update.eq(self._of(valid, "update"))
        shown: data.View = update
        if self.velocity_output is not None:
            m.submodules.velocity_output = output = self.velocity_output
            m.d.comb += [output.updates.valid.eq(reduce(or_, valid)), output.updates.p.eq(update)]
            output_clocks = self._spec.plan.latency - self.machines[0].latency
            valid, shown = list(delay(m, *valid, clocks=output_clocks)), output.shown.p
        ticks = Signal(tick_layout(self._axis))
        m.d.comb += [
            self.tick.eq(reduce(or_, valid)),
            self.velocity_valid.eq(self.tick),
            self.axis.eq(self._of(valid, "axis")),
            ticks.eq(self._of(valid, "ticks")),
            *(getattr(self, name).eq(ticks[name]) for name in ticks.shape().members),
            *(getattr(self, name).eq(shown[name]) for name in self._update.members),
        ]
        return m

    def _of(self, valid: list[Signal], name: str) -> Value:
        """Return what that machine shows whose turn it is; two never do at once."""
        values = [Value.cast(getattr(turns, name)) for turns in self.machines]
        if len(values) > 1 and self.velocity_output is not None:  # else the others show 0
            values = [value & is_it.replicate(len(value)) for value, is_it in zip(values, valid, strict=True)]
        return reduce(or_, values)

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
