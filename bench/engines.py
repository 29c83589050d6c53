"""Measures all engines on the same edges in one run, for docs/measured/bench.md.

Times are processor time, so that what else runs on the machine matters little; still only the ratios mean something.
"""

import argparse
import ctypes
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from amaranth.back import cxxrtl as amaranth_cxxrtl
from amaranth.back import rtlil
from golden import BEGIN, MOTION, part_of
from pages import markdown, write_block

from tachometry.cli.reports.terminal import print_table
from tachometry.sim import build, golden
from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.compiled import CompiledEngine, Design, Play
from tachometry.sim.engines.cxxrtl import headers, model_of, translate
from tachometry.sim.engines.engine import driven_pins
from tachometry.sim.engines.pick import pick
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run, compare, observed
from tachometry.spec import METHODS, Encoder, TachometerSpec, Timing

SLOW = 30_000  # clocks of pysim
FAST = 12_000_000  # clocks of the others
REPEATS = 2

# The loops that are measured; each counts the clocks with a strobe.
_LOOPS = """
#define LOOP ENTRY __attribute__((flatten))
#define ADD if (model.strobe()) { n++; model.outputs(row); for (int64_t value : row) sum += value; }
#define CLOCKS(...) int64_t n = 0, next = 0, sum = 0, row[N_COLUMNS - 1]; \\
  for (int64_t clock = 0; clock < n_clocks; clock++) { \\
    if (next < n_changes && at[next] == clock) model.pins(level[next++]); __VA_ARGS__ } return n + (sum << 32);
#define ARGUMENTS const int64_t *at, const uint8_t *level, int64_t n_changes, int64_t n_clocks
LOOP int64_t twice(ARGUMENTS) {
  std::unique_ptr<Model> home(new Model);
  Model &model = *home;
  CLOCKS(model.top.p_clk.set<bool>(false); model.top.step(); ADD
         model.top.p_clk.set<bool>(true); model.top.step();)
}
LOOP int64_t once(ARGUMENTS) {
  std::unique_ptr<Model> home(new Model);
  Model &model = *home;
  CLOCKS(model.settle(); ADD model.top.p_top::commit();)
}
LOOP int64_t copied(ARGUMENTS) {
  std::unique_ptr<Model> home(new Model);
  Model &model = *home;
  CLOCKS(model.settle(); ADD model.edge();)
}
LOOP int64_t bare(ARGUMENTS) {
  Model model;
  CLOCKS(model.settle(); ADD model.edge();)
}
"""


@dataclass(frozen=True)
class Speed:
    """Clocks per second of one core."""

    core: str
    pysim: float
    verilator: float
    bare: float
    every_clock: float
    cxxrtl: float

    @property
    def cells(self) -> list[str]:
        """The row of the table."""
        rates = (self.pysim, self.verilator, self.bare, self.every_clock, self.cxxrtl)
        ratios = (self.cxxrtl / rate for rate in rates[:-1])
        return [self.core, *(f"{rate:.3g}" for rate in rates), *(f"{ratio:.3g}" for ratio in ratios)]


ENGINES = ("verilator", "cxxrtl-every-clock", "cxxrtl")
_OF_CXXRTL = ("pysim", "verilator", "bare loop", "cxxrtl-every-clock")
SPEED_COLUMNS = ["core", *_OF_CXXRTL, "cxxrtl", *(f"÷ {name}" for name in _OF_CXXRTL)]
WHOLE_COLUMNS = ["core", "loop, every clock", "loop", "ratio", "process, every clock", "process", "ratio"]
WHOLE_COLUMNS += ["golden model", "updates", "mismatches"]
STEP_COLUMNS = ["loop", "clocks/s"]


def seconds(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Return the shortest processor time of some runs."""
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return min(times)


def loops(spec: TachometerSpec, trace: PinTrace, *options: str, debug: bool = False) -> Any:
    """Return the library with the loops; `debug` with what Amaranth's `cxxrtl.convert` writes as it stands."""
    design = Design(spec, driven_pins(spec, trace))
    with patch.dict(os.environ, AMARANTH_USE_YOSYS="builtin"):
        text = (
            amaranth_cxxrtl.convert(design.component, name="top", emit_src=False)
            if debug
            else translate(rtlil.convert(design.component, name="top", emit_src=False))
        )
    source = design.source(text + model_of(design, text)) + _LOOPS
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
        times.append(seconds(lambda: play.to_the_end(None, None), 1))  # noqa: B023
        checked(expected, observed(spec, trace.n_clocks, play.rows()), name, spec)
    return min(times)


def speed(name: str, spec: TachometerSpec, trace: PinTrace, slow: int = SLOW, fast: int = FAST) -> Speed:
    """Measure one core on all engines."""
    part = part_of(trace, BEGIN, slow)
    begun = time.process_time()
    run = pick("pysim").run(spec, part)
    rates = {"pysim": slow / (time.process_time() - begun)}
    checked(golden.run(spec, part), run, "pysim", spec)
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
        bare.append(seconds(lambda: strobes(library, "bare", part)))  # noqa: B023
    return Speed(
        name, rates["pysim"], rates["verilator"], fast / min(bare), rates["cxxrtl-every-clock"], rates["cxxrtl"]
    )


def process(method: str, name: str) -> float:
    """Return processor time of a process that simulates the motion and compares it with the golden model."""
    command = [sys.executable, __file__, "--alone", method, name]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True)
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
    model = seconds(lambda: golden.run(spec, trace))
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
    took = {name: seconds(lambda: strobes(library, loop, part)) for name, library, loop in rows}  # noqa: B023
    run = golden.run(spec, part)
    took["the engine, which stores rows"] = loop_alone("cxxrtl-every-clock", spec, part, run)
    took["idle clocks skipped"] = loop_alone("cxxrtl", spec, part, run)
    return [[name, f"{part.n_clocks / each:.3g}"] for name, each in took.items()]


def main() -> None:
    """Measure, print, and replace the tables of the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, help="page whose tables are replaced")
    parser.add_argument("--alone", nargs=2, metavar=("METHOD", "ENGINE"), help="only simulate, to be measured")
    options = parser.parse_args()
    output = options.output
    encoder = VirtualEncoder(500, jitter=0.02, vibration=Vibration(1e-3, 50), seed=1)
    trace = encoder.record(parse_motion(MOTION)).recording.place(48_000_000)
    common: dict[str, Any] = {"encoder": Encoder(500), "timing": Timing.parse("48MHz", "20us", "10ms")}
    cores = {name: method(**common) for name, method in METHODS.items()}
    if options.alone:
        method, engine = options.alone
        checked(golden.run(cores[method], trace), pick(engine).run(cores[method], trace), engine, cores[method])
        return
    speeds = [speed(name, spec, trace).cells for name, spec in cores.items()]
    print_table(SPEED_COLUMNS, speeds)
    print()
    entire = [whole(name, spec, trace) for name, spec in cores.items()]
    print_table(WHOLE_COLUMNS, entire)
    print()
    loop = steps(cores["s"], trace)
    print_table(STEP_COLUMNS, loop)
    print()
    if output is None:
        return
    write_block(output, "engines", markdown(SPEED_COLUMNS, speeds))
    write_block(output, "whole", markdown(WHOLE_COLUMNS, entire))
    write_block(output, "steps", markdown(STEP_COLUMNS, loop))


if __name__ == "__main__":
    main()
