"""Amaranth's own simulator: needs nothing else, and is slow."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from amaranth import Cat, Module, Signal, Value
from amaranth.sim import Simulator

from tachometry.hdl import Tachometer
from tachometry.sim.recording import PinTrace
from tachometry.sim.results import Run, Ticks, Updates
from tachometry.sim.waveform import Waveform
from tachometry.spec import TachometerSpec

# The simulator counts in femtoseconds; a nanosecond per clock keeps every instant exact. Waveforms have true times.
_PERIOD = 1e-9
_CLOCKS_PER_CALL = 10_000

_TICK = ("pulse_count", "position", "overflow")
_OPTIONAL_TICK = ("swallowed_edges",)
_UPDATE = ("velocity", "interval", "forced", "stalled")


async def drive(ctx: Any, trace: PinTrace, a: Signal, b: Signal, period: float) -> None:
    """Let a trace play on two signals, in a testbench of Amaranth's simulator that begins at time 0.

    Parameters
    ----------
    ctx : simulator context
    trace : PinTrace
    a, b : Signal
    period : float, seconds
        Of the simulated clock, whose edges lie in the middle of each period, as `Simulator.add_clock` has them.
    """
    now = 0
    for clock, level_a, level_b in zip(trace.clock.tolist(), trace.a.tolist(), trace.b.tolist(), strict=True):
        if clock > now:
            await ctx.delay((clock - now) * period)
            now = clock
        ctx.set(a, level_a)
        ctx.set(b, level_b)


class PySim:
    """The engine that is always there."""

    name = "pysim"

    def run(
        self,
        spec: TachometerSpec,
        trace: PinTrace,
        *,
        vcd: Path | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> Run:
        """See `Engine.run`."""
        core = Tachometer(spec)
        top = Module()
        top.submodules.core = core
        strobes = _packed(top, [core.tick, core.velocity_valid, core.decode_error])
        ports = {port.name: (port.width, port.signed) for port in spec.ports}
        of_tick = [*_TICK, *(name for name in _OPTIONAL_TICK if name in ports)]
        tick_values = _packed(top, [getattr(core, name) for name in of_tick])
        update_values = _packed(top, [getattr(core, name) for name in _UPDATE])
        shown = _shown(core) if vcd is not None else {}
        shown_values = _packed(top, list(shown.values()))
        simulator = Simulator(top)
        simulator.add_clock(_PERIOD)

        async def bench(ctx: Any) -> None:
            await drive(ctx, trace, core.a, core.b, _PERIOD)

        simulator.add_testbench(bench)

        ticks: list[tuple[int, ...]] = []
        updates: list[tuple[int, ...]] = []
        errors: list[int] = []

        async def collect(ctx: Any) -> None:
            clock = 0
            async for _, _, strobe, tick, update in ctx.tick().sample(strobes, tick_values, update_values):
                if strobe & 1:
                    ticks.append((clock, tick))
                if strobe & 2:
                    updates.append((clock, update))
                if strobe & 4:
                    errors.append(clock)
                clock += 1

        simulator.add_process(collect)

        with ExitStack() as stack:
            waveform = None
            if vcd is not None:
                widths = {name: (len(value), value.shape().signed) for name, value in shown.items()}
                waveform = stack.enter_context(Waveform(vcd, spec.timing.clock_hz, widths))
                _watch(simulator, waveform, shown_values)
            for clock in range(0, trace.n_clocks, _CLOCKS_PER_CALL):
                done = min(clock + _CLOCKS_PER_CALL, trace.n_clocks)
                simulator.run_until(done * _PERIOD)
                if progress is not None:
                    progress(done)
            if waveform is not None:
                waveform.close(trace.n_clocks)

        tick_arrays = _unpack(ticks, {name: ports[name] for name in of_tick})
        tick_arrays |= {name: np.zeros(len(ticks), np.int64) for name in _OPTIONAL_TICK if name not in ports}
        update_arrays = _unpack(updates, {name: ports[name] for name in _UPDATE})
        return Run(trace.n_clocks, Ticks(**tick_arrays), Updates(**update_arrays), np.array(errors, dtype=np.int64))


def _shown(core: Tachometer) -> dict[str, Value]:
    """Signals of the waveform, in the order in which they are shown."""
    return {
        "a": core.a,
        "b": core.b,
        "decode_error": core.decode_error,
        "tick": core.tick,
        "m_e": core.pulse_count,
        "overflow": core.overflow,
        **core.datapath.probes,
        "velocity_valid": core.velocity_valid,
        "velocity": core.velocity,
        "interval": core.interval,
        "forced": core.forced,
        "stalled": core.stalled,
        "position": core.position,
    }


def _packed(top: Module, values: list[Value]) -> Signal:
    """One signal of many: the simulator compiles it, where it would interpret a `Cat` anew in every clock."""
    packed = Signal(sum(map(len, values)))
    top.d.comb += packed.eq(Cat(*values))
    return packed


def _watch(simulator: Simulator, waveform: Waveform, packed: Signal) -> None:
    async def watch(ctx: Any) -> None:
        clock = 0
        async for _, _, value in ctx.tick().sample(packed):
            waveform.sample(clock, value)
            clock += 1

    simulator.add_process(watch)


def _unpack(rows: list[tuple[int, ...]], fields: dict[str, tuple[int, bool]]) -> dict[str, np.ndarray]:
    """Columns of rows (clock, packed values); `fields` gives width and signedness, least significant first."""
    columns: dict[str, np.ndarray] = {"clock": np.array([clock for clock, _ in rows], dtype=np.int64)}
    shift = 0
    for name, (width, is_signed) in fields.items():
        mask, sign = (1 << width) - 1, 1 << (width - 1)
        values = ((packed >> shift) & mask for _, packed in rows)
        if is_signed:
            values = ((value ^ sign) - sign for value in values)
        flag = name in ("overflow", "forced", "stalled")
        columns[name] = np.array(list(values), dtype=np.bool_ if flag else np.int64)
        shift += width
    return columns
