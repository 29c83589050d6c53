"""Drive one component clock by clock."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from operator import attrgetter
from typing import Any, overload

from amaranth import Elaboratable, Module, ResetInserter, Shape, Signal, Value
from amaranth.lib import data, wiring
from amaranth.sim import Simulator


class Resettable(Elaboratable):
    """A box with a reset of its own, `rst`."""

    def __init__(self, core: Any) -> None:
        self.core = core
        self.rst = Signal()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.core, name)

    def elaborate(self, platform: object) -> Any:
        return ResetInserter(self.rst)(self.core)


def member(component: wiring.Component, name: str) -> Any:
    """Return what `name` is of a component, or of its updates, whose strobe is `velocity_valid`, or of what comes after
    these with `update_valid`; a path has dots.
    """
    if "." in name or hasattr(component, name):
        return attrgetter(name)(component)
    updates, rest = component.updates, getattr(component, "rest", component.updates)
    if name in ("velocity_valid", "update_valid"):
        return (updates if name == "velocity_valid" else rest).valid
    return (updates if name in updates.p.shape().members else rest).p[name]


class Seen(Sequence[dict[str, int]]):
    """Outputs in each clock, as integers; `bits` are those of a clock in one word.

    A clock is simulated when it is asked for: a test that fails at one simulates none behind it.

    - `layout`: Of the word.
    """

    def __init__(self, layout: data.StructLayout, n_clocks: int, bits: Iterator[int]) -> None:
        # Amaranth's own view of such a word takes longer than the simulation.
        self._fields = [
            (name, field.offset, (1 << field.width) - 1, 1 << field.width - 1 if Shape.cast(field.shape).signed else 0)
            for name, field in layout
        ]
        self._n_clocks = n_clocks
        self._bits: list[int] = []
        self._more = bits

    def __len__(self) -> int:
        return self._n_clocks

    @overload
    def __getitem__(self, clock: int) -> dict[str, int]: ...

    @overload
    def __getitem__(self, clock: slice) -> list[dict[str, int]]: ...

    def __getitem__(self, clock: int | slice) -> dict[str, int] | list[dict[str, int]]:
        if isinstance(clock, slice):
            return [self[k] for k in range(self._n_clocks)[clock]]
        clock = range(self._n_clocks)[clock]
        if clock >= len(self._bits):
            self._bits.extend(islice(self._more, clock + 1 - len(self._bits)))
        bits = self._bits[clock]
        return {name: (bits >> low & mask ^ sign) - sign for name, low, mask, sign in self._fields}


def clock_by_clock(component: wiring.Component, inputs: Sequence[Mapping[str, int]], outputs: Sequence[str]) -> Seen:
    """Apply a row of inputs in each clock (what a row leaves out stays) and return the outputs seen in it."""
    top = Module()
    top.submodules.component = component
    values = {name: Value.cast(member(component, name)) for name in outputs}
    # One signal of all outputs, and inputs that change: every access costs as much as a small component.
    layout = data.StructLayout({name: value.shape() for name, value in values.items()})
    packed = Signal(layout)
    top.d.comb += [packed[name].eq(value) for name, value in values.items()]
    pins = {name: member(component, name) for row in inputs for name in row}
    seen: deque[int] = deque()

    async def bench(ctx: Any) -> None:
        now: dict[str, int] = {}
        for row in inputs:
            for name, value in row.items():
                if now.get(name) != value:
                    ctx.set(pins[name], value)
                    now[name] = value
            seen.append(ctx.get(packed.as_value()))
            await ctx.delay(1e-6)

    simulator = Simulator(top)
    simulator.add_clock(1e-6, if_exists=True)
    simulator.add_testbench(bench)

    def simulated() -> Iterator[int]:
        while simulator.advance() or seen:
            while seen:
                yield seen.popleft()

    return Seen(layout, len(inputs), simulated())


Player = Callable[[wiring.Component, Sequence[Mapping[str, int]], Sequence[str]], Seen]


def ticks(box: wiring.Component, m_e: Sequence[int], clocks: int) -> list[dict[str, int]]:
    """Return rows for a datapath that works on ticks: these pulse numbers at ticks so many clocks apart, the first at
    clock 1.

    A datapath that is told of a tick in the clock before it is told so.
    """
    told = hasattr(box, "coming")
    rows: list[dict[str, int]] = [{"tick": 0} for _ in range(1 + len(m_e) * clocks)]
    for i, number in enumerate(m_e):
        rows[1 + i * clocks] |= {"tick": 1, "pulse_count": number}
        if told:
            rows[1 + i * clocks] |= {"coming": 0}
            rows[i * clocks] |= {"coming": 1, "next_count": number}
    return rows
