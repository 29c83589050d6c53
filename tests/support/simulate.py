"""Drive one component clock by clock."""

from collections.abc import Mapping, Sequence
from typing import Any

from amaranth.lib import wiring
from amaranth.sim import Simulator


def clock_by_clock(
    component: wiring.Component, inputs: Sequence[Mapping[str, int]], outputs: Sequence[str]
) -> list[dict[str, int]]:
    """Apply a row of inputs in each clock (what a row leaves out stays) and return the outputs seen in it."""
    seen: list[dict[str, int]] = []

    async def bench(ctx: Any) -> None:
        for row in inputs:
            for name, value in row.items():
                ctx.set(getattr(component, name), value)
            seen.append({name: int(ctx.get(getattr(component, name))) for name in outputs})
            await ctx.delay(1e-6)

    simulator = Simulator(component)
    simulator.add_clock(1e-6, if_exists=True)
    simulator.add_testbench(bench)
    simulator.run()
    return seen
