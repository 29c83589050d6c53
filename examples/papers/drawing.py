"""A `Result` is drawn as SVG and PNG, and written as CSV."""

import textwrap
from pathlib import Path

import matplotlib.ticker
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from papers.result import Curve, Panel, Result
from tachometry.sim.plots.style import columns, save_figure
from tachometry.sim.signals.files import write_csv

_COLOURS = ("#2a78c8", "#d9730d", "#2e6b3e", "#7b3fa0", "#b3261e", "#00838f")
GOLDEN = ", golden"  # at the end of a label: measured, in the colour of the line that it belongs to
# Inches.
_WIDTH, _LEFT, _RIGHT, _TOP, _BOTTOM, _GAP = 8.0, 0.85, 0.25, 0.75, 0.5, 0.7
_PANEL, _ONLY_PANEL = 1.9, 3.4


def write_figure(path: Path, result: Result) -> None:
    """Write a figure as `.svg`, `.png` or `.pdf`, as the suffix tells; equal results give equal files."""
    save_figure(path, lambda: draw(result))


def write_data(path: Path, result: Result) -> None:
    """Write what is drawn as a CSV: a row per point, with the panel (its title and y axis), the curve, x and y."""
    (x_label,) = {panel.x_label for panel in result.panels}
    rows = (
        (_plain(": ".join(filter(None, (panel.title, panel.y_label)))), _plain(curve.label), f"{x:.9g}", f"{y:.9g}")
        for panel in result.panels
        for curve in panel.curves
        for x, y in zip(curve.x.tolist(), curve.y.tolist(), strict=True)
    )
    write_csv(path, ("panel", "curve", _plain(x_label), "y"), rows)


def _plain(label: str) -> str:
    return label.replace("$", "").replace("{", "").replace("}", "")


def draw(result: Result) -> Figure:
    """Return the figure, panels one below the other; placed by hand, to be equal from run to run."""
    n = len(result.panels)
    panel_height = _PANEL if n > 1 else _ONLY_PANEL
    height = _TOP + _BOTTOM + n * panel_height + (n - 1) * _GAP
    figure = Figure(figsize=(_WIDTH, height))
    FigureCanvasAgg(figure)
    for number, panel in enumerate(result.panels):
        lower = height - _TOP - (number + 1) * panel_height - number * _GAP
        axes = figure.add_axes((_LEFT / _WIDTH, lower / height, 1 - (_LEFT + _RIGHT) / _WIDTH, panel_height / height))
        _panel(axes, panel)
    figure.suptitle(f"{result.source}: {result.title}", y=1 - 0.1 / height, fontsize=10)
    figure.text(0.5, 1 - 0.33 / height, textwrap.shorten(result.settings, 140), ha="center", va="top", fontsize=7.5)
    return figure


def reduced(x: np.ndarray, y: np.ndarray, log_x: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return no more points than a figure can show; x increases."""
    kept = columns(np.log(x) if log_x else x, y)
    return x[kept], y[kept]


def _panel(axes: Axes, panel: Panel) -> None:
    for level in panel.levels:
        axes.axhline(level, color="0.7", linewidth=0.7, linestyle=(0, (1, 3)), zorder=0.5)
    drawn = [curve.label for curve in panel.curves if curve.style != "reference"]
    colours = dict(zip(dict.fromkeys(label.removesuffix(GOLDEN) for label in drawn), _COLOURS, strict=False))
    for curve in panel.curves:
        _curve(axes, curve, colours.get(curve.label.removesuffix(GOLDEN), "0.55"))
    if "x" in panel.log:
        axes.set_xscale("log")
    if "y" in panel.log:
        axes.set_yscale("log")
    if panel.y_limits:
        axes.set_ylim(*panel.y_limits)
    if panel.whole:
        axes.yaxis.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True, nbins=6, min_n_ticks=1))
    for mark, x in panel.marks:
        axes.text(x, 0.94, mark, transform=axes.get_xaxis_transform(), ha="center", fontsize=7, style="italic")
    axes.margins(x=0.01)
    axes.set_xlabel(panel.x_label, labelpad=1)
    axes.set_ylabel(panel.y_label)
    axes.yaxis.set_label_coords(-0.075, 0.5)
    axes.set_title(panel.title, loc="left", fontsize=8.5)
    if len(panel.curves) > 1 or panel.curves[0].style == "reference":
        axes.legend(
            loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.2, ncols=10, columnspacing=1.2, fontsize=6.5
        )


def _curve(axes: Axes, curve: Curve, colour: str) -> None:
    if curve.style == "dots":
        axes.plot(curve.x, curve.y, ".", color=colour, markersize=3, label=curve.label)
    elif curve.style == "reference":
        axes.plot(curve.x, curve.y, color=colour, linewidth=0.9, label=curve.label, zorder=1.8)
    else:
        steps = "steps-post" if curve.style == "held" else "default"
        axes.plot(curve.x, curve.y, color=colour, drawstyle=steps, label=curve.label)
