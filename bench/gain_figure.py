"""The figure of usable gains shows gain, dip and current over the tick, a column per disc and a curve per method."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tachometry.sim.plots.style import COLOURS, save_figure
from tachometry.sim.studies.loops.control import Outcome
from tachometry.spec.language.units import format_time

_MARKS = "os^DvP"
# Inches.
_WIDTH, _HEIGHT, _LEFT, _TOP, _BOTTOM, _ACROSS, _DOWN, _PANEL = 9.0, 6.5, 0.75, 0.7, 0.65, 0.25, 0.25, 3.9
_TICKS = ((50, 100, 200, 400), (0.1, 0.2, 0.4, 0.8), (0.0, 0.2, 0.4, 0.6, 0.8, 1.0))
_ROWS = ("usable $k_v$ (1/s)", "dip under 0.2 Nm (rad/s)", "current above 50 Hz (A rms)")


@dataclass(frozen=True)
class Found:
    """Holds the greatest gain that is usable."""

    # disc and name: what the encoder is, and how the loop is closed
    disc: str
    name: str
    seconds: float  # the control tick
    gain: float  # 1/s
    outcome: Outcome


def save_usable_gains(path: Path, found: Sequence[Found]) -> None:
    """Draw what was found into a file whose kind its suffix tells: `.png` or `.pdf`; equal ones give equal files."""
    save_figure(path, lambda: _draw(found))


def _values(found: Found) -> tuple[float, float, float]:
    return found.gain, found.outcome.dip or 0.0, found.outcome.sound


def _draw(found: Sequence[Found]) -> Figure:
    figure = Figure(figsize=(_WIDTH, _HEIGHT))
    FigureCanvasAgg(figure)
    discs, names = (list(dict.fromkeys(getattr(one, key) for one in found)) for key in ("disc", "name"))
    ticks = sorted({one.seconds for one in found})
    tall = (_HEIGHT - _TOP - _BOTTOM - _DOWN * (len(_ROWS) - 1)) / len(_ROWS)
    for row, what in enumerate(_ROWS):
        first = None
        for column, disc in enumerate(discs):
            low = _HEIGHT - _TOP - (row + 1) * tall - row * _DOWN
            place = ((_LEFT + column * (_PANEL + _ACROSS)) / _WIDTH, low / _HEIGHT, _PANEL / _WIDTH, tall / _HEIGHT)
            axes = figure.add_axes(place, sharey=first)
            first = first or axes
            for number, name in enumerate(names):
                shown = sorted(
                    (one.seconds, _values(one)[row]) for one in found if (one.disc, one.name) == (disc, name)
                )
                x, y = [one[0] for one in shown], [one[1] for one in shown]
                axes.plot(x, y, color=COLOURS[number], marker=_MARKS[number], markersize=4, linewidth=1, label=name)
            axes.set_xscale("log")
            axes.set_yscale("linear" if row == len(_ROWS) - 1 else "log")
            axes.set_xticks(ticks, [format_time(Fraction(f"{tick:.6g}")) for tick in ticks])
            axes.set_yticks(_TICKS[row], [f"{tick:g}" for tick in _TICKS[row]])
            axes.minorticks_off()
            axes.tick_params(labelbottom=row == len(_ROWS) - 1, labelleft=column == 0)
            if row == 0:
                axes.set_title(disc, loc="left", fontsize=9)
            if column == 0:
                axes.set_ylabel(what)
                axes.yaxis.set_label_coords(-0.13, 0.5)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncols=len(names), fontsize=8)
    figure.text(0.5, 0.02, "control tick", ha="center", fontsize=9)
    return figure
