"""Measures the faults that `--health` reports, for docs/measured/health.md: none of good encoders, others in time.

Virtual encoders and the golden model are exact, so that the file is the same on every machine.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from motions import REAL, faults_of, values_of
from numpy.typing import NDArray
from pages import MEASURED, data, measure

from tachometry.sim import golden
from tachometry.sim.encoder.imperfections import LineFault
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import PinTrace, Recording
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.core.extras.health import Fault

PAGE = MEASURED / "health.md"
_DATA = data("health")
DISCS: Mapping[str, str] = _DATA["discs"]
MOTION = "ramp:0:100rad/s:500ms+constant:100rad/s:1s+ramp:100rad/s:-100rad/s:500ms+constant:-30rad/s:500ms"
MOTION += "+sine:20rad/s:3Hz:500ms+constant:2rad/s:400ms+stop:100ms"
REPEATED = 6  # 21 s, 1.008 10^9 clocks
SKEW_S = 0.2e-6

# Bad encoders have 500 lines, and are bad from a time on.
SPEED, SEEDS, AT_S = 100, 20, 0.1
PULSE_S = 2 * np.pi / SPEED / 500
TURN_S = 500 * PULSE_S


@dataclass(frozen=True)
class Example:
    """A fault, its code, and the time within which it must be reported; health.toml explains the fields."""

    option: str
    code: str
    pulses: int
    words: str
    core: str = ""
    onset: int = 0

    @property
    def within_s(self) -> float:
        """The time within which it must be reported."""
        return self.pulses * PULSE_S + (2e-6 if "differential" in self.core else 0)


EXAMPLES = tuple(Example(**each) for each in _DATA["fault"])


def core_of(ppr: str, words: str) -> TachometerSpec:
    """Return a core for a disc, with some more options."""
    more = {name: text or "yes" for name, _, text in (word.partition("=") for word in words.split())}
    base = {"clock": "48MHz", "tick": "1ms", "max-time": "100ms", "health": "yes"}
    return of_texts("m", {"ppr": ppr, **base, **more})


def record(
    spec: TachometerSpec, motion: str, faults: Mapping[str, str], seed: int, **more: LineFault | float
) -> Recording:
    """Return what an encoder of the core does, with its complements if the core has these."""
    return VirtualEncoder.of_core(spec, **values_of(faults, seed) | more).record(parse_motion(motion)).recording


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
    faults = faults_of(DISCS[name])
    spec = core_of(faults.pop("ppr"), "index differential=1us index-at=A=1,B=1")
    trace = PinTrace.of(skewed(record(spec, f"{repeated}*({MOTION})", faults, 7)), spec)
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
    """Return seconds from a fault until it was reported; ValueError if it was not, or another one."""
    spec, motion = core_of("500", example.core), f"constant:{SPEED}rad/s:1s"
    begin = AT_S + seed * 0.37 * example.within_s
    name, at = example.option.split()
    is_wire = at[0].isalpha()
    recording = record(spec, motion, REAL, seed, **{name: LineFault(at, begin) if is_wire else float(at)})
    if not is_wire:
        begin = wrong_from(recording, record(spec, motion, REAL, seed), example.onset)
    faults = golden.tables(spec, PinTrace.of(recording, spec))["fault"]
    later = np.flatnonzero((shown := (faults.clock + 1) / spec.timing.clock_hz) > begin)
    if not len(later) or faults.code[later[0]] != Fault[example.code]:
        raise ValueError(f"{example.option}, seed {seed}: {faults.code[later[:1]]} instead of {example.code}")
    return float(shown[later[0]] - begin)


def faulty(example: Example, seeds: int = SEEDS) -> list[str]:
    """Return a row of the table of bad encoders; ValueError if a fault was reported too late."""
    worst = max(told(example, seed) for seed in range(seeds))
    if worst > example.within_s:
        raise ValueError(f"{example.option} must be told within {example.within_s} s, not {worst} s")
    core = " ".join(f"--{word.replace('=', ' ')}" for word in example.core.split())
    stated = f"{example.words}: {1e3 * example.within_s:.3f} ms"
    return [f"--{example.option}", core, str(int(Fault[example.code])), f"{1e3 * worst:.3f} ms", stated]


HEADS = ["fault", "core", "health", f"reported after, worst of {SEEDS}", "stated"]
BLOCKS = {
    "health-clean": lambda: [["disc", "clocks", "edges", "indices", "faults"], *map(clean, DISCS)],
    "health-faults": lambda: [HEADS, *map(faulty, EXAMPLES)],
}

if __name__ == "__main__":
    measure(PAGE, BLOCKS)
