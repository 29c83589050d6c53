"""Drive one component clock by clock."""

from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import Any

from amaranth.lib import wiring
from amaranth.sim import Simulator


def member(component: wiring.Component, name: str) -> Any:
    """What `name` is of a component, or of its updates, whose strobe is `velocity_valid`; a path has dots."""
    if "." in name or hasattr(component, name):
        return attrgetter(name)(component)
    updates = component.updates
    return updates.valid if name == "velocity_valid" else updates.p[name]


def clock_by_clock(
    component: wiring.Component, inputs: Sequence[Mapping[str, int]], outputs: Sequence[str]
) -> list[dict[str, int]]:
    """Apply a row of inputs in each clock (what a row leaves out stays) and return the outputs seen in it."""
    seen: list[dict[str, int]] = []

    async def bench(ctx: Any) -> None:
        for row in inputs:
            for name, value in row.items():
                ctx.set(member(component, name), value)
            seen.append({name: int(ctx.get(member(component, name))) for name in outputs})
            await ctx.delay(1e-6)

    simulator = Simulator(component)
    simulator.add_clock(1e-6, if_exists=True)
    simulator.add_testbench(bench)
    simulator.run()
    return seen
