"""The figure of a comparison shows all velocities, and the error of each; the least error is on a yellow ground."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tachometry.sim.plots.style import COLOURS, FloatArray, columns, in_words, place_panels, save_figure
from tachometry.sim.studies.comparing.compare import Curve, Instants, Score, TrueSpeed
from tachometry.spec import TachometerSpec


def save_comparison(
    path: Path,
    spec: TachometerSpec,
    curves: list[Curve],
    scores: list[Score],
    instants: Instants,
    true_speed: TrueSpeed | None,
) -> None:
    """Draw a comparison into a `.png` or `.pdf`, each curve at its own instants (s); equal ones give equal files."""
    save_figure(path, lambda: _draw(spec, curves, scores, instants, true_speed))


def _draw_error(
    axes: Axes, at: NDArray[np.float64], error: NDArray[np.float64], colour: str, words: tuple[str, str], least: bool
) -> None:
    """Draw the error of a method, with words at the left and at the right; the least one has a colour behind it."""
    kept = columns(at, error)
    axes.axhline(0, color="0.6", linewidth=0.7)
    axes.plot(at[kept], error[kept], color=colour, linewidth=0.6)
    if least:
        axes.set_facecolor("#fff4c2")
    left, right = words
    axes.text(0.005, 0.84, left, transform=axes.transAxes, fontsize=8, color=colour, weight="bold")
    shown = f"least error: {right}" if least else right
    axes.text(0.995, 0.84, shown, transform=axes.transAxes, ha="right", fontsize=8, weight="bold")


def _draw(
    spec: TachometerSpec, curves: list[Curve], scores: list[Score], instants: Instants, true_speed: TrueSpeed | None
) -> Figure:
    heights = {"velocity": 2.6} | ({curve.name: 0.55 for curve in curves} if true_speed else {})
    figure, panels = place_panels(spec, heights, "Comparison")
    unit = spec.scale.shown_unit
    values = [unit.of(curve.estimate.at(at)) for curve, at in zip(curves, instants, strict=True)]
    # What goes up and down most is drawn behind, as it would bury the others.
    calmest = sorted(range(len(curves)), key=lambda place: float(np.sum(np.abs(np.diff(values[place])))))
    errors = [_error(spec, *of, true_speed) for of in zip(curves, scores, instants, strict=True)] if true_speed else []
    least = min((rms for _, _, rms, _ in errors), default=None)
    name = unit.name if curves[0].angle is None else "electrical degrees at the instant of use"
    for place, (curve, colour) in enumerate(zip(curves, COLOURS * len(curves), strict=False)):
        at, held = instants[place], values[place]
        kept = columns(at, held)
        line: dict[str, Any] = {"linewidth": 0.7, "drawstyle": "steps-post", "label": _words(curve).partition(":")[0]}
        depth = 2 - calmest.index(place) / 100
        panels["velocity"].plot(at[kept], held[kept], color=colour, zorder=depth, **line)
        if true_speed is None:
            continue
        at, error, rms, _ = errors[place]
        words = (_words(curve), f"RMS {rms:.3g} {name.partition(' at')[0]}")
        _draw_error(panels[curve.name], at, error, colour, words, rms == least)
    first = instants[0]
    if true_speed is not None:
        # A broad band, from which a curve that is wrong stands out.
        band: dict[str, Any] = {"color": "0.82", "linewidth": 5, "zorder": 1.5, "solid_capstyle": "butt"}
        truth = unit.of(true_speed(first))
        kept = columns(first, truth)
        panels["velocity"].plot(first[kept], truth[kept], label="shaft (true)", **band)
        # Most of all errors set the scale; what leaves the panel is a spike.
        reach = np.percentile([most for *_, most in errors], 60)
        reach *= 1.1 if curves[0].angle is None else 1.7  # which leaves room for the words
        for curve in curves:
            panels[curve.name].set_ylim(-reach, reach)
    panels["velocity"].set_ylabel(f"velocity ({unit.name})")
    n_columns = len(curves) // 2 + 1  # two lines, which fit below the title
    panels["velocity"].legend(
        loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.1, ncols=n_columns, columnspacing=1.2, fontsize=7
    )
    last = list(panels.values())[-1]
    below = f"; below the velocities the errors in {name}, at one scale" if true_speed else ""
    last.set_xlabel(f"time (s){below}")
    last.set_xlim(first[0], first[-1])
    return figure


def _error(
    spec: TachometerSpec, curve: Curve, result: Score, at: FloatArray, true_speed: TrueSpeed
) -> tuple[FloatArray, FloatArray, float, float]:
    """Return times (s), errors of the angle there or else of the velocity, their RMS, and the greatest."""
    if curve.angle is not None:
        return *curve.angle, result.angle_rms_deg or 0.0, result.angle_max_deg or 0.0
    unit = spec.scale.shown_unit
    return at, unit.of(curve.estimate.at(at) - true_speed(at)), unit.of(result.rms or 0.0), unit.of(result.max or 0.0)


def _words(curve: Curve) -> str:
    """Return what a curve is: a method of a core, or what others use."""
    words = in_words(curve.name)
    return curve.what if words == curve.name else words
