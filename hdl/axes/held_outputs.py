"""The outputs of every axis are held."""

from collections.abc import Mapping, Sequence

from amaranth import Module, Shape, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box, by_name


class HeldOutputs(Box):
    """Holds every value of every axis in a register.

    Latency: a value is in its register in the clock after its strobe.
    """

    def __init__(self, axes: int, axis_width: int, values: Mapping[str, Shape]) -> None:
        self._axes = axes
        self._names: Sequence[str] = tuple(values)
        super().__init__(
            strobe=In(1),
            axis=In(axis_width),  # that the values belong to
            **{name: In(shape) for name, shape in values.items()},
            # The latest value of each axis, at first 0.
            **{f"{name}_{axis}": Out(shape) for axis in range(axes) for name, shape in values.items()},
        )

    def build(self, m: Module) -> None:
        new = by_name(self, self._names)
        for axis in range(self._axes):
            mine = Signal(name=f"of_{axis}")
            m.d.comb += mine.eq(self.strobe & (self.axis == axis))
            with m.If(mine):
                m.d.sync += [held.eq(new[name]) for name, held in by_name(self, new, f"{{}}_{axis}").items()]
