"""`replay` prints these lines of a capture: what it took, how fast the shaft was, and what cannot be right."""

import numpy as np

from tachometry.sim.signals.flow import Flow
from tachometry.sim.signals.recording import Recording
from tachometry.sim.signals.source import Source
from tachometry.sim.studies.simulation import Axis
from tachometry.spec.language.port import MISSED
from tachometry.spec.language.units import plural

_Row = tuple[str, str]


def capture_rows(axis: Axis) -> list[_Row]:
    """Return rows of the table: the channels that were taken, how long they last, and the speed that the core shows."""
    if (source := axis.recording.source) is None:
        return []
    lines, captured, *notes = source_rows(source)
    rows = [lines, captured]
    tally, unit = axis.tally, axis.spec.scale.shown_unit
    if tally.n_held:
        least, mean, most = (unit.of(speed) for speed in (tally.least, tally.total / tally.n_held, tally.most))
        rows.append(("speed", f"min {least:.6g}, mean {mean:.6g}, max {most:.6g} {unit.name}, as held at every tick"))
    return rows + notes


def source_rows(source: Source) -> list[_Row]:
    """Return rows of the table: the channels that were taken, how long they last, and how they were read."""
    return [
        ("lines", channels(source)),
        ("captured", f"{source.duration:.6g} s, {plural(source.n_changes, 'change')} of the lines"),
        *(("note", note) for note in source.notes),
    ]


def channels(source: Source) -> str:
    """Return which channel each line was taken from."""
    return ", ".join(f"{line} from {name}" for line, name in source.lines.items())


def index_distance(axis: Axis) -> str:
    """Return how far apart the index pulses are, or nothing if there are fewer than two."""
    distances = np.abs(axis.index_distances)
    if not len(distances):
        return ""
    least, most = int(distances.min()), int(distances.max())
    return f", {least if least == most else f'{least} to {most}'} counts apart"


def axis_warnings(axis: Axis) -> list[str]:
    """Return what of the capture of an axis contradicts itself or the options."""
    return capture_warnings(axis.recording) + _index(axis) + _index_place(axis) + _index_missed(axis)


def capture_warnings(recording: Recording | Flow) -> list[str]:
    """Return what of a capture contradicts itself."""
    warnings = _still(recording.source)
    if together := recording.n_together:
        warnings.append(
            f"at {plural(together, 'instant')} of the capture both lines change: it was sampled more slowly than the "
            "edges came, or the encoder is at fault; counts and velocity are wrong there"
        )
    return warnings


def _still(source: Source | None) -> list[str]:
    """Return which lines never change, and which channels do instead."""
    if source is None or not source.still:
        return []
    names = [source.lines[line] for line in source.still]
    options = " and ".join(f"--{line.replace('_', '-')}" for line in source.still)
    moving = source.moving
    do = f"; {' and '.join(moving)} {'does' if len(moving) == 1 else 'do'}: see {options}" if moving else ""
    return [f"{' and '.join(names)} never {'changes' if len(names) == 1 else 'change'}{do}"]


def _index(axis: Axis) -> list[str]:
    """Return whether the index comes at another distance than once a turn; to and fro over one index is no distance."""
    encoder, distances = axis.spec.encoder, np.abs(axis.index_distances)
    turn, lines = encoder.encoder_counts, encoder.pulses_per_rev
    distances = distances[distances > min(encoder.decoding, turn / 2)]
    if not len(distances) or encoder.teeth or abs((apart := float(np.median(distances))) - turn) <= max(1, turn / 100):
        return []
    fits = (
        f", and --ppr {apart / encoder.decoding:.0f} if it comes once a turn" if apart % encoder.decoding == 0 else ""
    )
    return [
        f"indices are {apart:.15g} counts apart; --ppr {lines} with x{encoder.decoding} says {turn}{fits}: "
        "if it is wrong, speeds are wrong by as much"
    ]


def _index_place(axis: Axis) -> list[str]:
    """Return whether the index is at other counts forward than backward, as where it is wide or low."""
    near = np.abs(axis.index_distances)
    near = near[(near > 0) & (near <= 2 * axis.spec.encoder.decoding) & (near < axis.spec.encoder.encoder_counts / 2)]
    if not len(near) or (lasts := axis.index_lasts) is None:
        return []
    if axis.spec.front_end.index_state is not None:
        return [
            f"to and fro, the index is found {int(near.max())} counts apart: z is high for longer than a period of A, "
            "and meets its state twice; find it in one direction alone"
        ]
    high = lasts.sum() / axis.recording.lasting.sum()
    why = (
        f"z is high {100 * high:.3g} % of the time, so it may be low at the index, and must be inverted"
        if high > 0.5
        else "z may be high for longer than a quarter of a period of A, or not be in step with A and B"
    )
    return [f"to and fro, the index is found {int(near.max())} counts apart, as it is taken where z rises: {why}"]


def _index_missed(axis: Axis) -> list[str]:
    """Return whether Z comes without the state in which the index is taken, and in which state it mostly is."""
    if not (times := axis.tally.rows[MISSED]) or (lasts := axis.index_lasts) is None:
        return []
    usual = f"A={lasts.argmax() & 1},B={lasts.argmax() >> 1}"
    return [
        f"{plural(times, 'time')} z came and went without the state in which the index is taken; "
        f"it is mostly high in {usual}: type --index-at {usual}, or edge"
    ]
