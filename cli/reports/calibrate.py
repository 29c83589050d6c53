"""`calibrate` prints these lines: the faults of a disc as a service engineer names them."""

from collections.abc import Iterator

import numpy as np

from tachometry.cli.reports.terminal import print_rows
from tachometry.sim.studies.calibrating.calibrate import Calibration
from tachometry.spec import TachometerSpec
from tachometry.spec.language.units import plural

_RADIUS_MM = 10


def print_calibration(found: Calibration, spec: TachometerSpec) -> None:
    """Print the faults of the disc, and how far they are certain."""
    print_rows(calibration_rows(found, spec))


def calibration_rows(found: Calibration, spec: TachometerSpec) -> list[tuple[str, str]]:
    """Return the lines of the report, names and values."""
    fit, n, table = found.fit, found.disc.counts_per_rev, np.array(found.disc.displacement)
    arc, first, waves = 360 * 60 / n, found.waves[:1].sum(), np.abs(found.waves)
    worst = int(np.argmax(np.abs(table)))
    rows = [
        ("counts per turn", f"{n}; one is {arc:.4g} arc-minutes (')"),
        (
            "off centre",
            f"{abs(first):.4f} counts, {abs(first) * arc:.3g}', {abs(first) * 2e3 * np.pi / n * _RADIUS_MM:.3g} um for "
            f"each {_RADIUS_MM} mm of radius; edges are farthest forward at {-np.angle(first, deg=True) % 360:.0f}°",
        ),
        ("waves in a turn", f"1 to 6: {' '.join(f'{wave:.4f}' for wave in waves[:6])} counts"),
    ]
    if spec.encoder.sensor == "quadrature" and spec.encoder.decoding == 4:
        b_falls, a_rises, b_rises, a_falls = 45 * table.reshape(-1, 4).mean(axis=0)
        phase, duty = b_falls + b_rises - a_rises - a_falls, b_falls - b_rises + a_falls - a_rises
        rows.append(("phase and duty error", f"{phase:+.2f} and {duty:+.2f} degrees (electrical)"))
    ripple = "unknown, as there is one speed: it is in the map"
    if fit.ripple is not None:
        most = int(np.argmax(np.abs(fit.ripple)))
        ripple = f"{abs(fit.ripple[most]):.3f} counts at the greatest speed, {most + 1} a turn; not in the map"
    indexed = found.disc.index_place is not None
    text = "edges are counted from it" if indexed else "none: edge 0 is any edge, and a core must be aligned"
    gains = np.std(fit.unseen - fit.seen) < np.std(fit.unseen)
    verdict = "the map can be used" if gains else "the disc is better than the map: there is nothing to gain"
    slips = "both lines changed" if spec.index is None else "counts were lost in"
    rows += [
        ("worst edge", f"{worst}: {table[worst]:+.3f} counts, {table[worst] * arc:+.3g}'"),
        ("all edges", f"{np.std(table):.4f} counts RMS, {np.std(table) * arc:.3g}'"),
        ("jitter left", f"{fit.jitter:.4f} counts RMS, and {fit.swing:.4f} of swings of the speed"),
        ("turns", f"{fit.turns:.0f} used, {100 * fit.left_out:.0f} % left out, as they do not repeat"),
        ("speeds", f"{fit.speeds[0]:.4g} to {fit.speeds[1]:.4g} rad/s"),
        ("ripple of the torque", ripple),
        ("index", text + (f"; {slips} {plural(found.slips, 'turn' if spec.index else 'time')}" * (found.slips > 0))),
        *_since(found),
        ("certain to", f"{fit.error:.4f} counts RMS, {fit.error * arc:.2g}', by the two halves of the turns"),
        ("verdict", "refused" if found.reasons else verdict),
    ]
    return rows


def _since(found: Calibration) -> Iterator[tuple[str, str]]:
    if found.change is not None:
        yield "since --against", f"{found.change:.4f} counts RMS of change"
    if found.turn is not None:
        yield "DISC_TURN", f"{found.turn}, if the core was reset as the capture began"
