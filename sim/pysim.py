"""Amaranth's own simulator: needs nothing else, and is slow."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from amaranth import Cat, Module, Signal, Value
from amaranth.sim import Simulator
from numpy.typing import NDArray

from tachometry.hdl import Tachometer
from tachometry.sim.recording import PinTrace
from tachometry.sim.results import STROBES, Run, observed
from tachometry.sim.waveform import Waveform
from tachometry.spec import Port, TachometerSpec

# The simulator counts in femtoseconds; a nanosecond per clock keeps every instant exact. Waveforms have true times.
_PERIOD = 1e-9
_CLOCKS_PER_CALL = 10_000


async def drive(ctx: Any, trace: PinTrace, pins: Mapping[str, Signal], period: float) -> None:
    """Let a trace play on signals, in a testbench of Amaranth's simulator that begins at time 0.

    Parameters
    ----------
    ctx : simulator context
    trace : PinTrace
    pins : mapping of str to Signal
        By the names of the lines: `a`, `b`, and `z` and `tick_in` if there are.
    period : float, seconds
        Of the simulated clock, whose edges lie in the middle of each period, as `Simulator.add_clock` has them.
    """
    now = 0
    levels = (trace.lines[name].tolist() for name in pins)
    for clock, *row in zip(trace.clock.tolist(), *levels, strict=True):
        if clock > now:
            await ctx.delay((clock - now) * period)
            now = clock
        for pin, level in zip(pins.values(), row, strict=True):
            ctx.set(pin, level)


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
        outputs = [port for port in spec.ports if port.direction == "output"]
        strobe = Signal()
        top.d.comb += strobe.eq(Cat(getattr(core, port.name) for port in outputs if port.name in STROBES).any())
        values = _packed(top, [getattr(core, port.name) for port in outputs])
        shown = _shown(core) if vcd is not None else {}
        shown_values = _packed(top, list(shown.values()))
        simulator = Simulator(top)
        simulator.add_clock(_PERIOD)

        async def bench(ctx: Any) -> None:
            await drive(ctx, trace, {port.name: getattr(core, port.name) for port in _pins(spec, trace)}, _PERIOD)

        simulator.add_testbench(bench)

        rows: list[tuple[int, int]] = []

        async def collect(ctx: Any) -> None:
            clock = 0
            async for _, _, any_strobe, packed in ctx.tick().sample(strobe, values):
                if any_strobe:
                    rows.append((clock, packed))
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

        return observed(spec, trace.n_clocks, _unpack(rows, [(port.width, port.signed) for port in outputs]))


def _pins(spec: TachometerSpec, trace: PinTrace) -> list[Port]:
    """The inputs that a trace drives.

    Raises
    ------
    ValueError
        If the trace lacks one.
    """
    pins = [port for port in spec.ports if port.direction == "input" and port.name not in ("clk", "rst")]
    missing = [port.name for port in pins if port.name not in trace.lines]
    if missing:
        raise ValueError(f"the trace must have the lines of the core, and lacks {', '.join(missing)}")
    return pins


def _shown(core: Tachometer) -> dict[str, Value]:
    """Signals of the waveform, in the order in which they are shown."""
    inner = {"m_e": core.pulse_count, **core.datapath.probes}
    order = (
        *("a", "b", "z", "tick_in", "decode_error", "tick", "tick_error", *inner, "overflow", "velocity_valid"),
        *("velocity", "velocity_overflow", "interval", "forced", "stalled", "index_valid", "index_position"),
        *("position", "swallowed_edges"),
    )
    ports = {port.name for port in core.spec.ports}
    return {name: inner[name] if name in inner else getattr(core, name) for name in order if name in ports | {*inner}}


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


def _unpack(rows: list[tuple[int, int]], shapes: list[tuple[int, bool]]) -> NDArray[np.int64]:
    """Rows (clock, packed values) as columns; `shapes` gives width and signedness, least significant first."""
    columns = [[clock for clock, _ in rows]]
    shift = 0
    for width, is_signed in shapes:
        mask, sign = (1 << width) - 1, (1 << (width - 1)) if is_signed else 0
        columns.append([(((packed >> shift) & mask) ^ sign) - sign for _, packed in rows])
        shift += width
    return np.array(columns, dtype=np.int64).T
