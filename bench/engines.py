"""Measures golden models and engines on the same edges in one run, for docs/measured/bench.md.

A golden model is vectorised over a whole recording; Amaranth's simulator works clock by clock, and runs the first part
of it only. Times of engines are processor time, so that what else runs on the machine matters little; still only the
ratios mean something.
"""

import ctypes
import os
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from amaranth.back import cxxrtl as amaranth_cxxrtl
from amaranth.back import rtlil
from pages import MEASURED, filled, markdown, measure

from tachometry.sim import build, golden
from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.compiled import CompiledEngine, Design, Play
from tachometry.sim.engines.cxxrtl import headers, model_of, translate
from tachometry.sim.engines.engine import driven_pins
from tachometry.sim.engines.pick import pick
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run, compare, observed
from tachometry.spec import METHODS, TachometerSpec, of_texts

MOTION = "ramp:0:300rad/s:4s+ramp:300rad/s:-300rad/s:4s+sine:5rad/s:1Hz:1s+stop:1s"
BEGIN = 48_000_000  # where engines begin: at about 75 rad/s
SLOW, FAST = 30_000, 12_000_000  # clocks of pysim, and of the other engines
REPEATS = 2

GOLDEN_COLUMNS = ["core", "golden model", "ticks/s", "clocks/s", "pysim, clocks/s", "ratio"]
ENGINES = ("verilator", "cxxrtl-every-clock", "cxxrtl")
_OF_CXXRTL = ("pysim", "verilator", "bare loop", "cxxrtl-every-clock")
SPEED_COLUMNS = ["core", *_OF_CXXRTL, "cxxrtl", *(f"÷ {name}" for name in _OF_CXXRTL)]
WHOLE_COLUMNS = ["core", "loop, every clock", "loop", "ratio", "process, every clock", "process", "ratio"]
WHOLE_COLUMNS += ["golden model", "updates", "mismatches"]
_TEXTS = {"ppr": "500", "clock": "48MHz", "tick": "20us", "max-time": "10ms"}
CORES = {name: of_texts(name, _TEXTS) for name in METHODS}


class Speed(NamedTuple):
    """Clocks per second of one core."""

    pysim: float
    verilator: float
    bare: float
    every_clock: float
    cxxrtl: float

    @property
    def cells(self) -> list[str]:
        """The row of the table, but for the name."""
        return [*(f"{rate:.3g}" for rate in self), *(f"{self.cxxrtl / rate:.3g}" for rate in self[:-1])]


@cache
def trace() -> PinTrace:
    """Return the edges of all tables."""
    encoder = VirtualEncoder(500, jitter=0.02, vibration=Vibration(1e-3, 50), seed=1)
    return encoder.record(parse_motion(MOTION)).recording.place(48_000_000)


def part_of(trace: PinTrace, begin: int, clocks: int) -> PinTrace:
    """Return some clocks of a trace."""
    first = int(trace.clock.searchsorted(begin, side="right")) - 1
    inside = slice(first, int(trace.clock.searchsorted(begin + clocks)))
    at = (trace.clock[inside] - begin).clip(min=0)
    return PinTrace(at, trace.a[inside], trace.b[inside], clocks)


def fastest(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Return the shortest processor time of some runs, in seconds."""
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return min(times)


def golden_row(name: str, spec: TachometerSpec, trace: PinTrace, slow: int = SLOW) -> list[str]:
    """Return the row of a golden model on the whole, and the simulator on a part; RuntimeError if they disagree."""
    clock_by_clock = simulated(spec, part_of(trace, BEGIN, slow))
    took, ticks = fastest(lambda: golden.run(spec, trace)), len(golden.run(spec, trace).ticks.clock)
    rate = trace.n_clocks / took
    rates = (ticks / took, rate, clock_by_clock, rate / clock_by_clock)
    return [name, f"{took * 1e3:.0f} ms", *(f"{each:.2g}" for each in rates)]


def loops(spec: TachometerSpec, trace: PinTrace, *options: str, debug: bool = False) -> Any:
    """Return the library with the loops; `debug` with what Amaranth's `cxxrtl.convert` writes as it stands."""
    design = Design(spec, driven_pins(spec, trace))
    with patch.dict(os.environ, AMARANTH_USE_YOSYS="builtin"):
        text = (
            amaranth_cxxrtl.convert(design.component, name="top", emit_src=False)
            if debug
            else translate(rtlil.convert(design.component, name="top", emit_src=False))
        )
    source = design.source(text + model_of(design, text)) + filled("loops.h")
    key = build.digest("bench", source, build.compiler(), build.version(build.compiler()), build.flags(), options)
    made = build.cached(key, ".so", lambda folder: build.compile_library(source, folder, f"-I{headers()}", *options))
    return ctypes.CDLL(str(made))


def strobes(library: Any, name: str, trace: PinTrace) -> int:
    """Run a loop of a library: clocks with a strobe."""
    at, level = np.ascontiguousarray(trace.clock, dtype=np.int64), np.ascontiguousarray(trace.level)
    call = getattr(library, name)
    call.restype = ctypes.c_int64
    pointers = (ctypes.c_void_p(at.ctypes.data), ctypes.c_void_p(level.ctypes.data))
    found: int = call(*pointers, ctypes.c_int64(len(at)), ctypes.c_int64(trace.n_clocks))
    return found


def checked(expected: Run, run: Run, name: str, spec: TachometerSpec) -> None:
    """Check that an engine gave what is expected; RuntimeError if not."""
    wrong, first = compare(expected, run)
    if wrong:
        raise RuntimeError(f"{name}, {spec.method}: hardware and golden model disagree: {first[0]}")


def loop_alone(name: str, spec: TachometerSpec, trace: PinTrace, expected: Run, repeats: int = REPEATS) -> float:
    """Return the shortest processor time in which an engine runs all clocks, without what it does before and after."""
    engine = pick(name)
    assert isinstance(engine, CompiledEngine)
    design = Design(spec, driven_pins(spec, trace))
    library, times = engine.library(design), []
    for _ in range(repeats):
        play = Play(library, design, trace, (0, trace.n_clocks), engine.every_clock)
        times.append(fastest(lambda: play.to_the_end(None, None), 1))  # noqa: B023
        checked(expected, observed(spec, trace.n_clocks, play.rows()), name, spec)
    return min(times)


def simulated(spec: TachometerSpec, part: PinTrace) -> float:
    """Return clocks per second of Amaranth's simulator; RuntimeError if the golden model disagrees."""
    runs: list[Run] = []
    took = fastest(lambda: runs.append(pick("pysim").run(spec, part)), 1)
    checked(golden.run(spec, part), runs[0], "pysim", spec)
    return part.n_clocks / took


def speed(name: str, spec: TachometerSpec, trace: PinTrace, slow: int = SLOW, fast: int = FAST) -> Speed:
    """Measure one core on all engines."""
    rates = {"pysim": simulated(spec, part_of(trace, BEGIN, slow))}
    part = part_of(trace, BEGIN, fast)
    run = golden.run(spec, part)
    rates |= {engine: fast / loop_alone(engine, spec, part, run) for engine in ENGINES}
    clocks = [run.ticks.clock, run.updates.clock, run.index.clock, run.errors, run.tick_errors]
    bare = []
    for level in ("-O2", "-O3"):
        library = loops(spec, part, level)
        ticks = strobes(library, "bare", part) & 0xFFFFFFFF
        if ticks != len(np.unique(np.concatenate(clocks))):
            raise RuntimeError(f"{name}: the bare loop sees {ticks} strobes, which are not those of the golden model")
        bare.append(fastest(lambda: strobes(library, "bare", part)))  # noqa: B023
    return Speed(rates["pysim"], rates["verilator"], fast / min(bare), rates["cxxrtl-every-clock"], rates["cxxrtl"])


def process(method: str, name: str) -> float:
    """Return processor time of a process that simulates the motion and compares it with the golden model."""
    command = [sys.executable, "-c", f"import engines; engines.alone({method!r}, {name!r})"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, cwd=Path(__file__).parent)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def whole(name: str, spec: TachometerSpec, trace: PinTrace) -> list[str]:
    """Return all of the motion on cxxrtl and on the golden model."""
    run = golden.run(spec, trace)
    engines = ("cxxrtl-every-clock", "cxxrtl")
    loop = [loop_alone(each, spec, trace, run, 1) for each in engines]
    cells = [name]
    for slow, fast in (loop, [process(name, each) for each in engines]):
        cells += [f"{slow:.2g} s", f"{fast:.2g} s", f"{slow / fast:.3g}"]
    model = fastest(lambda: golden.run(spec, trace))
    return [*cells, f"{model * 1e3:.0f} ms", f"{len(run.updates.clock):,}", "0"]


def steps(spec: TachometerSpec, trace: PinTrace, n_clocks: int = FAST) -> list[list[str]]:
    """Return the loops, from the one of the manual to the bare one of the table above."""
    part = part_of(trace, BEGIN, n_clocks)
    with_debug, without = loops(spec, part, debug=True), loops(spec, part)
    rows = [
        ("`cxxrtl.convert` as it stands, `step()` on both levels of the clock", with_debug, "twice"),
        ("without debug information", without, "twice"),
        ("one evaluation a clock, reset and edge as constants", without, "once"),
        ("flip-flops copied unasked", without, "copied"),
        ("model local to the loop, which it does not outlive", without, "bare"),
    ]
    if len({strobes(library, loop, part) for _, library, loop in rows}) > 1:
        raise RuntimeError("the loops do not see the same strobes")
    took = {name: fastest(lambda: strobes(library, loop, part)) for name, library, loop in rows}  # noqa: B023
    run = golden.run(spec, part)
    took["the engine, which stores rows"] = loop_alone("cxxrtl-every-clock", spec, part, run)
    took["idle clocks skipped"] = loop_alone("cxxrtl", spec, part, run)
    return [[name, f"{part.n_clocks / each:.3g}"] for name, each in took.items()]


def alone(method: str, engine: str) -> None:
    """Simulate the whole motion on an engine, in a process of which the time is taken."""
    spec = CORES[method]
    checked(golden.run(spec, trace()), pick(engine).run(spec, trace()), engine, spec)


def golden_table() -> str:
    """Return every method, and the S method with options that cost the golden model time."""
    found = CORES | {
        "s, in rad/s": replace(CORES["s"], unit="rad/s", frac_bits=10),
        "s, with bounds": replace(CORES["s"], bounds=True),
        "s, low-pass": replace(CORES["s"], lowpass=Fraction(200)),
    }
    machine = f"Python {platform.python_version()} on {platform.machine()}, {os.cpu_count()} cores"
    rows = [golden_row(name, spec, trace()) for name, spec in found.items()]
    return f"{markdown(GOLDEN_COLUMNS, rows)}\nMeasured with {machine}.\n"


BLOCKS = {
    "golden": golden_table,
    "engines": lambda: markdown(
        SPEED_COLUMNS, [[name, *speed(name, spec, trace()).cells] for name, spec in CORES.items()]
    ),
    "whole": lambda: markdown(WHOLE_COLUMNS, [whole(name, spec, trace()) for name, spec in CORES.items()]),
    "steps": lambda: markdown(["loop", "clocks/s"], steps(CORES["s"], trace())),
}

if __name__ == "__main__":
    measure(MEASURED / "bench.md", BLOCKS)
