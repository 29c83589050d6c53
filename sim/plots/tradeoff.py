"""The figure of error over delay has a curve per method over its settings."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from tachometry.sim.plots.style import COLOURS, in_words, place_panels, save_figure
from tachometry.sim.studies.comparing.tune import Cost, front
from tachometry.spec import TachometerSpec

_MARKS = "os^Dv<>pPX"


def save_tradeoff(path: Path, spec: TachometerSpec, costs: Mapping[str, Sequence[Cost]], speed: float) -> None:
    """Draw error over delay into a file whose kind its suffix tells: `.png` or `.pdf`; equal ones give equal files.

    - `spec`: Whose configuration is the title, and whose unit speeds have.
    - `costs`: By method: all settings that were tried. Those that are on its `front` are shown.
    - `speed`, rad/s: RMS speed of the motion at which errors were measured, and greatest of the one for delays.
    """
    save_figure(path, lambda: _draw(spec, costs, speed))


def _draw(spec: TachometerSpec, costs: Mapping[str, Sequence[Cost]], speed: float) -> Figure:
    figure, panels = place_panels(spec, {"costs": 5.4}, "Error over delay")
    axes, unit = panels["costs"], spec.scale.shown_unit
    axes.set_xscale("log")
    axes.set_yscale("log")
    for place, (method, tried) in enumerate(costs.items()):
        shown, again = front(tried), place >= len(COLOURS)  # colours are used twice
        axes.plot(
            [1e3 * cost.delay for cost in shown],
            [unit.of(cost.rms) for cost in shown],
            color=COLOURS[place % len(COLOURS)],
            marker=_MARKS[(place + 5 * again) % len(_MARKS)],
            markersize=4,
            fillstyle="none" if again else "full",
            linewidth=1,
            linestyle="--" if again else "-",
            label=in_words(method),
        )
    slow, fast = unit.of(speed / 2), unit.of(speed)
    axes.set_xlabel(f"equivalent delay (ms) at speeds between {slow:.4g} and {fast:.4g} {unit.name}, ideal encoder")
    axes.set_ylabel(f"RMS error ({unit.name}) at an RMS speed of {fast:.4g} {unit.name}")
    axes.grid(visible=True, which="both", color="0.92", linewidth=0.6)
    axes.legend(loc="best", ncols=2, fontsize=8)
    return figure
