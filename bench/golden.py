"""Measures the golden models beside the simulator, on the same edges in the same run, for docs/measured/bench.md.

A golden model is vectorised over a whole recording; the simulator works clock by clock, so that it is given the first
part of it only. Only the ratios mean something: they are of one machine at one time.
"""

import argparse
import os
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from pages import markdown, write_block
from rich.console import Console
from rich.progress import track

from tachometry.cli.reports.terminal import print_table
from tachometry.sim import golden
from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import compare
from tachometry.spec import METHODS, Encoder, TachometerSpec, Timing

MOTION = "ramp:0:300rad/s:4s+ramp:300rad/s:-300rad/s:4s+sine:5rad/s:1Hz:1s+stop:1s"
CLOCK = "48MHz"
SIMULATED = 30_000  # clocks of the simulator
BEGIN = 48_000_000  # where they begin: at about 75 rad/s
REPEATS = 3


@dataclass(frozen=True)
class Result:
    """Holds the times of one core in seconds."""

    name: str
    clocks: int
    ticks: int
    golden_s: float
    simulated_clocks: int
    simulated_s: float

    @property
    def cells(self) -> list[str]:
        """The row of the table."""
        fast, slow = self.clocks / self.golden_s, self.simulated_clocks / self.simulated_s
        return [
            self.name,
            f"{self.golden_s * 1e3:.0f} ms",
            f"{self.ticks / self.golden_s:.2g}",
            f"{fast:.2g}",
            f"{slow:.2g}",
            f"{fast / slow:.2g}",
        ]


COLUMNS = ["core", "golden model", "ticks/s", "clocks/s", "pysim, clocks/s", "ratio"]


def fastest(work: Callable[[], object]) -> float:
    """Return the shortest time of some runs."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def part_of(trace: PinTrace, begin: int, clocks: int) -> PinTrace:
    """Return some clocks of a trace."""
    first = int(trace.clock.searchsorted(begin, side="right")) - 1
    inside = slice(first, int(trace.clock.searchsorted(begin + clocks)))
    at = (trace.clock[inside] - begin).clip(min=0)
    return PinTrace(at, trace.a[inside], trace.b[inside], clocks)


def measure(name: str, spec: TachometerSpec, trace: PinTrace) -> Result:
    """Return golden model on the whole, simulator on a part; RuntimeError if they disagree."""
    part = part_of(trace, BEGIN, SIMULATED)
    start = time.perf_counter()
    simulated = PySim().run(spec, part)
    simulated_s = time.perf_counter() - start
    wrong, first = compare(golden.run(spec, part), simulated)
    if wrong:
        raise RuntimeError(f"{name}: hardware and golden model disagree: {first[0]}")
    ticks = len(golden.run(spec, trace).ticks.clock)
    return Result(name, trace.n_clocks, ticks, fastest(lambda: golden.run(spec, trace)), SIMULATED, simulated_s)


def cores() -> dict[str, TachometerSpec]:
    """Return every method, and the S method with what costs the golden model time."""
    common: dict[str, Any] = {"encoder": Encoder(500), "timing": Timing.parse(CLOCK, "20us", "10ms")}
    found = {name: method(**common) for name, method in METHODS.items()}
    return found | {
        "s, in rad/s": replace(found["s"], unit="rad/s", frac_bits=10),
        "s, with bounds": replace(found["s"], bounds=True),
        "s, low-pass": replace(found["s"], lowpass=Fraction(200)),
    }


def main() -> None:
    """Measure, print, and write the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, help="page whose table is replaced")
    output = parser.parse_args().output
    encoder = VirtualEncoder(500, jitter=0.02, vibration=Vibration(1e-3, 50), seed=1)
    trace = encoder.record(parse_motion(MOTION)).recording.place(48_000_000)
    results = [
        measure(name, spec, trace) for name, spec in track(cores().items(), "Cores", console=Console(stderr=True))
    ]
    rows = [result.cells for result in results]
    print_table(COLUMNS, rows)
    print()
    if output is None:
        return
    machine = f"Python {platform.python_version()} on {platform.machine()}, {os.cpu_count()} cores"
    write_block(output, "golden", f"{markdown(COLUMNS, rows)}\nMeasured with {machine}.\n")


if __name__ == "__main__":
    main()
