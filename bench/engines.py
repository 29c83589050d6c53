"""Measures golden models and engines on the same edges in one run, for docs/measured/evidence.md.

A golden model is vectorised over a whole recording; Amaranth's simulator works clock by clock, and runs the first part
of it only. Times of engines are processor time, so that what else runs on the machine matters little; still only the
ratios mean something.
"""

import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache

from pages import MEASURED, ROOT, Rows, measure, processor_time

from tachometry.sim import golden
from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.compiled import CompiledEngine, Design, Play
from tachometry.sim.engines.engine import driven_pins
from tachometry.sim.engines.pick import pick
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run, compare, observed
from tachometry.spec import METHODS, TachometerSpec, of_texts

MOTION = "ramp:0:300rad/s:4s+ramp:300rad/s:-300rad/s:4s+sine:5rad/s:1Hz:1s+stop:1s"
BEGIN = 48_000_000  # where engines begin: at about 75 rad/s
SLOW, FAST = 30_000, 12_000_000  # clocks of pysim, and of the other engines
REPEATS = 2

GOLDEN_COLUMNS = ["core", "golden model", "ticks/s", "clocks/s", "pysim, clocks/s", "ratio", "machine"]
ENGINES = ("verilator", "cxxrtl-every-clock", "cxxrtl")
SPEED_COLUMNS = ["core", "pysim", *ENGINES, "÷ pysim", *(f"÷ {name}" for name in ENGINES[:-1])]
WHOLE_COLUMNS = ["core", "every clock", "idle clocks skipped", "ratio", "golden model", "updates", "mismatches"]
FIXED_TEST = "tests/sim/theory/test_rairan.py::test_bounds_are_never_exceeded_at_any_speed_and_phase"
_TEXTS = {"ppr": "500", "clock": "48MHz", "tick": "20us", "max-time": "10ms"}
CORES = {name: of_texts(name, _TEXTS) for name in METHODS}


@cache
def trace() -> PinTrace:
    """Return the edges of all tables."""
    encoder = VirtualEncoder(500, jitter=0.02, vibration=Vibration(1e-3, 50), seed=1)
    return encoder.record(parse_motion(MOTION)).recording.place(48_000_000)


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
    clock_by_clock = simulated(spec, trace.part(BEGIN, BEGIN + slow))
    took, ticks = fastest(lambda: golden.run(spec, trace)), len(golden.run(spec, trace).ticks.clock)
    rate = trace.n_clocks / took
    rates = (ticks / took, rate, clock_by_clock, rate / clock_by_clock)
    return [name, f"{took * 1e3:.0f} ms", *(f"{each:.2g}" for each in rates)]


def checked(expected: Run, run: Run, name: str, spec: TachometerSpec) -> None:
    """Check that an engine gave what is expected; RuntimeError if not."""
    wrong, first = compare(expected, run)
    if wrong:
        raise RuntimeError(f"{name}, {spec.method}: hardware and golden model disagree: {first[0]}")


def loop_alone(name: str, spec: TachometerSpec, trace: PinTrace, expected: Run, repeats: int = REPEATS) -> float:
    """Return the shortest processor time in which an engine runs all clocks, without what it does before and after."""
    engine = pick(name)
    assert isinstance(engine, CompiledEngine)
    design = Design(spec, driven_pins(spec, trace), effort=2)
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


def speeds(name: str, spec: TachometerSpec, trace: PinTrace, slow: int = SLOW, fast: int = FAST) -> list[str]:
    """Return the row of a core: clocks per second of all engines."""
    part = trace.part(BEGIN, BEGIN + fast)
    run = golden.run(spec, part)
    rates = [simulated(spec, trace.part(BEGIN, BEGIN + slow))]
    rates += [fast / loop_alone(engine, spec, part, run) for engine in ENGINES]
    return [name, *(f"{rate:.3g}" for rate in rates), *(f"{rates[-1] / rate:.3g}" for rate in rates[:-1])]


def whole(name: str, spec: TachometerSpec, trace: PinTrace) -> list[str]:
    """Return all of the motion on cxxrtl and on the golden model."""
    run = golden.run(spec, trace)
    slow, fast = (loop_alone(each, spec, trace, run, 1) for each in ("cxxrtl-every-clock", "cxxrtl"))
    model = fastest(lambda: golden.run(spec, trace))
    cells = (f"{slow:.2g} s", f"{fast:.2g} s", f"{slow / fast:.3g}", f"{model * 1e3:.0f} ms")
    return [name, *cells, f"{len(run.updates.clock):,}", "0"]


def time_of(*words: str) -> float:
    """Return seconds that all processes of some tests take; CalledProcessError if one fails."""
    before = processor_time()
    subprocess.run([sys.executable, "-m", "pytest", "-q", "-m", "not nightly", *words], cwd=ROOT, check=True)
    return processor_time() - before


def tests() -> Rows:
    """Return how long the tests take, and how much longer than one of them."""
    one, every = time_of(FIXED_TEST), time_of("-n", "auto", "--dist", "worksteal")
    return [["tests", "processor time", "÷ one test"], ["all", f"{every:.0f} s", f"{every / one:.0f}"]]


def golden_table() -> Rows:
    """Return every method, and the S method with options that cost the golden model time."""
    found = CORES | {
        "s, in rad/s": replace(CORES["s"], unit="rad/s", frac_bits=10),
        "s, with bounds": replace(CORES["s"], bounds=True),
        "s, low-pass": replace(CORES["s"], lowpass=Fraction(200)),
    }
    machine = f"Python {platform.python_version()} on {platform.machine()}, {os.cpu_count()} cores"
    return [GOLDEN_COLUMNS, *([*golden_row(name, spec, trace()), machine] for name, spec in found.items())]


BLOCKS: dict[str, Callable[[], Rows]] = {
    "golden": golden_table,
    "engines": lambda: [SPEED_COLUMNS, *(speeds(name, spec, trace()) for name, spec in CORES.items())],
    "whole": lambda: [WHOLE_COLUMNS, *(whole(name, spec, trace()) for name, spec in CORES.items())],
    "tests": tests,
}

if __name__ == "__main__":
    measure(MEASURED / "evidence.md", BLOCKS)
