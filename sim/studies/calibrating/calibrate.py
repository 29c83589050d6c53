"""Captures of a turning shaft become the map of its disc, or reasons why they do not."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tachometry.sim.signals.arrays import Floats
from tachometry.sim.signals.progress import Bar, at_work, no_bar
from tachometry.sim.signals.recording import Recording
from tachometry.sim.studies.calibrating.fit import Fit, Waves, fit_disc, harmonics, mean_by_edge, residues, rms
from tachometry.sim.studies.calibrating.runs import LEAST_TURNS, Run, runs_of, start_of
from tachometry.spec import TachometerSpec
from tachometry.spec.core.disc import Disc

_ALIKE = 3.0  # of the errors of two maps, within which they are the same
_FEWEST = 6  # counts a turn
_DIGITS = 5  # of a displacement in counts
_SHARP = 1.25  # of the best place to the second best, from which on it is the right one
_LOW = 8  # waves in a turn that many places share
_DIFFERS = 1.3  # of the difference of two successive turns to the usual one, from which on counts were lost


@dataclass(frozen=True)
class Calibration:
    """The map of a disc, and what is known of the captures that it comes from."""

    disc: Disc
    fit: Fit
    waves: Waves  # of the disc, in counts
    slips: int  # see `runs_of`
    reasons: list[str]  # why the map must not be used
    change: float | None  # counts RMS, since another map of the same encoder
    # counts by which DISC_TURN aligns a core without an index, reset as the first capture began, with another map
    turn: int | None


def calibrate(
    captures: Iterable[tuple[str, Recording]],
    spec: TachometerSpec,
    *,
    one_speed: bool = False,
    against: Disc | None = None,
    bar: Bar = no_bar,
) -> Calibration:
    """Measure the disc of an encoder from captures, by name, of a shaft that coasts down.

    The encoder must be that of the map `against`; without an index, edges are counted as there. With `one_speed`,
    ripple of the torque may be in the map. It raises ValueError if no run is long enough, or one does not show how the
    disc lies in it.
    """
    encoder, n = spec.encoder, spec.encoder.encoder_counts
    if n < _FEWEST:
        raise ValueError(f"--ppr must make at least {_FEWEST} counts a turn, not {n}")
    runs, slips, place, start = _read(captures, spec)
    if not (runs := runs if spec.index else turned(runs, n)):
        turns = f"{LEAST_TURNS} turns of {n} counts in one direction"
        raise ValueError(f"captures must have more than {turns} in which no count is lost")
    fit = fit_disc(runs, n, one_speed=one_speed, bar=bar)
    (least, greatest), table = (round(speed, 3) for speed in fit.speeds), _rounded(fit.displacement)
    known = (n, table, encoder.decoding, place, round(fit.error, _DIGITS), round(fit.jitter, _DIGITS))
    disc = Disc(*known, (least, greatest), fit.turns, fit.ripple is None, encoder.reverse)
    change, reasons, turn = None, fit.reasons, None
    if against is not None:
        disc, shift, change, wrong = _compared(disc, against)
        turned_by = {name: np.roll(getattr(fit, name), shift) for name in ("displacement", "seen", "unseen")}
        fit, reasons = replace(fit, **turned_by), reasons + wrong
        if spec.index is None and not wrong and runs[0].origin == 0:
            turn = (start + shift) % n
    return Calibration(disc, fit, harmonics(np.array(disc.displacement), _LOW), slips, reasons, change, turn)


def _read(captures: Iterable[tuple[str, Recording]], spec: TachometerSpec) -> tuple[list[Run], int, int | None, int]:
    """Return the runs of all captures, how often counts were lost, the place of the index, and the first position."""
    runs: list[Run] = []
    place, slips, start = None, 0, 0
    with at_work("reading captures"):
        for number, (name, recording) in enumerate(captures):
            try:
                more, lost, place = runs_of(recording, spec, number)
            except ValueError as error:
                raise ValueError(f"{name} {error}") from error
            runs, slips, start = runs + more, slips + lost, start if number else start_of(recording, spec)
    return runs, slips, place, start


def _rounded(table: Floats) -> tuple[float, ...]:
    return tuple(np.round(table, _DIGITS).tolist())


def _compared(disc: Disc, other: Disc) -> tuple[Disc, int, float | None, list[str]]:
    """Return the map, by how many edges it is turned to be counted as another one, which it is without an index, its
    change since that, and why they are not of one encoder.
    """
    if (disc.counts_per_rev, disc.decoding) != (other.counts_per_rev, other.decoding):
        counts = f"{other.counts_per_rev} counts a turn with x{other.decoding} decoding"
        return disc, 0, None, [f"--against is the map of another encoder: it has {counts}"]
    table, known, by = np.array(disc.displacement), np.array(other.displacement), 0
    shift, sharp = place_of(known, table)
    if None in (disc.index_place, other.index_place) and sharp >= _SHARP:
        table = np.roll(table, shift)
        if disc.index_place is None:
            disc, by = replace(disc, index_place=other.index_place, displacement=_rounded(table)), shift
        shift = 0
    change = rms(table - known)
    if (sharp >= _SHARP and shift == 0) or change <= _ALIKE * np.hypot(disc.error, other.error):
        return disc, by, change, []
    if sharp >= _SHARP:
        return disc, 0, None, [f"the index is {shift:+} counts from where it is in --against"]
    return disc, 0, None, [f"this is another encoder than that of --against (sharpness {sharp:.2f} of {_SHARP})"]


def place_of(table: Floats, other: Floats) -> tuple[int, float]:
    """Return by how many edges `other` must be moved forward to lie on `table`, and how much better that is than any
    other place: 0 where tables without a common pattern could be as alike by chance.
    """
    n = len(table)
    spectra = np.fft.rfft([table, other])
    spectra[:, : 1 + (_LOW if n > 8 * _LOW else 0)] = 0
    size = np.prod(np.linalg.norm(np.fft.irfft(spectra, n), axis=1))
    match = np.fft.irfft(spectra[0] * np.conj(spectra[1]), n)
    best = int(np.argmax(match))
    second = float(np.delete(match, best).max(initial=0.0))
    alike = match[best] > 2 * np.sqrt(2 * np.log(n) / n) * size
    return (best + n // 2) % n - n // 2, float(match[best]) / second if alike and second > 0 else 0.0


def turned(runs: Sequence[Run], n: int) -> list[Run]:
    """Return the runs counted from one edge 0, that of the first, by the pattern of the disc.

    Runs are cut where counts were lost: where a turn differs from the next more than usual. It raises ValueError if the
    pattern does not show how the disc lies in a run.
    """
    pieces = [piece for run in runs for piece in _without_slips(run, n)]
    moved: dict[int, int] = {piece.origin: 0 for piece in pieces[:1]}
    tables = [mean_by_edge(*residues(piece, n, np.zeros(n), np.zeros(n), 1.0)[:2], n) for piece in pieces]
    for piece, table in zip(pieces, tables, strict=True):
        shift, sharp = place_of(tables[0], table)
        if sharp >= _SHARP:
            moved[piece.origin] = shift
        elif piece.origin not in moved:
            raise ValueError(
                f"captures must have an index (--index), or be one alone in which no count is lost: the lines do not "
                f"show how the disc lies in them (sharpness {sharp:.2f}, and at least {_SHARP} is needed)"
            )
    return [replace(piece, first=piece.first + moved[piece.origin]) for piece in pieces]


def _without_slips(run: Run, n: int) -> Iterator[Run]:
    """Yield the parts of a run between turns that differ; the first has its origin, all others have new ones."""
    edge, displacement, _ = residues(run, n, np.zeros(n), np.zeros(n), 1.0)
    start = abs(int(edge[0]) - run.first)
    turns = displacement[: len(displacement) // n * n].reshape(-1, n)
    change = np.sqrt(np.mean(np.diff(turns, axis=0) ** 2, axis=1))
    most = max(_DIFFERS, 1 + 5 / np.sqrt(2 * n))  # of few edges the usual difference varies more
    differs = change > most * (np.median(change) if len(change) else 0)
    spoilt = np.concatenate([[True], np.append(differs, False) | np.append(False, differs), [True]])
    for number, (begin, end) in enumerate(np.flatnonzero(np.diff(spoilt)).reshape(-1, 2).tolist()):
        first = start + begin * n if begin else 0
        last = start + end * n if end < len(turns) else len(run.time)
        if last - first > LEAST_TURNS * n:
            moved = run.first + run.direction * first
            yield Run(run.time[first:last], moved, run.direction, run.origin + (number << 32) if begin else run.origin)
