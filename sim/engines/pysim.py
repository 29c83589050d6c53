"""Amaranth's own simulator needs nothing else, and is slow."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from functools import partial
from typing import Any

import numpy as np
from amaranth import Cat, Module, Signal, Value
from amaranth.sim import Simulator
from numpy.typing import NDArray

from tachometry.hdl import core_of
from tachometry.sim.engines.engine import NO_WATCH, Interrupted, Watch, driven_pins
from tachometry.sim.engines.probes import shown
from tachometry.sim.engines.waveform import Waveform
from tachometry.sim.signals.axes import Trace
from tachometry.sim.signals.run import Run, observed
from tachometry.spec import CoreSpec

# The simulator counts in femtoseconds; a nanosecond per clock keeps every instant exact. Waveforms have true times.
_PERIOD = 1e-9
_CLOCKS_PER_CALL = 10_000


async def drive(ctx: Any, trace: Trace, pins: Mapping[str, Signal], period: float) -> None:
    """Let a trace play on signals, in a testbench of Amaranth's simulator that begins at time 0.

    - `pins`: By the names of the lines: `a`, `b`, and `z` and `tick_in` if there are.
    - `period`, seconds: Of the simulated clock, whose edges lie in the middle of each period, as `Simulator.add_clock`
      has them.
    """
    now, before = 0, [-1] * len(pins)
    levels = (trace.lines[name].tolist() for name in pins)
    for clock, *row in zip(trace.clock.tolist(), *levels, strict=True):
        if clock > now:
            await ctx.delay((clock - now) * period)
            now = clock
        for pin, level, old in zip(pins.values(), row, before, strict=True):
            if level != old:  # to set a signal takes as long as to simulate a part of a clock
                ctx.set(pin, level)
        before = row


def _played(
    simulator: Simulator, n_clocks: int, progress: Callable[[int], None] | None
) -> tuple[int, KeyboardInterrupt | None]:
    """Return how many clocks were simulated, and what interrupted them."""
    done = 0
    try:
        while done < n_clocks:
            after = min(done + _CLOCKS_PER_CALL, n_clocks)
            simulator.run_until(after * _PERIOD)
            done = after
            if progress is not None:
                progress(done)
    except KeyboardInterrupt as raised:
        return done, raised
    return done, None


async def _collect(ctx: Any, values: Value, rows: list[tuple[int, int]]) -> None:
    """Append the clocks in which a strobe is high, which is bit 0 of the values, with the other bits."""
    clock = 0
    async for _, _, packed in ctx.tick().sample(values):
        if packed & 1:
            rows.append((clock, packed >> 1))
        clock += 1


class PySim:
    """Is the engine that is always there."""

    name = "pysim"

    def run(self, spec: CoreSpec, trace: Trace, watch: Watch = NO_WATCH) -> Run:
        core, top = core_of(spec), Module()
        top.submodules.core = core
        outputs = spec.ports.outputs
        strobe = Cat(getattr(core, port.name) for port in outputs if port.is_strobe).any()
        values = _packed(top, [strobe, *(getattr(core, port.name) for port in outputs)])
        seen = shown(core) if watch.vcd is not None else {}
        seen_values = _packed(top, list(seen.values()))
        simulator = Simulator(top)
        simulator.add_clock(_PERIOD)

        pins = {port.name: getattr(core, port.name) for port in driven_pins(spec, trace)}
        simulator.add_testbench(partial(drive, trace=trace, pins=pins, period=_PERIOD))
        rows: list[tuple[int, int]] = []
        simulator.add_process(partial(_collect, values=values, rows=rows))
        begin, end = watch.window or (0, trace.n_clocks)
        with ExitStack() as stack:
            waveform = None
            if watch.vcd is not None:
                widths = {name: (len(value), value.shape().signed) for name, value in seen.items()}
                waveform = stack.enter_context(Waveform(watch.vcd, spec.timing.clock_hz, widths))
                _watch(simulator, waveform, seen_values, begin, end)
            done, interrupt = _played(simulator, trace.n_clocks, watch.progress)
            if waveform is not None:
                waveform.close(min(done, end))

        kept = [row for row in rows if row[0] < done]
        run = observed(spec, done, _unpack(kept, [(port.width, port.signed) for port in outputs]))
        if interrupt is not None:
            raise Interrupted(run) from interrupt
        return run


def _packed(top: Module, values: list[Value]) -> Signal:
    """Return one signal of many: the simulator compiles it, where it would interpret a `Cat` anew in every clock."""
    packed = Signal(sum(map(len, values)))
    top.d.comb += packed.eq(Cat(*values))
    return packed


def _watch(simulator: Simulator, waveform: Waveform, packed: Signal, begin: int, end: int) -> None:
    async def watch(ctx: Any) -> None:
        clock = 0
        async for _, _, value in ctx.tick().sample(packed):
            if begin <= clock < end:
                waveform.sample(clock, value)
            clock += 1

    simulator.add_process(watch)


def _unpack(rows: list[tuple[int, int]], shapes: list[tuple[int, bool]]) -> NDArray[np.int64]:
    """Return rows (clock, packed values) as columns; `shapes` gives width and signedness, least significant first."""
    columns = [[clock for clock, _ in rows]]
    shift = 0
    for width, is_signed in shapes:
        mask, sign = (1 << width) - 1, (1 << (width - 1)) if is_signed else 0
        columns.append([(((packed >> shift) & mask) ^ sign) - sign for _, packed in rows])
        shift += width
    return np.array(columns, dtype=np.int64).reshape(len(columns), -1).T
