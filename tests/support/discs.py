"""Discs that are known, and when their edges pass on shafts with ripple of the torque or with swings of the speed."""

from collections.abc import Sequence

import numpy as np

from tachometry.sim.signals.arrays import Floats
from tachometry.sim.studies.calibrating.fit import Fit
from tachometry.sim.studies.calibrating.runs import Run

TURN = 2 * np.pi
PHASE = 10.0  # degrees, of the phase error of discs


def disc(n: int, random: np.random.Generator, *, uneven: float = 0.1, eccentricity: float = 0.25) -> Floats:
    """Return displacements in counts: uneven lines, a phase error where there are quarters, a disc off centre."""
    place = np.arange(n)
    quarters = PHASE / 90 * (1 - place % 2) if n % 4 == 0 else 0.0
    return random.uniform(-uneven, uneven, n) + quarters + eccentricity * np.sin(TURN * place / n)


def coasting(
    table: Floats,
    turns: float,
    speeds: tuple[float, float],
    random: np.random.Generator,
    ripple: Sequence[tuple[float, int]] = (),
    *,
    direction: int = 1,
    jitter: float = 0.05,
) -> Run:
    """Return a run that changes its speed (rad/s) by a constant torque, and by ripple: each a share of the speed at
    100 rad/s, and how often it comes in a turn.
    """
    n = len(table)
    count = np.arange(int(turns * n))
    way = np.arange(-8.0, 4 * len(count) + 8) * TURN / n / 4
    square = np.interp(way, (0, way[-1]), np.square(speeds))
    for share, often in ripple:
        square = square + 2e4 * share * np.sin(often * direction * way + random.uniform(0, TURN))
    slow = 1 / np.sqrt(square)
    time = np.append(0, np.cumsum((slow[1:] + slow[:-1]) / 2 * np.diff(way)))
    at = (count + direction * table[direction * count % n]) * TURN / n
    return _run(np.interp(at, way, time), direction, jitter, random)


def swinging(
    table: Floats,
    turns: float,
    speeds: tuple[float, float],
    random: np.random.Generator,
    share: float,
    hertz: float,
    *,
    jitter: float = 0.05,
) -> Run:
    """Return a run that changes its speed (rad/s) evenly, and swings by a share of its first speed."""
    n, turn = len(table), TURN * hertz
    count = np.arange(int(turns * n))
    seconds = 2 * turns * TURN / sum(speeds)
    time = np.linspace(-0.01 * seconds, 1.05 * seconds, 4 * len(count))
    way = speeds[0] * time + (speeds[1] - speeds[0]) / seconds / 2 * time**2
    phase = random.uniform(0, TURN)
    way += share * speeds[0] / turn * (np.cos(phase) - np.cos(turn * time + phase))
    return _run(np.interp((count + table[count % n]) * TURN / n, way, time), 1, jitter, random)


def _run(time: Floats, direction: int, jitter: float, random: np.random.Generator) -> Run:
    gap = np.diff(time, prepend=2 * time[0] - time[1], append=2 * time[-1] - time[-2])
    shift = np.clip(jitter * random.standard_normal(len(time)), -0.49, 0.49)
    return Run(time + shift * np.minimum(gap[:-1], gap[1:]), 0, direction, 0)


def off(found: Fit, table: Floats) -> float:
    """Return by how much the displacements of a fit are wrong, in counts RMS."""
    return float(np.std(found.displacement - table))
