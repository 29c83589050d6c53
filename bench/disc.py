"""Measures how much less the velocity is wrong with a map of the disc, for docs/guides/disc.md."""

import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from motions import faults_of, values_of
from pages import MEASURED, ROOT, Rows, markdown, measure, read_table, write_block

from tachometry.sim import golden
from tachometry.sim.encoder.crossings import Disc
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.calibrating.calibrate import calibrate
from tachometry.spec import TachometerSpec, of_texts

PAGE, TABLE = ROOT / "docs" / "guides" / "disc.md", MEASURED / "tables" / "disc.csv"
FIRST_SEED, COAST = 1201, "ramp:150rad/s:60rad/s:2400ms"  # 40 turns
ENCODER, MT = {"lines": "500", "index": "yes"}, {"max-time": "10ms"}
BASE = {**ENCODER, "clock": "48MHz", "tick": "20us", "max-speed": "400rad/s"}
METHODS = {"track": {"max-time": "100ms"}, "mt": MT, "mt, 1 ms": MT | {"min-time": "1ms"}, "s": MT}
METHODS |= {f"{method}, sectors": METHODS[method] | {"disc-table": "sectors"} for method in ("track", "mt")}
DISCS = {
    "off centre": "real eccentricity=0.25",
    "magnetic": "jitter=0.05 nonuniformity=0.02",
    "real": "real",
    "bad": "bad",
    "real, little jitter": "jitter=0.005 nonuniformity=0.1 phase-error=10",
}
WAVES = {"magnetic": (0.5, 0.25, 0.125, 0.0625)}  # counts, 1, 2, … times in a turn
# By what they are: the motion, which passes the index at once, and the seconds that are left out.
MOTIONS = {
    "5 rad/s": ("constant:5rad/s:600ms", 0.2),
    "50 rad/s": ("constant:50rad/s:600ms", 0.1),
    "217 rad/s": ("constant:217rad/s:400ms", 0.1),
    "ramp": ("ramp:0:100rad/s:400ms", 0.04),
    "reversals": ("sine:50rad/s:5Hz:400ms", 0.1),
}
GUIDE = [("track", "50 rad/s"), ("track", "ramp"), ("track, sectors", "ramp"), ("track", "reversals")]
GUIDE += [(method, "50 rad/s") for method in ("mt", "mt, sectors")]


def encoder_of(disc: str, seed: int) -> VirtualEncoder:
    """Return an encoder that has this disc."""
    encoder = VirtualEncoder(500, index=True, **values_of(faults_of(DISCS[disc]), seed))
    angle, random = np.arange(2000) * math.pi / 1000, np.random.default_rng(seed)
    waves = [size * np.sin(n * angle + random.uniform(0, 7)) for n, size in enumerate(WAVES.get(disc, ()), 1)]
    encoder.__dict__["disc"] = Disc(encoder.disc.pitch_rad, sum(waves, encoder.disc.offset))
    return encoder


@cache
def map_of(disc: str, seed: int) -> str:
    """Return the map, as text, from a capture with other jitter."""
    encoder = encoder_of(disc, seed)
    object.__setattr__(encoder, "seed", seed + 5000)  # its disc stays
    found = calibrate([(disc, encoder.record(parse_motion(COAST)).recording)], of_texts("s", ENCODER))
    assert not found.reasons, (disc, seed, found.reasons)
    return found.disc.text


def error(spec: TachometerSpec, truth: Encoding, begin: float) -> float:
    """Return the RMS error in rad/s of the updates of a core."""
    updates = golden.run(spec, PinTrace.of(truth.recording, spec).completed(spec)).updates
    at = updates.clock / spec.timing.clock_hz
    judged = (at > begin) & (at < truth.recording.duration)
    wrong = updates.velocity * spec.velocity.rad_per_s_per_lsb - truth.true_speed(at)
    return float(np.sqrt(np.mean(wrong[judged] ** 2)))


def errors(disc: str, motion: str, seeds: int, methods: tuple[str, ...] = tuple(METHODS)) -> Iterator[list[str]]:
    """Yield for each method the RMS error without a map, with it, and the gain: means over the seeds."""
    words, begin = MOTIONS[motion]
    found = {method: list[list[float]]() for method in methods}
    with TemporaryDirectory() as folder:
        for seed in range(FIRST_SEED, FIRST_SEED + seeds):
            (path := Path(folder, "disc.json")).write_text(map_of(disc, seed), encoding="utf-8")
            truth = encoder_of(disc, seed).record(parse_motion(words))
            for method, rows in found.items():
                name, texts = method.partition(",")[0], BASE | METHODS[method]
                rows.append([error(of_texts(name, texts | more), truth, begin) for more in ({}, {"disc": str(path)})])
    for method, rows in found.items():
        without, mapped = np.mean(rows, axis=0)
        yield [disc, method, motion, f"{without:.2g}", f"{mapped:.2g}", f"{float(f'{without / mapped:.2g}'):g}"]


def table(seeds: int) -> Rows:
    """Return the errors with all discs, in all motions, of all methods."""
    every = [row for disc in DISCS for motion in MOTIONS for row in errors(disc, motion, seeds)]
    return [["disc", "method", "motion", "rad/s without", "rad/s with", "gain"], *every]


def gains() -> str:
    """Return the table of the guide: a row for each disc."""
    cells = {(row["disc"], row["method"], row["motion"]): row["gain"] for row in read_table(TABLE)}
    heads = [f"`{method}`, {motion}" for method, motion in GUIDE]
    return markdown(["disc", *heads], [[disc, *(cells[disc, *one] for one in GUIDE)] for disc in DISCS])


if __name__ == "__main__":
    measure(TABLE.parent.with_suffix(".md"), {"disc": table}, seeds=6)
    write_block(PAGE, "gains", gains())
