"""The figure of a disc: the error of every edge about the turn, as it is and with the map."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from tachometry.sim.plots.style import ERROR, ESTIMATE, FloatArray, picture, save_figure
from tachometry.sim.studies.calibrating.calibrate import Calibration
from tachometry.sim.studies.calibrating.fit import harmonics, wave

_SMOOTH, _WAVES = 12, 8  # waves of the black line, and those that are shown as bars
_RADIUS_MM = 10
_FEW = 400  # edges, whose dots can be large


def save_disc(path: Path, found: Calibration) -> None:
    """Draw a disc into a `.png` or `.pdf`; equal ones give equal files."""
    save_figure(path, lambda: _draw(found))


def disc_picture(found: Calibration) -> bytes:
    """Return the same as the bytes of a `.png`."""
    return picture(lambda: _draw(found), ".png")


def _draw(found: Calibration) -> Figure:
    figure, fit, n = Figure(figsize=(11, 7.4)), found.fit, found.disc.counts_per_rev
    FigureCanvasAgg(figure)
    arc = 360 * 60 / n
    before, after = fit.unseen * arc, (fit.unseen - fit.seen) * arc
    reach = 1.15 * float(np.abs(before).max())
    panels = ((0.03, "Disc as it is", before, ERROR), (0.53, "Disc with the map", after, ESTIMATE))
    for left, title, error, colour in panels:
        axes = figure.add_axes((left, 0.27, 0.44, 0.58), projection="polar")
        assert isinstance(axes, PolarAxes)
        _draw_turn(axes, error, reach, colour, smooth=error is before and n > 4 * _SMOOTH)
        text = f"{title}: {np.std(error):.2g}' RMS, {np.abs(error).max():.2g}' at most"
        axes.set_title(text, fontsize=12, pad=10, color=colour, weight="bold")
    _draw_waves(figure.add_axes((0.08, 0.07, 0.39, 0.13)), before, after)
    zero = "edge 0" if found.disc.index_place is None else "the index"
    off = abs(found.waves[:1].sum())
    micrometres = off * 2e3 * np.pi / n * _RADIUS_MM
    lines = (
        "A dot is an edge, and its distance from the grey circle its error in arc-minutes (').",
        "Outside: passed too late by a shaft that turns forward, which is clockwise.",
        f"Inside: too early. 0° is {zero}. One count is {arc:.4g}'.",
        f"Off centre by {off * arc:.2g}', {micrometres:.2g} um for each {_RADIUS_MM} mm of radius.",
        "Blue: turns that the map has not seen.",
        f"In addition, an edge jitters by {fit.jitter * arc:.2g}' RMS from turn to turn.",
    )
    figure.text(0.55, 0.12, "\n".join(lines), fontsize=8.5, va="center", linespacing=1.6, color="0.2")
    speeds = f"{fit.speeds[0]:.3g} to {fit.speeds[1]:.3g} rad/s"
    title = f"Encoder of {n} counts a turn, {fit.turns:.0f} turns at {speeds}"
    figure.suptitle(f"{title}: map certain to {fit.error * arc:.2g}' RMS", fontsize=12, y=0.975)
    return figure


def _draw_turn(axes: PolarAxes, error: FloatArray, reach: float, colour: str, *, smooth: bool) -> None:
    """Draw errors (arc-minutes) about a circle."""
    n = len(error)
    angle = 2 * np.pi / n * np.arange(n + 1)
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.plot(np.linspace(0, 2 * np.pi, 361), np.zeros(361), color="0.3", linewidth=1.2)
    axes.plot(angle[:-1], error, ".", color=colour, markersize=2.2 if n > _FEW else 5, alpha=0.6, zorder=3)
    if smooth:
        line = wave(harmonics(error, _SMOOTH), n)
        axes.plot(angle, np.append(line, line[0]), color="black", linewidth=1.6, zorder=4, label="mean of neighbours")
        axes.legend(loc="lower left", bbox_to_anchor=(-0.06, -0.04))
    axes.set_ylim(-2.2 * reach, reach)
    ticks = [tick for tick in MaxNLocator(6).tick_values(-reach, reach) if abs(tick) <= reach]
    axes.set_yticks(ticks, [f"{tick:+g}'" if tick else "0" for tick in ticks], fontsize=8)
    for label in axes.get_yticklabels():
        label.set_bbox({"color": "white", "alpha": 0.75, "pad": 0.6})
    axes.set_rlabel_position(0)
    axes.spines["polar"].set_color("0.8")
    axes.set_xticks(np.pi / 4 * np.arange(8), [f"{45 * part}°" for part in range(8)], fontsize=8)


def _draw_waves(axes: Axes, before: FloatArray, after: FloatArray) -> None:
    """Draw how much of the errors comes 1, 2, … times in a turn."""
    heights = [np.abs(harmonics(error, _WAVES)) for error in (before, after)]
    number = np.arange(1, len(heights[0]) + 1)
    for shift, height, colour in zip((-0.2, 0.2), heights, (ERROR, ESTIMATE), strict=True):
        axes.bar(number + shift, height, width=0.38, color=colour)
    axes.set_xticks(number, ["1: off centre", *map(str, number[1:])], fontsize=8)
    axes.set_ylabel("amplitude (')", fontsize=8)
    axes.set_title("Slow errors, by how often they come in a turn", fontsize=9, loc="left")
    axes.grid(visible=False, axis="x")
