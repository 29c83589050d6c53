"""Every pair of option values in some configuration, and a motion that visits what each of them must survive."""

from collections import OrderedDict
from fractions import Fraction
from typing import Any

import numpy as np
from allpairspy import AllPairs

from tachometry.sim.recording import PinTrace
from tachometry.spec import METHODS, Encoder, Speed, TachometerSpec, Timing
from tachometry.spec.timed import TimedTachometer

CLOCK_HZ = 48_000_000
S_FACTORS: dict[str, list[Any]] = {
    "method": ["s"],
    "tick_cycles": [1, 2, 3, 960],
    "max_ticks": [2, 3, 500, 1 << 16],
    "unit": ["count/tick", "rad/s", "rev/s", "rpm"],
    "frac_bits": ["fewest", "16", "most"],
    "velocity_bits": [None, "as needed", "too few"],
    "decoding": [4, 2, 1],
    "index": ["none", "capture", "reset"],
    "filter_clocks": [0, 1, 5],
    "max_speed": [False, True],
    "cancel": [True, False],
    "external": [False, True],
    "position_width": [8, 32, 48],
    "age": [False, True],
    "bounds": [False, True],
}
# What a method has of its own, with what of the rest has to do with it; where a factor is missing, its first value.
RAIRAN_FACTORS: dict[str, list[Any]] = {
    "method": ["rairan"],
    "adaptive": [None, Fraction(1, 4)],
    "tick_cycles": [1, 3, 960],
    "max_ticks": [2, 500],
    "unit": ["count/tick", "rpm"],
    "frac_bits": ["fewest", "most"],
    "velocity_bits": [None, "too few"],
    "index": ["none", "reset"],
    "max_speed": [False, True],
    "estimate": ["n3", "n2", "n1"],
    "paper_exact": [False, True],
    "bound_decay": [True, False],
    "bounds": [False, True],
}

TIMED_FACTORS: dict[str, list[Any]] = {
    "method": ["t", "mt"],
    "tick_cycles": [1, 3, 960],
    "max_ticks": [2, 500],
    "unit": ["count/tick", "rpm"],
    "frac_bits": ["fewest", "most"],
    "velocity_bits": [None, "too few"],
    "max_speed": [False, True],
    "external": [False, True],
    "timer": ["clock", "tick"],
    "paper_exact": [False, True],
    "bound_decay": [True, False],
    "bounds": [False, True],
}


def _rows(factors: dict[str, list[Any]]) -> list[dict[str, Any]]:
    def possible(values: list[Any]) -> bool:
        """An external tick takes two clocks, Table 1 to the letter has no bounds, dt is doubled in four at least."""
        chosen = dict(zip(factors, values, strict=False))
        bad = (
            chosen.get("external") and chosen["tick_cycles"] == 1,
            chosen.get("paper_exact") and (chosen.get("bounds") or chosen.get("adaptive")),
            chosen.get("adaptive") and chosen.get("max_ticks") == 2,
        )
        return not any(bad)

    return [dict(row._asdict()) for row in AllPairs(OrderedDict(factors), filter_func=possible)]


def rows() -> list[dict[str, Any]]:
    """Configurations in which every two values meet."""
    return [row for factors in (S_FACTORS, RAIRAN_FACTORS, TIMED_FACTORS) for row in _rows(factors)]


def spec_of(row: dict[str, Any]) -> TachometerSpec:
    """The core of a configuration."""
    own = [name for name in ("cancel", "estimate", "timer", "paper_exact", "bound_decay", "adaptive") if name in row]
    row = {name: values[0] for name, values in S_FACTORS.items()} | row
    make = METHODS[row["method"]]
    cycles = row["tick_cycles"]
    encoder = Encoder(500, row["decoding"])
    counts_per_tick = Fraction(9, 4) if cycles > 2 else Fraction(3, 4)
    max_speed = Speed(counts_per_tick * CLOCK_HZ / (cycles * encoder.counts_per_rev), "rev/s")
    fixed = {
        "encoder": encoder,
        "timing": Timing(CLOCK_HZ, cycles, row["max_ticks"]),
        "max_speed": max_speed if row["max_speed"] else None,
        **{name: row[name] for name in own},
        "filter_clocks": row["filter_clocks"],
        "position_width": row["position_width"],
        "index": row["index"] != "none",
        "index_reset": row["index"] == "reset",
        "max_tick_cycles": 2 * cycles if row["external"] else None,
        "age": row["age"],
        "bounds": row["bounds"],
    }
    fewest, most = make(**fixed).frac_bits_range(row["unit"])
    frac_bits = {"fewest": max(fewest, most - 20), "16": min(most, 16), "most": most}[row["frac_bits"]]
    spec = make(**fixed, unit=row["unit"], frac_bits=frac_bits)
    if row["velocity_bits"] is None:
        return spec
    less = 0 if row["velocity_bits"] == "as needed" else 2
    return make(**fixed, unit=row["unit"], frac_bits=frac_bits, velocity_bits=max(8, spec.velocity_width - less))


def motion(spec: TachometerSpec, seed: int) -> PinTrace:
    """Speeds about the unit velocity and its multiples, reversals, illegal transitions, creeping, standstill."""
    rng = np.random.default_rng(seed)
    cycles, longest = spec.timing.tick_cycles, spec.timing.tick_cycles * spec.timing.max_ticks
    gaps, turns = [], []
    for speed in (0.3, 1.01, 1.5, 2.2, 3.25, 0.1):
        gap = max(1.0 + spec.filter_clocks, cycles * spec.encoder.decoding / 4 / speed)
        jitter = rng.choice([0, 0.2])
        n = 300
        sign = rng.choice([1, -1])
        gaps.append(gap * (1 + jitter * rng.standard_normal(n)))
        turns.append(np.where(rng.random(n) < 0.01, 2, sign))
    # Longer than a measurement: forced updates, the count after them, a standstill.
    edges = 4 // spec.encoder.decoding
    gaps.append(np.full(3 * edges, 0.7 * longest / edges))
    gaps.append(np.full(edges, 1.3 * longest / edges))
    turns.append(np.full(4 * edges, rng.choice([1, -1])))
    clock = np.cumsum(np.maximum(1, np.rint(np.concatenate(gaps))).astype(np.int64))
    quarter = np.append(0, np.cumsum(np.concatenate(turns))) % 4
    clock = np.append(0, clock)
    z = (rng.random(len(clock)) < 0.05).astype(np.uint8)
    a, b = np.isin(quarter, [1, 2]).astype(np.uint8), np.isin(quarter, [2, 3]).astype(np.uint8)
    rest = 22 if isinstance(spec, TimedTachometer) else 17
    trace = PinTrace(clock, a, b, int(clock[-1]) + rest * longest // 10 + 40 * cycles + 300, z)
    if spec.max_tick_cycles is None:
        return trace
    gap = np.full(trace.n_clocks // cycles + 1, cycles)
    gap[500:1000] += rng.integers(-cycles // 2, cycles, len(gap[500:1000]))
    gap[700:710] *= 4
    return trace.with_tick_in(np.cumsum(np.maximum(gap, 2)))
