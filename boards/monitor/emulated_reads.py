"""Golden reads of the emulated encoder of a demo."""

import numpy as np

from tachometry.sim.encoder.absolute import Answers, answer
from tachometry.sim.golden.front_end import decode
from tachometry.sim.golden.sampled import begins
from tachometry.sim.signals.recording import PinTrace, merged
from tachometry.spec import TachometerSpec
from tachometry.spec.registers.emulator import READ_AGE


def with_reads(spec: TachometerSpec, lines: PinTrace) -> PinTrace:
    """Return emulated lines with reads of their edges, or with the line that answers reads of the core."""
    assert spec.encoder.sampled is not None
    reads, cycles = spec.reads, spec.timing.tick_cycles
    step, wrong = decode(lines.a, lines.b, 4)
    start = np.arange(cycles - 1, lines.n_clocks, cycles) if reads is None else begins(spec, lines)
    clock = start if reads is None else start + reads.taken
    edges = np.searchsorted(lines.clock[1:], clock - READ_AGE, side="right")
    place, errors = (np.append(0, np.cumsum(each))[np.append(0, edges)] for each in (step, wrong))
    place, bad = place & (1 << spec.encoder.sampled.width) - 1, np.diff(errors, prepend=0) > 0
    if reads is None:
        at = merged(np.array([0]), clock, clock + 1)
        row = np.searchsorted(clock, at, side="right")
        read = {"sample_valid": np.isin(at, clock), "sample": place[row], "sample_ok": ~bad[row]}
        read |= {"sample_age": np.full(len(at), READ_AGE)}
    else:
        at, level = answer(reads, start, Answers(place[1:], 1 + reads.delay, error=bad[1:]))
        read = {reads.line: level}
    clock = merged(lines.clock, at[at < lines.n_clocks])
    held = np.searchsorted(at, clock, side="right") - 1
    return PinTrace.of_lines(clock, lines.n_clocks, lines.at(clock) | {name: one[held] for name, one in read.items()})
