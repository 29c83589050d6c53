"""Counts flip-flop changes per tick of cores, box by box, as dynamic power follows them: docs/measured/evidence.md.

The shaft turns at a constant speed, and the changes of all flip-flops are counted in every clock (Amaranth's
simulator), from the third tick on. Clock tree and wires are not counted.
"""

import math
from collections import Counter
from collections.abc import Iterator
from typing import Any

from amaranth import Cat, Fragment, Module, Signal
from amaranth.sim import Simulator
from cores import CONFIGURATIONS
from pages import MEASURED, Rows, measure

from tachometry.hdl import Tachometer
from tachometry.spec import TachometerSpec

CORES, RAD_PER_S, TICKS = ("reference", "table"), 100, 60
LEVELS = ((0, 0), (1, 0), (1, 1), (0, 1))


def registers(fragment: Any, box: str = "") -> Iterator[tuple[str, Signal]]:
    """Yield all signals that flip-flops drive, with the box of the core that they are in."""
    for domain, statements in fragment.statements.items():
        if domain != "comb":
            for signal in statements._lhs_signals():
                yield box or "tachometer", signal
    for inner, name, *_ in fragment.subfragments:
        within = f"{box}.{name}" if box else str(name)
        yield from registers(inner, within.removeprefix("datapath."))


def changes(spec: TachometerSpec, rad_per_s: float, ticks: int) -> Counter[str]:
    """Return flip-flop changes by box in so many ticks."""
    core = Tachometer(spec)
    fragment = Fragment.get(core, None)
    found = list(registers(fragment))
    top = Module()
    top.submodules.core = fragment
    state = Signal(sum(len(signal) for _, signal in found))
    top.d.comb += state.eq(Cat(signal for _, signal in found))
    per_clock = rad_per_s / (2 * math.pi) * 4 * spec.encoder.pulses_per_rev / spec.timing.clock_hz
    begin = 2 * spec.timing.tick_cycles
    masks, low = [], 0
    for box, signal in found:
        masks.append((box, ((1 << len(signal)) - 1) << low))
        low += len(signal)
    counted: Counter[str] = Counter()

    async def bench(ctx: Any) -> None:
        before = 0
        for clock in range(begin + ticks * spec.timing.tick_cycles):
            a, b = LEVELS[int(clock * per_clock) % 4]
            ctx.set(core.a, a)
            ctx.set(core.b, b)
            await ctx.tick()
            now = ctx.get(state)
            if clock >= begin and (changed := now ^ before):
                for box, mask in masks:
                    if hit := changed & mask:
                        counted[box] += hit.bit_count()
            before = now

    simulator = Simulator(top)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    return counted


def table() -> Rows:
    """Return a row for each box, and a column for each core."""
    chosen = [one for one in CONFIGURATIONS if one.name in CORES]
    columns = [changes(one.spec, RAD_PER_S, TICKS) for one in chosen]  # type: ignore[arg-type]
    boxes = sorted({box for column in columns for box in column}, key=lambda box: -max(c[box] for c in columns))
    rows = [[box, *(f"{column[box] / TICKS:.1f}" for column in columns)] for box in boxes]
    rows.append(["total", *(f"{column.total() / TICKS:.1f}" for column in columns)])
    return [["box", *(one.name for one in chosen)], *rows]


if __name__ == "__main__":
    measure(MEASURED / "evidence.md", {"toggles": table})
