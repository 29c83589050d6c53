"""Heat maps show a sweep over two axes, one panel per method."""

import re
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.plots.style import save_figure

_ABREAST = 3  # panels
# Inches.
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM, _ACROSS, _DOWN, _BAR = 3.2, 2.4, 1.0, 1.1, 0.75, 0.85, 0.25, 0.4, 0.15
_MOST_LABELS = 12
_COLOURS = "viridis_r"
_WITH_UNIT = re.compile(r"[-+.\de]+\s*([a-zA-Z/]+)")


def save_heat_maps(
    path: Path,
    points: Sequence[tuple[str, Mapping[str, str], float | None]],
    axes: Mapping[str, Sequence[str]],
    what: str,
    log: bool,
) -> None:
    """Draw heat maps into a file whose kind its suffix tells: `.png` or `.pdf`; equal ones give equal files.

    A field is the median over all points there. A method without one of the axes has the same value all along it.

    - `points`: Method, values of the axes that this method has, and the value to show, of each.
    - `axes`: One axis or two, with their values: across, and upwards.
    """
    by_method: dict[str, list[tuple[Mapping[str, str], float | None]]] = {}
    for method, where, value in points:
        by_method.setdefault(method, []).append((where, value))
    fields = {name: _field(mine, axes) for name, mine in by_method.items()}
    save_figure(path, lambda: _draw(fields, axes, what, log))


def _field(points: Sequence[tuple[Mapping[str, str], float | None]], axes: Mapping[str, Sequence[str]]) -> FloatArray:
    """Return medians, one for each pair of values, row by row upwards; NaN where there is none."""
    place = {name: {value: k for k, value in enumerate(values)} for name, values in axes.items()}
    there: dict[tuple[int, ...], list[float]] = {}
    for where, value in points:
        if value is None:
            continue
        ranges = [[place[name][where[name]]] if name in where else range(len(axes[name])) for name in axes]
        for cell in product(*ranges):
            there.setdefault(tuple(cell), []).append(value)
    field = np.full([len(values) for values in axes.values()], np.nan)
    for cell, values in there.items():
        field[cell] = np.median(values)
    return np.atleast_2d(field.T)


def _draw(fields: Mapping[str, FloatArray], axes: Mapping[str, Sequence[str]], what: str, log: bool) -> Figure:
    n_across = min(len(fields), _ABREAST)
    n_down = -(-len(fields) // n_across)
    width = _LEFT + _RIGHT + n_across * _WIDTH + (n_across - 1) * _ACROSS
    height = _TOP + _BOTTOM + n_down * _HEIGHT + (n_down - 1) * _DOWN
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    norm = _norm(list(fields.values()), log)
    for k, (name, field) in enumerate(fields.items()):
        left = _LEFT + k % n_across * (_WIDTH + _ACROSS)
        lower = height - _TOP - k // n_across * (_HEIGHT + _DOWN) - _HEIGHT
        place = (left / width, lower / height, _WIDTH / width, _HEIGHT / height)
        panel = figure.add_axes(place)
        panel.set_facecolor("0.85")
        panel.grid(False)
        panel.pcolormesh(np.ma.masked_invalid(field), norm=norm, cmap=_COLOURS)
        panel.set_title(name, fontsize=9, loc="left", pad=3)
        _label(panel, axes, lowest=k + n_across >= len(fields), leftmost=k % n_across == 0)
    bar = figure.add_axes(
        ((width - _RIGHT + 0.2) / width, _BOTTOM / height, _BAR / width, 1 - (_TOP + _BOTTOM) / height)
    )
    figure.colorbar(ScalarMappable(norm, _COLOURS), cax=bar)
    figure.suptitle(f"{what} over {' and '.join(axes)}", y=1 - 0.15 / height, fontsize=10)
    return figure


def _norm(fields: Sequence[FloatArray], log: bool) -> Normalize:
    every = np.concatenate([field.ravel() for field in fields])
    every = every[np.isfinite(every) & (every > 0 if log else True)]
    low, high = (float(every.min()), float(every.max())) if len(every) else (1.0, 1.0)
    if low == high:
        low, high = (low / 2, high * 2) if log else (low - 1, high + 1)
    return LogNorm(low, high, clip=True) if log else Normalize(low, high)


def _label(panel: Axes, axes: Mapping[str, Sequence[str]], lowest: bool, leftmost: bool) -> None:
    """Write values at the fields, as many as can be read, and names at the outer panels."""
    panel.tick_params(length=0, labelbottom=lowest, labelleft=leftmost, labelsize=7)
    across, *rest = ((_name(name, values), _numbers(values)) for name, values in axes.items())
    name, values = across
    step = -(-len(values) // _MOST_LABELS)
    panel.set_xticks(np.arange(0, len(values), step) + 0.5, values[::step], rotation=90)
    panel.set_xlabel(name if lowest else "")
    name, values = rest[0] if rest else ("", [""])
    step = -(-len(values) // _MOST_LABELS)
    panel.set_yticks(np.arange(0, len(values), step) + 0.5, values[::step])
    panel.set_ylabel(name if leftmost else "")


def _unit(values: Sequence[str]) -> str:
    """Return the unit of all values; none if they differ in it."""
    units = {match[1] if (match := _WITH_UNIT.fullmatch(value)) else "" for value in values}
    return units.pop() if len(units) == 1 else ""


def _name(name: str, values: Sequence[str]) -> str:
    return f"{name} ({unit})" if (unit := _unit(values)) else name


def _numbers(values: Sequence[str]) -> list[str]:
    return [value.removesuffix(_unit(values)) for value in values]
