"""Inputs that change only between two programs."""

from collections.abc import Iterable

from amaranth import Module
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box, by_name, members
from tachometry.spec.language.port import Port


class HeldInputs(Box):
    """Takes all inputs together in the clock before a control tick, unless they are frozen."""

    def __init__(self, ports: Iterable[Port]) -> None:
        shapes = {name: member.shape for name, member in members(ports).items()}
        self._names = tuple(shapes)
        super().__init__(
            coming=In(1),  # a control tick is in the next clock
            freeze=In(1),
            **{f"given_{name}": In(shape) for name, shape in shapes.items()},
            **{name: Out(shape) for name, shape in shapes.items()},
        )

    def build(self, m: Module) -> None:
        with m.If(self.coming & ~self.freeze):
            given = by_name(self, self._names, "given_{}")
            m.d.sync += [port.eq(given[name]) for name, port in by_name(self, self._names).items()]
