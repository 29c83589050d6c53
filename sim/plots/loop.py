"""Figures of control loops show a run, or many of them over an axis."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tachometry.sim.plots.style import (
    COLOURS,
    ERROR,
    ESTIMATE,
    FloatArray,
    columns,
    in_words,
    place_panels,
    save_figure,
)
from tachometry.sim.studies.loops.control import Setting
from tachometry.sim.studies.sweeping.loops import FIGURES
from tachometry.spec.language.units import FREQUENCY, SPEED, TIME, read_nearest

Log = Mapping[str, FloatArray]

_HEIGHTS = {"speed": 3.0, "error": 1.7, "current": 1.7}
_MARKS = "os^Dv<>pPX"
_LOG = 10  # from which ratio on an axis is logarithmic
_SHOWN = ("rms", "largest", "dip", "sound")
# Inches.
_WIDTH, _LEFT, _RIGHT, _TOP, _BOTTOM, _GAP, _PANEL = 8.0, 0.9, 0.3, 0.9, 0.5, 0.2, 1.7


def save_log(path: Path, setting: Setting, log: Log) -> None:
    """Draw speed, error and current of a run into a `.png` or `.pdf`; equal runs give equal files."""
    save_figure(path, lambda: _draw_log(setting, log))


def save_loops(path: Path, loops: Sequence[tuple[str, Mapping[str, str], Mapping[str, Any]]], across: str) -> None:
    """Draw what came of loops into a `.png` or `.pdf`; equal ones give equal files.

    - `loops`: Method, place on the axes, and row of each.
    - `across`: The axis from left to right; for all others, and for methods, there is a curve for each value.
    """
    save_figure(path, lambda: _draw_loops(loops, across))


def _draw_log(setting: Setting, log: Log) -> Figure:
    spec = setting.spec
    unit = spec.scale.shown_unit
    figure, panels = place_panels(spec, _HEIGHTS, f"Loop, {in_words(spec.method)}")
    time = log["time"]

    def draw(panel: str, values: Any, **style: Any) -> None:
        kept = columns(time, values)
        panels[panel].plot(time[kept], values[kept], **style)

    draw("speed", unit.of(log["held"]), color="0.75", label="measured", drawstyle="steps-post")
    draw("speed", unit.of(log["speed"]), color=ESTIMATE, label="true")
    draw("speed", unit.of(log["command"]), color="black", linewidth=0.8, label="commanded")
    panels["speed"].set_ylabel(f"speed ({unit.name})")
    panels["speed"].legend(loc="lower right", ncols=3)
    draw("error", unit.of(log["speed"] - log["command"]), color=ERROR)
    panels["error"].set_ylabel(f"error ({unit.name})")
    draw("current", log["current"], color=ESTIMATE)
    panels["current"].set_ylabel("current (A)")
    panels["current"].set_xlabel("time (s)")
    panels["current"].set_xlim(0, float(time[-1]))
    return figure


def _number(text: str) -> float | None:
    try:
        return read_nearest("value", text, {"": SPEED["rad/s"], **SPEED, **TIME, **FREQUENCY}, "")
    except ValueError:
        return None


def _draw_loops(loops: Sequence[tuple[str, Mapping[str, str], Mapping[str, Any]]], across: str) -> Figure:
    shown = [name for name in _SHOWN if any(row[FIGURES[name][0]] is not None for _, _, row in loops)]
    height = _TOP + _BOTTOM + len(shown) * _PANEL + (len(shown) - 1) * _GAP
    figure = Figure(figsize=(_WIDTH, height))
    FigureCanvasAgg(figure)
    curves: dict[str, list[tuple[str, Mapping[str, Any]]]] = {}
    for method, at, row in loops:
        rest = ", ".join(f"{name} {value}" for name, value in at.items() if name != across)
        curves.setdefault(", ".join(filter(None, (method, rest))), []).append((at.get(across, ""), row))
    values = list(dict.fromkeys(value for points in curves.values() for value, _ in points))
    numbers = {value: _number(value) for value in values}
    plain = all(number is not None and number > 0 for number in numbers.values())
    places = {value: float(numbers[value] or 0) if plain else k for k, value in enumerate(values)}
    first = None
    for number, name in enumerate(shown):
        column, head = FIGURES[name]
        low = height - _TOP - (number + 1) * _PANEL - number * _GAP
        place = (_LEFT / _WIDTH, low / height, 1 - (_LEFT + _RIGHT) / _WIDTH, _PANEL / height)
        axes = figure.add_axes(place, sharex=first)
        first = first or axes
        for which, (label, points) in enumerate(curves.items()):
            drawn = sorted((places[value], row[column]) for value, row in points if row[column] is not None)
            x, y = [one[0] for one in drawn], [one[1] for one in drawn]
            colour, mark = COLOURS[which % len(COLOURS)], _MARKS[which % len(_MARKS)]
            axes.plot(x, y, color=colour, marker=mark, markersize=4, linewidth=1, label=label)
        found = [row[column] for _, _, row in loops if row[column]]
        if found and max(found) > _LOG * min(found):
            axes.set_yscale("log")
        axes.set_ylabel(head.replace("current > 50 Hz", "current"), fontsize=8)
        axes.tick_params(labelbottom=number == len(shown) - 1)
    assert first is not None
    if plain:
        first.set_xscale("log")
    first.set_xticks([places[value] for value in values], values)
    first.minorticks_off()
    figure.axes[-1].set_xlabel(across)
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncols=3, fontsize=8)
    return figure
