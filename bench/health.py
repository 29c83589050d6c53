"""Measures what `--health` tells of encoders, for docs/measured/health.md: nothing of good ones, faults in time.

Virtual encoders and the golden model are exact, so that the file is the same on every machine. `python bench/health.py`
writes both tables anew.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pages import markdown, write_block

from tachometry.sim import golden
from tachometry.sim.encoder.imperfections import LineFault
from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import PinTrace, Recording
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.core.health import Fault

PAGE = Path(__file__).resolve().parent.parent / "docs" / "measured" / "health.md"
CORE = {"clock": "48MHz", "tick": "1ms", "max-time": "100ms", "health": "yes"}
INDEX = {"index": "yes"}
OPEN = INDEX | {"complements": "1us"}
REAL: dict[str, Any] = {"jitter": 0.05, "nonuniformity": 0.1, "phase_error_deg": 10}

# Good encoders.
MOTION = "ramp:0:100rad/s:500ms+constant:100rad/s:1s+ramp:100rad/s:-100rad/s:500ms+constant:-30rad/s:500ms"
MOTION += "+sine:20rad/s:3Hz:500ms+constant:2rad/s:400ms+stop:100ms"
REPEATED = 6  # 21 s, 1.008 10^9 clocks
SKEW_S = 0.2e-6
_VIBRATION = Vibration.parse("1mrad:80Hz")
DISCS: dict[str, dict[str, Any]] = {
    "500 lines, jitter 5 %, edges off by 0.1, phase by 10°": {"pulses_per_rev": 500, **REAL},
    "500 lines, off centre by 0.3, duty by 10°, vibration 1mrad:80Hz": {
        **{"pulses_per_rev": 500, "eccentricity": 0.3, "duty_error_deg": 10, "vibration": _VIBRATION}
    },
    "2500 lines, jitter 5 %, phase by 10°": {"pulses_per_rev": 2500, "jitter": 0.05, "phase_error_deg": 10},
    "64 lines, jitter 10 %, an index of two quarters": {"pulses_per_rev": 64, "jitter": 0.1, "index_width": 2},
}

# Bad ones, of 500 lines, at a speed, from a time on.
SPEED, SEEDS, AT_S = 100, 20, 0.1
PULSE_S = 2 * np.pi / SPEED / 500
TURN_S = 500 * PULSE_S


@dataclass(frozen=True)
class Example:
    """A fault, its code, and the time within which it must be told."""

    # option and words: what the command line calls the fault, and how the time follows
    option: str
    code: Fault
    within_s: float
    words: str
    # faulty and core: parameters of the encoder, and options of the core beside those of all
    faulty: dict[str, Any] = field(default_factory=dict)
    core: dict[str, str] = field(default_factory=dict)
    onset: int = 0  # how many times the lines must have been wrong before the time begins


def _wires() -> Iterator[Example]:
    for name in ("broken", "stuck"):
        for line, code in (("a", Fault.A_STANDS), ("b", Fault.B_STANDS)):
            yield Example(f"--{name} {line}", code, 256 * PULSE_S, "512 edges of the other line", {name: line})
    for name, lines in (("broken", ("a", "a_n", "b", "b_n")), ("stuck", ("a", "b_n"))):
        for line in lines:
            code = Fault.A_OPEN if line[0] == "a" else Fault.B_OPEN
            yield Example(f"--{name} {line}", code, PULSE_S + 2e-6, "a pulse, and 1 µs", {name: line}, OPEN)
    for name, line in (("broken", "z_n"), ("stuck", "z")):
        yield Example(f"--{name} {line}", Fault.Z_OPEN, TURN_S + 2e-6, "a revolution, and 1 µs", {name: line}, OPEN)


EXAMPLES = (
    *_wires(),
    Example("--lost 0.001", Fault.INDEX_COUNTS, TURN_S, "a revolution", {"lost": 1e-3}, INDEX),
    Example("--illegal 0.001", Fault.ILLEGAL, PULSE_S, "the eleventh transition", {"illegal": 1e-3}, onset=10),
)


def of_disc(ppr: int, more: dict[str, str]) -> TachometerSpec:
    """Return a core for a disc."""
    return of_texts("m", {"ppr": str(ppr), **CORE, **more})


def record(spec: TachometerSpec, motion: str, **values: Any) -> Recording:
    """Return what an encoder of the core does, with its complements if the core has these."""
    return VirtualEncoder.of_core(spec, **values).record(parse_motion(motion)).recording


def skewed(recording: Recording) -> Recording:
    """Return the recording with complements that are late."""
    late = np.minimum(recording.time + SKEW_S, recording.duration)
    late[0] = 0
    time = np.union1d(recording.time, late)
    now, before = (np.searchsorted(each, time, side="right") - 1 for each in (recording.time, late))
    more = {name: line[before] for name, line in recording.more.items()}
    assert recording.z is not None
    a, b, z = (line[now] for line in (recording.a, recording.b, recording.z))
    return Recording(time, a, b, recording.duration, z, more=more)


def clean(name: str, repeated: int = REPEATED) -> list[str]:
    """Return a row of the table of good encoders."""
    values = dict(DISCS[name])
    spec = of_disc(values.pop("pulses_per_rev"), {**OPEN, "index-at": "A=1,B=1"})
    trace = PinTrace.of(skewed(record(spec, f"{repeated}*({MOTION})", seed=7, **values)), spec)
    tables = golden.tables(spec, trace)
    edges = np.count_nonzero(np.diff(trace.a)) + np.count_nonzero(np.diff(trace.b))
    return [name, *map(str, (trace.n_clocks, edges, len(tables["index_valid"].clock), len(tables["fault"].clock)))]


def wrong_from(recording: Recording, other: Recording, n: int) -> float:
    """Return when the lines of a recording are those of another no more, for the n-th time (0: the first) in a turn
    whose index was seen.
    """
    time = np.union1d(recording.time, other.time)
    levels: list[NDArray[np.uint8]] = []
    for each in (recording, other):
        levels.append(each.level[np.searchsorted(each.time, time, side="right") - 1])
    begins = time[np.flatnonzero(np.diff((levels[0] != levels[1]).astype(np.int8)) > 0) + 1]
    return float(begins[begins > (2.2 * TURN_S if not n else 0)][n])


def told(example: Example, seed: int) -> float:
    """Return seconds from a fault until it was told.

    Raises
    ------
    ValueError
        If it was not told, or another one.
    """
    spec = of_disc(500, example.core)
    motion = f"constant:{SPEED}rad/s:1s"
    begin = AT_S + seed * 0.37 * example.within_s
    wire = {name: LineFault(at, begin) for name, at in example.faulty.items() if isinstance(at, str)}
    recording = record(spec, motion, seed=seed, **REAL, **(wire or example.faulty))
    if not wire:
        begin = wrong_from(recording, record(spec, motion, seed=seed, **REAL), example.onset)
    faults = golden.tables(spec, PinTrace.of(recording, spec))["fault"]
    later = np.flatnonzero(faults.clock / spec.timing.clock_hz > begin)
    if not len(later) or faults.code[later[0]] != example.code:
        raise ValueError(f"{example.option}, seed {seed}: {faults.code[later[:1]]} instead of {example.code}")
    return float(faults.clock[later[0]] / spec.timing.clock_hz - begin)


def faulty(example: Example, seeds: int = SEEDS) -> list[str]:
    """Return a row of the table of bad encoders; ValueError if a fault was told too late."""
    worst = max(told(example, seed) for seed in range(seeds))
    if worst > example.within_s:
        raise ValueError(f"{example.option} must be told within {example.within_s} s, not {worst} s")
    core = " ".join(f"`--{name} {value}`".replace(" yes", "") for name, value in example.core.items())
    stated = f"{example.words}: {1e3 * example.within_s:.3f} ms"
    return [f"`{example.option}`", core, str(int(example.code)), f"{1e3 * worst:.3f} ms", stated]


def main() -> None:
    """Write both tables."""
    heads = ["disc", "clocks", "edges", "indices", "faults"]
    write_block(PAGE, "clean", markdown(heads, [clean(name) for name in DISCS]))
    heads = ["fault", "core", "`health`", f"told after, worst of {SEEDS}", "stated"]
    write_block(PAGE, "faults", markdown(heads, [faulty(one) for one in EXAMPLES], left=(0, 1, 4)))


if __name__ == "__main__":
    main()
