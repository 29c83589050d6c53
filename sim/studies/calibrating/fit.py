"""The fit: displacements of the edges, free of the ripple of the torque, and how far they can be trusted."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.arrays import Bools, Floats, Ints
from tachometry.sim.signals.progress import Bar, no_bar
from tachometry.sim.studies.calibrating.runs import Run

Waves = NDArray[np.complex128]  # amplitudes and phases of what comes 1, 2, … times in a turn

_ROUNDS = 5
_RIPPLE = 12  # waves of the torque in a turn
_LOW = 8  # waves in a turn that are looked at by themselves
_REPEATS = 4  # medians of the square of a turn, above which it is left out
_SPREAD = 1.35  # of the speeds, from which on ripple is told from the disc
# What a good fit has: turns, error in counts, error by what jitter and swing explain, and turns left out.
_LEAST, _TRUST, _NOISE, _LEFT_OUT = 6, 0.02, 2.5, 0.2


@dataclass(frozen=True)
class Fit:
    """The displacements of all edges, and what is known of them."""

    displacement: Floats  # counts, shape (n,)
    ripple: Waves | None  # of the torque, in counts at the greatest speed; None where the speeds are too alike
    jitter: float  # counts RMS, from count to count
    swing: float  # counts RMS, in addition to the jitter, and slower
    error: float  # counts RMS, by the difference of the tables of both halves of the turns
    left_out: float  # share of the counts in turns that do not repeat
    turns: float  # that were used
    speeds: tuple[float, float]  # rad/s
    seen: Floats  # displacements of every other turn
    unseen: Floats  # displacements of the turns between
    reasons: list[str]  # why the fit must not be used


class _Samples(NamedTuple):
    """Counts with 3/2 turns on either side."""

    edge: Ints  # from 0 to n - 1
    displacement: Floats  # counts
    slow: Floats  # (greatest speed / speed)²
    lag: Floats  # of the ripple, for wave 1: 3 times the change of the logarithm of the speed in a radian
    turn: Ints  # number of the turn

    def of(self, kept: Bools) -> "_Samples":
        """Return some of the counts."""
        edge, displacement, slow, lag, turn = self
        return _Samples(edge[kept], displacement[kept], slow[kept], lag[kept], turn[kept])

    def of_turns(self, value: Floats) -> Floats:
        """Return the mean of a value over the turn of each count."""
        return means(self.turn, value, int(self.turn[-1]) + 1)[self.turn]


def means(place: Ints, value: Floats, n: int) -> Floats:
    """Return the mean of values in each of n places, 0 where there is none."""
    mean: Floats = np.bincount(place, value, n) / np.maximum(np.bincount(place, minlength=n), 1)
    return mean


def mean_by_edge(edge: Ints, displacement: Floats, n: int) -> Floats:
    """Return the mean displacement of each edge, less that of all."""
    table = means(edge % n, displacement, n)
    return table - table.mean()


def harmonics(table: Floats, most: int) -> Waves:
    """Return the waves 1 to `most` of a table, at most those below two edges a wave."""
    found: Waves = np.fft.rfft(table)[1 : min(most, (len(table) - 1) // 2) + 1] * (2 / len(table))
    return found


def wave(waves: Waves, n: int) -> Floats:
    """Return the table of n edges that has these waves."""
    spectrum = np.concatenate([[0], waves * (n / 2), np.zeros(n // 2 - len(waves))])
    return np.fft.irfft(spectrum, n)


def rms(values: Floats) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def _low(table: Floats) -> float:
    """Return the RMS of what comes seldom in a turn."""
    most = max(min(_LOW, len(table) // 8), 3)
    return float(np.sqrt(np.sum(np.abs(harmonics(table, most)) ** 2) / 2))


def _slope(value: Floats, n: int) -> Floats:
    """Return the change of a value in a count, over a turn about each count, or over less at the ends."""
    at = np.arange(len(value))
    before, after = np.maximum(at - n // 2, 0), np.minimum(at + n - n // 2, len(value) - 1)
    return (value[after] - value[before]) / (after - before)


def shaft_time(time: Floats, n: int) -> tuple[Floats, int]:
    """Return when the shaft itself is at each count that has 3/2 turns of n on either side, and the first of these.

    The mean over a turn knows nothing of the disc; less 1/24 of its second difference it is exact for a parabola.
    """
    total = np.concatenate([[0.0], np.cumsum(time - time[0])])
    mean = (total[n:] - total[:-n]) / n
    if n % 2 == 0:  # then both ends of the turn count by half
        mean = (mean[1:] + mean[:-1]) / 2
    centre = mean[n:-n]
    return time[0] + centre - (mean[: -2 * n] - 2 * centre + mean[2 * n :]) / 24, n + n // 2


def residues(run: Run, n: int, known: Floats, ripple: Floats, top: float) -> tuple[Ints, Floats, Floats]:
    """Return edges that have 3/2 turns on either side, their displacements in counts, and their speeds in counts/s.

    The times are freed of `known` displacements, and of the ripple at the speed `top`, before the shaft is looked for.
    """
    gap, edge = _slope(run.time, n), run.edge
    free = run.time - run.direction * gap * (known[edge % n] + ripple[edge % n] * (top * gap) ** 2)
    shaft, first = shaft_time(free, n)
    inside = slice(first, first + len(shaft))
    slow = np.gradient(shaft)
    if not (usual := float(np.median(slow))) > 0:
        raise ValueError("captures must have times that increase from edge to edge")
    speed = 1 / np.maximum(slow, usual / 1000)  # where the shaft begins to turn, the parabola may go backward
    return edge[inside], run.direction * (run.time[inside] - shaft) * speed, speed


def fit_disc(runs: Sequence[Run], n: int, *, one_speed: bool = False, bar: Bar = no_bar) -> Fit:
    """Fit one disc of n counts to runs of any speeds and directions, or of `one_speed` if that is accepted.

    Each round frees the times of what the rounds before have found of disc and ripple.
    """
    table, waves, top = np.zeros(n), np.zeros(0, dtype=np.complex128), 1.0
    with bar("fitting the disc", _ROUNDS, "rounds") as report:
        for done in range(1, _ROUNDS + 1):
            samples, speed = _samples(runs, n, table, wave(waves, n), top)
            top = float(speed.max())
            square = samples.of_turns(_left(samples, n) ** 2)
            kept = square <= _REPEATS * np.median(square[np.unique(samples.turn, return_index=True)[1]])
            samples = samples.of(kept)
            if told := bool(samples.slow.max() > _SPREAD**2 * samples.slow.min()):
                waves = _ripple(samples, n)
                samples = _freed(samples, waves, n)
            table = mean_by_edge(*samples[:2], n)
            report(done)
    least, greatest = top * 2 * np.pi / n / np.sqrt([samples.slow.max(), samples.slow.min()])
    speeds = (float(least), float(greatest))
    return _judged(samples, n, waves if told else None, speeds, float(1 - kept.mean()), one_speed)


def _left(samples: _Samples, n: int) -> Floats:
    """Return the displacements less those of their edges."""
    return samples.displacement - mean_by_edge(*samples[:2], n)[samples.edge]


def _samples(runs: Sequence[Run], n: int, table: Floats, ripple: Floats, top: float) -> tuple[_Samples, Floats]:
    """Return samples of all runs, and their speeds in counts/s."""
    parts, speeds, turns = [], [], 0
    for run in runs:
        edge, displacement, speed = residues(run, n, table, ripple, top)
        lag = 3 * run.direction * n / (2 * np.pi) * _slope(np.log(speed), n)
        turn = turns + np.abs(edge // n - edge[0] // n)
        turns = int(turn[-1]) + 1
        parts.append(_Samples(edge % n, displacement, speed, lag, turn))
        speeds.append(speed)
    speed = np.concatenate(speeds)
    samples = _Samples._make(np.concatenate(each) for each in zip(*parts, strict=True))
    return samples._replace(slow=(speed.max() / speed) ** 2), speed


def _ripple(samples: _Samples, n: int) -> Waves:
    """Return the waves of the ripple, by least squares over what the visits of each edge differ by among themselves.

    Ripple of a torque at a place displaces the edges by 1/speed², the disc does not. While the speed changes, wave h of
    the ripple lags by `lag`/h.
    """
    edge = samples.edge

    def differing(value: Floats) -> Floats:
        return value - means(edge, value, n)[edge]

    def total(value: Floats) -> Floats:
        return np.bincount(edge, value, n)[:, None].astype(np.float64)

    slow, lag = differing(samples.slow), differing(samples.slow * samples.lag)
    found = differing(samples.displacement)
    number = np.arange(1, min(_RIPPLE, (n - 1) // 2) + 1)
    angle = 2 * np.pi / n * np.outer(np.arange(n), number)
    of_slow = np.hstack([np.cos(angle), -np.sin(angle)])
    of_lag = np.hstack([np.sin(angle) / number, np.cos(angle) / number])
    cross = of_slow.T @ (total(slow * lag) * of_lag)
    square = of_slow.T @ (total(slow**2) * of_slow) + cross + cross.T + of_lag.T @ (total(lag**2) * of_lag)
    right = of_slow.T @ total(slow * found) + of_lag.T @ total(lag * found)
    real, imaginary = np.linalg.lstsq(square, right[:, 0], rcond=None)[0].reshape(2, -1)
    waves: Waves = real + 1j * imaginary
    return waves


def _freed(samples: _Samples, waves: Waves, n: int) -> _Samples:
    """Return the samples without the ripple of the torque."""
    lagging = wave(-1j * waves / np.arange(1, len(waves) + 1), n)[samples.edge]
    part = samples.slow * (wave(waves, n)[samples.edge] + samples.lag * lagging)
    return samples._replace(displacement=samples.displacement - part)


def _judged(
    samples: _Samples, n: int, ripple: Waves | None, speeds: tuple[float, float], left_out: float, one_speed: bool
) -> Fit:
    """Return the displacements of the last round, and whether what is left of them in parts of the samples is good."""

    def table(part: Bools) -> Floats:
        return mean_by_edge(samples.edge[part], samples.displacement[part], n)

    left, visits, number = _left(samples, n), np.bincount(samples.edge, minlength=n), samples.turn
    late, odd = number > np.median(number), number % 2 == 1
    difference, turns = table(late) - table(~late), float(np.median(visits))
    error, low = (rms(difference) / 2 if visits.min() > 1 else float(n)), _low(difference) / 2
    jitter = float(np.std(np.diff(left)) / np.sqrt(2))
    swing = float(np.sqrt(max(left.var() - jitter**2, 0)))
    reasons = {
        f"{int(turns)} whole turns are used, and at least {_LEAST} are needed": turns < _LEAST,
        f"the halves of the turns differ: the map is off by {error:.3f} counts, its slow waves by {low:.4f}, and at "
        f"most {_TRUST} and {_TRUST / 5:g} are good": (
            error > max(_TRUST, _NOISE * left.std() / np.sqrt(max(turns, 1))) or low > _TRUST / 5
        ),
        f"the speed swings by {swing:.2f} counts, and at most {5 * _TRUST:g} are good: let the shaft coast, "
        "uncoupled": swing > 5 * _TRUST,
        f"{100 * left_out:.0f} % of the turns do not repeat, or slow by more than 4 % a turn, and at most "
        f"{100 * _LEFT_OUT:.0f} % are good": left_out > _LEFT_OUT,
        f"there is one speed, as the greatest is at most {_SPREAD} times the least: ripple of the torque would be "
        "taken for the disc: let the shaft coast, or type --one-speed": ripple is None and not one_speed,
    }
    if ripple is not None:
        slow, slowest = samples.slow, float(samples.slow.max())
        misfit, unsure = _misfit(samples, left, n), np.abs(ripple).max() * (slowest - 1)
        middle = np.mean(np.abs(slow - (slowest + 1) / 2) < (slowest - 1) / 4)  # of the turns, between the speeds
        reasons |= {
            f"slow waves of the disc differ by {misfit:.3f} counts from speed to speed, and at most {_TRUST / 2:g} are "
            "good: something swings in step with the turn": misfit > _TRUST / 2,
            f"there are two speeds, between which the disc differs by {unsure:.3f} counts: only a third speed tells "
            "ripple of the torque from a swing: let the shaft coast": middle < 0.1 and unsure > _TRUST,
        }
    found = (max(error, low), left_out, turns, speeds, table(~odd), table(odd))
    holding = [reason for reason, holds in reasons.items() if holds]
    return Fit(mean_by_edge(*samples[:2], n), ripple, jitter, swing, *found, holding)


def _misfit(samples: _Samples, left: Floats, n: int) -> float:
    """Return the greatest RMS of slow waves that are left in a quarter of the turns, by their speed."""
    slow = samples.of_turns(samples.slow)
    part = np.digitize(slow, np.quantile(slow, (0.25, 0.5, 0.75)))
    parts = [part == number for number in range(4) if np.count_nonzero(part == number) > 2 * n]
    return max((_low(mean_by_edge(samples.edge[each], left[each], n)) for each in parts), default=0.0)
