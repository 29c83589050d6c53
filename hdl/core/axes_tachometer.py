"""The whole core for many axes."""

from amaranth import Module, Signal, Value
from amaranth.lib import wiring

from tachometry.hdl.axes.axes_datapath import AxesDatapath
from tachometry.hdl.axes.axis_counters import AxisCounters
from tachometry.hdl.axes.axis_index import AxisIndex
from tachometry.hdl.axes.held_outputs import HeldOutputs
from tachometry.hdl.axes.rounds import Rounds
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import follow, members
from tachometry.hdl.wires.synchronizer import Synchronizer
from tachometry.spec.language.port import INDEX, TICK, UPDATE
from tachometry.spec.methods.axes import WARM_UP, AxesSpec


class AxesTachometer(wiring.Component):
    """Pins of many encoders in, their positions and velocities out.

    Parameters
    ----------
    spec : AxesSpec

    Members
    -------
    The ports of the spec, less `clk` and `rst`, which are those of the `sync` domain.
    """

    def __init__(self, spec: AxesSpec) -> None:
        self._spec = spec
        super().__init__(members(spec.ports))
        self.rounds = Rounds(spec.slots, spec.rounds, WARM_UP)
        self.axis_counters = AxisCounters(
            axes=spec.axes, slots=spec.slots, rounds=spec.rounds, decoding=spec.axis.encoder.decoding
        )
        self.datapath = AxesDatapath(spec)
        self.axis_index: AxisIndex | None = None
        if spec.axis.index:
            self.axis_index = AxisIndex(axes=spec.axes, slots=spec.slots, width=spec.axis.position_width)

    @property
    def spec(self) -> AxesSpec:
        """The spec that this core was built from."""
        return self._spec

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._spec
        m.submodules.rounds = rounds = self.rounds
        m.submodules.axis_counters = counters = self.axis_counters
        m.submodules.datapath = datapath = self.datapath
        level = {pin.name: Signal(spec.axes, name=f"level_{pin.name}") for pin in spec.ports.pins}
        for name, levels in level.items():
            m.submodules[f"sync_{name}"] = Synchronizer(getattr(self, name), levels)
        follow(m, counters, rounds, ("slot", "first", "last", "ready"))
        m.d.comb += [
            counters.level_a.eq(level["a"]),
            counters.level_b.eq(level["b"]),
            datapath.complete.eq(counters.complete),
            datapath.slot.eq(counters.axis),
            datapath.count.eq(counters.count),
            self.decode_error.eq(counters.decode_error),
            self.decode_error_axis.eq(counters.axis),
        ]
        self._show(m, TICK, datapath.tick, "axis", datapath.axis, datapath)
        self._show(m, UPDATE, datapath.velocity_valid, "axis", datapath.axis, datapath)
        if self.axis_index is not None:
            m.submodules.axis_index = index = self.axis_index
            m.d.comb += [
                index.slot.eq(rounds.slot),
                index.ready.eq(rounds.ready),
                index.level_z.eq(level["z"]),
                index.step.eq(counters.step),
            ]
            self._show(m, INDEX, index.index_valid, "index_axis", index.axis, index)
        return m

    def _show(self, m: Module, name: str, strobe: Value, axis_name: str, axis: Value, box: wiring.Component) -> None:
        """Show what is new with a strobe: as it comes, or held for each axis."""
        values = {port.name: getattr(box, port.name) for port in self._spec.axis.ports.outputs if port.held_by == name}
        del values[name]
        if self._spec.parallel:
            shapes = {value: signal.shape() for value, signal in values.items()}
            held = HeldOutputs(self._spec.axes, len(axis), shapes)
            m.submodules[f"held_{name}"] = held
            m.d.comb += [held.strobe.eq(strobe), held.axis.eq(axis)]
            m.d.comb += [getattr(held, value).eq(signal) for value, signal in values.items()]
            values = {f"{value}_{k}": getattr(held, f"{value}_{k}") for value in shapes for k in range(self._spec.axes)}
            strobe, axis = delay(m, strobe, axis)
        m.d.comb += [getattr(self, port).eq(value) for port, value in {name: strobe, **values}.items()]
        if name != UPDATE:  # its axis is that of its tick
            m.d.comb += getattr(self, axis_name).eq(axis)
