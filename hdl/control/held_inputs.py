"""Inputs that change only between two programs."""

from collections.abc import Iterable

from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import by_name, members
from tachometry.spec.language.port import Port


class HeldInputs(wiring.Component):
    """Takes all inputs together in the clock before a control tick, unless they are frozen."""

    def __init__(self, ports: Iterable[Port]) -> None:
        shapes = {name: member.shape for name, member in members(ports).items()}
        self._names = tuple(shapes)
        super().__init__(
            {
                "coming": In(1),  # a control tick is in the next clock
                "freeze": In(1),
                **{f"given_{name}": In(shape) for name, shape in shapes.items()},
                **{name: Out(shape) for name, shape in shapes.items()},
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        with m.If(self.coming & ~self.freeze):
            given = by_name(self, self._names, "given_{}")
            m.d.sync += [port.eq(given[name]) for name, port in by_name(self, self._names).items()]
        return m
