"""Measures what is gained if the errors of a disc are learned from its own edges.

`python bench/encoder_errors.py` writes docs/measured/encoder-errors.md anew. To study another method,
add its estimator to `METHODS`.
"""

import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pages import markdown, write_block

from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.sim.studies.comparing.baselines import Estimate
from tachometry.sim.studies.comparing.encoder_errors import (
    CYCLE,
    Counts,
    by_counts,
    by_tracking,
    learn,
    perfect_offsets,
    rms,
    shifted,
)
from tachometry.sim.theory.tracking import Tuning
from tachometry.spec import Encoder, Speed, Timing, TrackTachometer

PAGE = Path(__file__).resolve().parent.parent / "docs" / "measured" / "encoder-errors.md"
LINES = 500
SEEDS = (1, 2, 3)
FloatArray = NDArray[np.float64]

DISCS: dict[str, dict[str, Any]] = {
    "real": {"jitter": 0.05, "nonuniformity": 0.1, "phase_error_deg": 10},
    "bad": {"jitter": 0.1, "nonuniformity": 0.2, "phase_error_deg": 20},
    "phase": {"jitter": 0.01, "nonuniformity": 0.01, "phase_error_deg": 20, "duty_error_deg": 20},
    "lines": {"jitter": 0.01, "nonuniformity": 0.2},
}
# Motions, and where errors are counted from: in s.
MOTIONS = {
    "217 rad/s": ("constant:217rad/s:500ms", 0.2),
    "20 rad/s": ("constant:20rad/s:2s", 0.5),
    "1.3 rad/s": ("constant:1.3rad/s:4s", 2.0),
    "ramp": ("constant:100rad/s:200ms+ramp:100rad/s:0:400ms", 0.2),
    "sine 50 rad/s, 5 Hz": ("sine:50rad/s:5Hz:800ms", 0.2),
}
# Where a table for the whole disc comes from: about 32 turns.
TEACHING = "constant:100rad/s:2s"

TRACK = TrackTachometer(encoder=Encoder(500), timing=Timing(48_000_000, 960, 500), max_speed=Speed.parse("1000rad/s"))

Method = Callable[[Counts, FloatArray], Estimate]
METHODS: Mapping[str, Method] = {
    "M/T 300 us": partial(by_counts, min_time_s=300e-6),
    "M/T 1 ms": partial(by_counts, min_time_s=1e-3),
    "track": partial(by_tracking, tuning=Tuning.of(TRACK)),
    "track, E = 0.8": partial(by_tracking, tuning=replace(Tuning.of(TRACK), edge_error=0.8)),
}
# The same with windows of whole cycles, where a method has them.
WHOLE_CYCLES: Mapping[str, Method] = {
    name: partial(by_counts, min_time_s=time, whole_cycles=True)
    for name, time in (("M/T 300 us", 300e-6), ("M/T 1 ms", 1e-3))
}


def recorded(motion: str, seed: int, **faults: Any) -> Encoding:
    """Return a motion on a disc; the disc depends on the seed alone."""
    return VirtualEncoder(LINES, seed=seed, **faults).record(parse_motion(motion))


def pooled(errors: list[float]) -> float:
    """Return RMS of several runs."""
    return float(np.sqrt(np.mean(np.square(errors))))


def gained(disc: str, motion: str, begin: float) -> dict[str, list[float]]:
    """Return RMS errors in rad/s of each method: with positions, whole cycles, a learned cycle, and a learned disc."""
    found: dict[str, list[list[float]]] = {name: [] for name in METHODS}
    for seed in SEEDS:
        # The jitter of an edge is that of its number: another line of the disc has it.
        teacher = recorded(TEACHING, seed, start_angle_rad=1.0, **DISCS[disc])
        lines = learn(Counts.of(teacher), CYCLE * LINES, 1 / 32).offsets
        encoding = recorded(motion, seed, **DISCS[disc])
        counts = Counts.of(encoding)
        instants = np.arange(begin, encoding.motion.duration, 1e-4)
        truth = encoding.true_speed(instants)
        plain = counts.coordinate(np.zeros(1))
        for name, method in METHODS.items():
            whole = WHOLE_CYCLES.get(name)
            estimates = [
                method(counts, plain),
                method(counts, learn(counts).coordinate(counts)),
                method(counts, counts.coordinate(lines)),
                *([] if whole is None else [whole(counts, plain)]),
            ]
            found[name].append([rms(one, truth, instants) for one in estimates])
    return {name: [pooled(list(column)) for column in zip(*rows, strict=True)] for name, rows in found.items()}


def gains() -> str:
    """Return the errors as they are, and the parts that are left with a cycle, with a disc, and with whole cycles."""
    rows = []
    for disc in DISCS:
        for motion, (text, begin) in MOTIONS.items():
            found = gained(disc, text, begin).values()
            cells = [f"{none:.3g}: {', '.join(f'{one / none:.2f}' for one in others)}" for none, *others in found]
            rows.append([disc, motion, *cells])
            print(*rows[-1], sep="  ", flush=True)
    return markdown(["disc", "motion", *METHODS], rows, range(len(METHODS) + 2))


def speeds_of_learning() -> str:
    """Tell how far the offsets of a cycle are off after some cycles, RMS over ten discs, in counts."""
    after = (4, 16, 64, 256, 1024, 8192)
    rows = []
    for disc in ("real", "bad"):
        for shift in (5, 7, 9):
            errors = []
            for seed in range(10):
                encoding = recorded("constant:217rad/s:500ms", seed, **DISCS[disc])
                history = learn(Counts.of(encoding), least_rate=2.0**-shift).history
                off = history[[CYCLE * n for n in after]] - perfect_offsets(encoding, CYCLE)
                errors.append(np.sqrt(np.mean(np.square(off), axis=1)))
            rows.append([disc, f"2^-{shift}", *(f"{one:.4f}" for one in np.sqrt(np.mean(np.square(errors), axis=0)))])
    return markdown(["disc", "rate", *(f"{n} cycles" for n in after)], rows, (0, 1))


def row_of(counts: Counts, truth: FloatArray, instants: FloatArray, slowest_s: float = 1.0) -> list[str]:
    """Return RMS errors of M/T with T_c = 300 us in rad/s, with and without learned offsets."""
    method = METHODS["M/T 300 us"]
    with_them = method(counts, learn(counts, slowest_s=slowest_s).coordinate(counts))
    without = method(counts, counts.coordinate(np.zeros(1)))
    return [f"{rms(one, truth, instants):.3g}" for one in (without, with_them)]


def limits() -> str:
    """Return hysteresis that depends on the line, and a vibration in step with the cycle."""
    rows = []
    faults: dict[str, Any] = {"jitter": 0.01, "nonuniformity": 0.01, "phase_error_deg": 10}
    encoding = recorded("sine:50rad/s:5Hz:800ms", 1, **faults)
    instants = np.arange(0.2, 0.8, 1e-4)
    for what, of_b, of_a in (("none", 0.0, 0.0), ("0.1 counts", 0.1, 0.1), ("A 0.15, B 0.05 counts", 0.05, 0.15)):
        counts = shifted(Counts.of(encoding), [of_b, of_a], [-of_b, -of_a])
        rows.append(
            ["sine 50 rad/s, 5 Hz", f"hysteresis: {what}", *row_of(counts, encoding.true_speed(instants), instants)]
        )
    slow = "constant:20rad/s:300ms+ramp:20rad/s:2.14rad/s:10ms+constant:2.14rad/s:2s"
    for frequency in (168.0, 170.3):
        encoding = recorded(slow, 1, vibration=Vibration(2e-4, frequency), **faults)
        instants = np.arange(0.8, 2.3, 1e-4)
        for what, slowest_s in (("always", 1.0), ("in cycles below 2 ms", 2e-3)):
            found = row_of(Counts.of(encoding), encoding.true_speed(instants), instants, slowest_s)
            rows.append(["2.14 rad/s, 170.3 cycles/s", f"vibration: {frequency:g} Hz, learned {what}", *found])
    return markdown(["motion", "what", "as it is", "cycle learned"], rows, (0, 1))


TABLES = {"gains": gains, "speeds": speeds_of_learning, "limits": limits}


def main(words: list[str]) -> None:
    """Write the tables of these names, or all, into the page."""
    for name in words or TABLES:
        write_block(PAGE, name, TABLES[name]())


if __name__ == "__main__":
    main(sys.argv[1:])
