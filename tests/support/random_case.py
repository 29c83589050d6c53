"""Random cores, each with a motion."""

from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import (
    METHODS,
    Encoder,
    MTTachometer,
    ParameterError,
    RairanTachometer,
    Speed,
    TachometerSpec,
    Timing,
)
from tachometry.spec.core.extras.health import Health
from tachometry.spec.core.extras.over_speed import OverSpeed
from tachometry.spec.core.extras.position_compare import DIRECTIONS, Compare, PositionCompare
from tachometry.spec.core.index import Index
from tachometry.spec.methods.timed import TimedTachometer

PULSES_PER_REV = 100
CLOCK_HZ = 1_000_000
MIN_TICKS, MIN_UPDATES = 2000, 200


def random_case(seed: int, method: str = "s") -> tuple[TachometerSpec, Encoding, PinTrace]:
    """Return a configuration and a motion for it: some speed in the band of a few unit velocities, moved about."""
    rng = np.random.default_rng(seed)
    tick_cycles = int(rng.choice([1, 2, 2, 3, 3, 3, 4, 4, 5, 6, 8, 16]))
    max_ticks = int(rng.choice([2, 3, 5, 10, 20]))
    timed = issubclass(METHODS[method], TimedTachometer)
    if timed:  # a division takes some ticks, or only part of one
        tick_cycles = int(rng.choice([1, 2, 2, 3, 3, 4, 4, 8, 8, 32], p=[0.12] + 8 * [0.105] + [0.04]))
        max_ticks = int(rng.choice([2, 3, 10, 60])) * (1 if tick_cycles > 8 else 5)
    elif method == "track":  # its program takes hundreds of clocks
        tick_cycles = int(rng.choice([1000, 1024, 1200]))
    elif tick_cycles > 4 and method != "rairan":  # for time
        max_ticks = min(max_ticks, 5)
    decoding = int(rng.choice([1, 2, 4, 4]))
    least = MIN_TICKS // 5 if method == "track" else MIN_TICKS
    n_ticks = max(MIN_TICKS + 20, (MIN_UPDATES + 5) * max_ticks) if method == "s" else least + 20
    external = tick_cycles > 1 and bool(rng.random() < 0.3) and not METHODS[method].facts.own_ticks
    if external:
        n_ticks += n_ticks // 4  # fewer may come
    band = [0.004, 0.05, 0.3, 1.003, 1.4, 3.25]
    if timed:
        band = [k * tick_cycles / 16 for k in (0.05, 0.1, 0.3, 0.5, 1, 4)]
    if method == "s" and tick_cycles == 1 and rng.random() < 0.5:
        max_ticks, n_ticks = 3000, 15_000  # the reciprocal is carried
        band = [0.05, 0.3]
    if method == "rairan":
        # Reversals and counts that open windows make ticks longer, above all at high speeds.
        tick_cycles = int(rng.choice([1, 1, 1, 1, 1, 2, 2, 2, 3, 4]))
        band, longer = [([0.14], 1.16), ([0.3], 1.35), ([1.003, 1.4, 3.25], 1.6)][int(rng.integers(3))]
        n_ticks = int(longer * MIN_TICKS)
    if method == "track":
        band = [0.02, 0.1, 0.5, 1.003, 3.25, 20]
    duration = n_ticks * tick_cycles / CLOCK_HZ
    # One step takes at least a clock, and one decoded count takes 4/decoding of them.
    fastest = tick_cycles * decoding / 4
    unit = 2 * np.pi * CLOCK_HZ / (PULSES_PER_REV * decoding * tick_cycles)
    speeds = unit * np.minimum(rng.choice(band) * rng.uniform(0.9, 1.1, size=4), 0.9 * fastest)
    speeds *= rng.choice([-1, 1], size=4)
    parts = [
        f"constant:{speeds[0]}rad/s:{duration / 4}s",
        f"ramp:{speeds[0]}rad/s:{speeds[1]}rad/s:{duration / 4}s",
        f"sine:{speeds[2]}rad/s:{rng.choice([1, 3, 20]) / duration}Hz:{duration / 4}s",
        f"stop:{duration / 8}s",
        f"ramp:0rad/s:{speeds[3]}rad/s:{duration / 8}s",
    ]
    order = rng.permutation(len(parts))
    pitch = 2 * np.pi / (4 * PULSES_PER_REV)
    encoder = VirtualEncoder(
        PULSES_PER_REV,
        vibration=Vibration(rng.uniform(0, 3) * pitch, 10 / duration) if rng.random() < 0.6 else None,
        jitter=float(rng.choice([0, 0.05, 0.3])),
        nonuniformity=float(rng.choice([0, 0.1])),
        illegal=float(rng.choice([0, 0, 0.02])),
        start_angle_rad=float(rng.uniform(0, 2 * np.pi)),
        seed=seed,
        index=bool(rng.random() < 0.5),
    )
    max_speed = Speed(Fraction(round(unit * rng.uniform(0.2, 3), 3))) if rng.random() < 0.5 else None
    spec = METHODS[method](
        encoder=Encoder(PULSES_PER_REV, decoding),
        timing=Timing(CLOCK_HZ, tick_cycles, max_ticks),
        frac_bits=int(rng.integers(4, 13 if method == "track" or (timed and rng.random() < 0.8) else 25)),
        max_speed=max_speed,
        **(options := random_options(method, rng)),
        position_width=int(rng.choice([8, 16, 32, 48])),
        filter_clocks=filter_of(method, int(rng.choice([0, 0, 0, 1, 2, 5])), tick_cycles),
        index=Index(reset=bool(rng.random() < 0.5)) if encoder.index else None,
        external_tick=external,
        max_tick_cycles=int(tick_cycles * rng.choice([1, 2, 3, 6] if method == "track" else [1, 2, 3]))
        if external
        else None,
        age=bool(rng.random() < 0.5),
        bounds=bool(rng.random() < 0.5) and not options.get("paper_exact") and METHODS[method].facts.bounds,
    )
    if rng.random() < 0.25 and getattr(spec, "adaptive", None) is None:
        spec = replace(spec, lowpass=Fraction(max(1, round(CLOCK_HZ / tick_cycles * 10 ** rng.uniform(-4, 0)))))
    if spec.bounds:
        # From a stream of its own: all else stays as it is without it.
        spec = replace(spec, edge_error=Fraction(max(0, int(rng.spawn(1)[0].integers(-8, 9))), 8))
    if method == "mt" and rng.random() < 0.6:
        longest = int(rng.choice([2, max_ticks]))
        unit_cycles = spec.times.interval_unit
        assert isinstance(spec, MTTachometer)
        spec = replace(spec, min_time=unit_cycles * int(rng.integers(1, longest * tick_cycles // unit_cycles + 1)))
    if isinstance(spec, RairanTachometer) and max_ticks >= 10 and not (spec.paper_exact or spec.lowpass):
        spec = replace(spec, adaptive=Fraction(1, 4))
        spec = replace(spec, adaptive=Fraction(1, int(rng.integers(4, 2 * spec.widths.max_pulse_count))))
    spec = watched(random_output(spec, rng), np.random.default_rng([seed, 1]))
    earliest = spec.times.min_tick_cycles if method == "track" else 0  # elsewhere ticks are as short anyway
    encoding = encoder.record(parse_motion("+".join(parts[k] for k in order)))
    trace = encoding.recording.place(CLOCK_HZ)
    return spec, encoding, random_ticks(trace, tick_cycles, rng, earliest) if spec.external_tick else trace


def watched(spec: TachometerSpec, rng: np.random.Generator) -> TachometerSpec:
    """Return the core, every other time with a watch of its encoder that finds many faults."""
    if rng.random() < 0.5:
        return spec
    edges, errors = (int(rng.integers(least, 4)) for least in (2, 0))
    compare = Compare(int(rng.integers(-3, 4)), int(rng.integers(3, 6)), int(rng.choice([0, 3, 25])), "2clk")
    compare = replace(compare, direction=str(rng.choice(DIRECTIONS)))
    limit = Speed(Fraction(str(round(spec.velocity.greatest_speed * rng.uniform(0.02, 0.5), 3) or 0.001)))
    health, over_speed = Health(edges=edges, errors=errors), OverSpeed(limit=limit)
    return replace(spec, extras=(health, over_speed, PositionCompare(places=compare)))


def filter_of(method: str, clocks: int, tick_cycles: int) -> int:
    """Return clocks of the glitch filter that are few or many beside those between two edges."""
    if method == "track":
        return 16 * clocks
    return min(clocks, tick_cycles) if method == "rairan" else clocks


def random_options(method: str, rng: np.random.Generator) -> dict[str, Any]:
    """Return options of the method."""
    if method == "s":
        return {"cancel": bool(rng.random() < 0.75)}
    if method == "track":
        return {
            "max_memory": None if rng.random() < 0.7 else int(10 ** rng.uniform(3.1, 6)),
            "multiplier": str(rng.choice(["serial", "block", "auto"])),
            "position_fine_bits": int(rng.choice([1, 8, 16])),
        }
    if method == "rairan":
        return {
            "estimate": str(rng.choice(["n1", "n2", "n3", "n3"])),
            "paper_exact": bool(rng.random() < 0.2),
            "bound_decay": bool(rng.random() < 0.7),
        }
    if issubclass(METHODS[method], TimedTachometer):
        return {
            "timer": str(rng.choice(["clock", "clock", "tick"])),
            "bound_decay": bool(rng.random() < 0.8),
            "paper_exact": bool(rng.random() < 0.2),
        }
    return {"average": int(rng.choice([1, 2, 3, 4, 7, 8, 16, 33, 100]))}


def random_output(spec: TachometerSpec, rng: np.random.Generator) -> TachometerSpec:
    """Return velocity in another unit, with an LSB that it can have, or saturating."""
    unit = str(rng.choice(["count/tick"] * 4 + ["rad/s", "rev/s", "rpm"]))
    if unit != "count/tick":
        coarsest, finest = spec.velocity.frac_bits_range(unit)
        spec = replace(spec, unit=unit, frac_bits=int(rng.integers(max(coarsest, finest - 12), finest + 1)))
    if rng.random() < 0.3:
        narrower = 10 if isinstance(spec, TimedTachometer) else 4
        width = max(8, spec.velocity.width - int(rng.integers(-2, narrower)))
        with suppress(ParameterError):
            return replace(spec, velocity_width=width)
        # Too narrow for the greatest speed: it saturates without one.
        if not isinstance(spec, TimedTachometer) or width % 2:
            with suppress(ParameterError):
                return replace(spec, velocity_width=width, max_speed=None)
    return spec


def random_ticks(trace: PinTrace, tick_cycles: int, rng: np.random.Generator, earliest: int = 0) -> PinTrace:
    """Return an external tick about as long as nominal: regular for a while, then not, then missing; some are the
    earliest.
    """
    n = trace.n_clocks // tick_cycles + 1
    gaps = np.full(n, tick_cycles)
    gaps[n // 2 :] += rng.integers(-tick_cycles // 2, tick_cycles, n - n // 2)
    gaps[rng.random(n) < 0.02] *= 5
    if earliest:
        gaps[rng.random(n) < 0.05] = earliest
    return trace.with_tick_in(np.cumsum(np.maximum(gaps, 2)) + int(rng.integers(0, 3)))
