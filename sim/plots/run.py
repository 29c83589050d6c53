"""The figure of a run shows velocity, its error, pulse numbers and measurement times."""

from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.ticker
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tachometry.sim.plots.style import (
    COLUMNS,
    COUNT,
    ERROR,
    ESTIMATE,
    FORCED,
    FloatArray,
    TrueSpeed,
    columns,
    place_panels,
    save_figure,
)
from tachometry.sim.signals.run import Run
from tachometry.sim.signals.tables import held_velocity, velocity_error
from tachometry.spec import TachometerSpec

# Inches.
_HEIGHTS = {"velocity": 3.2, "error": 1.7, "count": 1.4, "interval": 1.4}

_TRUE_POINTS = 20_000  # at least: a vibration must be seen even when ticks are few
_MOST_MULTIPLES = 12  # lines at multiples of the unit velocity that still can be told apart


def save_plot(path: Path, spec: TachometerSpec, run: Run, true_speed: TrueSpeed | None = None) -> None:
    """Draw a run into a file whose kind its suffix tells: `.png` or `.pdf`.

    Equal runs give equal files. What has more points than the figure has columns is reduced to the first, least,
    greatest and last of each column, which draws the same line. Without `true_speed`, in rad/s at times in seconds,
    there is no error panel.
    """
    save_figure(path, lambda: draw(spec, run, true_speed))


def draw(spec: TachometerSpec, run: Run, true_speed: TrueSpeed | None = None) -> Figure:
    """Return the figure of a run, see `save_plot`."""
    seconds = run.n_clocks / spec.timing.clock_hz
    scale, unit = next(((k, u) for k, u in ((1, "s"), (1e3, "ms")) if seconds * k >= 1), (1e6, "µs"))
    heights = {name: height for name, height in _HEIGHTS.items() if true_speed or name != "error"}
    figure, panels = place_panels(spec, heights)
    _velocity(panels["velocity"], spec, run, true_speed, scale)
    if true_speed:
        _error(panels["error"], spec, run, true_speed, scale)
    _count(panels["count"], spec, run, scale)
    _interval(panels["interval"], spec, run, scale)
    panels["interval"].set_xlabel(f"time ({unit})")
    panels["interval"].set_xlim(0, seconds * scale)
    return figure


def _velocity(axes: Axes, spec: TachometerSpec, run: Run, true_speed: TrueSpeed | None, scale: float) -> None:
    clock_hz, updates, unit = spec.timing.clock_hz, run.updates, spec.scale.shown_unit
    velocity = unit.of(updates.velocity * spec.velocity.rad_per_s_per_lsb)
    clock, velocity = _held_to_end(updates.clock, velocity, run.n_clocks)
    kept = columns(clock, velocity)
    time = clock[kept] / clock_hz * scale
    axes.plot(time, velocity[kept], color=ESTIMATE, drawstyle="steps-post", label="measured (held)")
    if true_speed:
        instants = np.linspace(0, run.n_clocks / clock_hz, max(_TRUE_POINTS, 2 * len(run.ticks.clock)))
        speed = unit.of(true_speed(instants))
        # Below the steps where they can be told apart, else above the band that they merge to.
        over = len(clock) > COLUMNS // 4
        colour, width = ("black", 0.8) if over else ("0.6", 1.8)
        kept = columns(instants, speed)
        axes.plot(
            instants[kept] * scale,
            speed[kept],
            color=colour,
            linewidth=width,
            zorder=3 if over else 1.9,
            label="shaft (true)",
        )
    axes.set_ylabel(f"velocity ({unit.name})")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.2, ncols=2)
    _multiples(axes, unit.of(spec.scale.unit_velocity))


def _held_to_end(clock: NDArray[np.int64], values: NDArray[np.generic], n_clocks: int) -> tuple[FloatArray, FloatArray]:
    """Return points of a step line that ends with the run."""
    if not len(clock):
        return np.empty(0), np.empty(0)
    return np.append(clock, n_clocks).astype(np.float64), np.append(values, values[-1]).astype(np.float64)


def _multiples(axes: Axes, unit_velocity: float) -> None:
    """Draw an axis in counts per tick, and lines at whole numbers of them if they are few."""

    def counts(velocity: Any) -> Any:
        return velocity / unit_velocity

    def speed(count: Any) -> Any:
        return count * unit_velocity

    right = axes.secondary_yaxis("right", functions=(counts, speed))
    right.set_ylabel("counts per tick")
    right.spines["right"].set_visible(True)
    low, high = (v / unit_velocity for v in axes.get_ylim())
    if high - low <= _MOST_MULTIPLES:
        right.yaxis.set_major_locator(matplotlib.ticker.MultipleLocator(1))
        for n in range(int(np.ceil(low)), int(np.floor(high)) + 1):
            axes.axhline(n * unit_velocity, color="0.75", linewidth=0.7, linestyle=(0, (1, 3)), zorder=0.5)


def _error(axes: Axes, spec: TachometerSpec, run: Run, true_speed: TrueSpeed, scale: float) -> None:
    held, unit = held_velocity(spec, run), spec.scale.shown_unit
    error = unit.of(held.velocity_rad_s - true_speed(held.time))
    kept = columns(held.time, error)
    axes.axhline(0, color="0.6", linewidth=0.7)
    axes.plot(held.time[kept] * scale, error[kept], color=ERROR)
    axes.set_ylabel(f"error ({unit.name})")
    statistics = velocity_error(held, true_speed)
    if statistics:
        axes.set_title(
            f"held − true at every tick: RMS {unit.of(statistics.rms):.3g}, mean {unit.of(statistics.mean):.3g}, "
            f"max {unit.of(statistics.max):.3g} {unit.name}",
            loc="left",
            fontsize=8,
        )


def _count(axes: Axes, spec: TachometerSpec, run: Run, scale: float) -> None:
    ticks = run.ticks
    clock, m_e = _held_to_end(ticks.clock, ticks.pulse_count, run.n_clocks)
    kept = columns(clock, m_e)
    axes.plot(clock[kept] / spec.timing.clock_hz * scale, m_e[kept], color=COUNT, drawstyle="steps-post")
    axes.set_ylim(m_e.min() - 0.5, m_e.max() + 0.5)
    axes.set_ylabel("counts in a tick")
    axes.yaxis.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True, nbins=5, min_n_ticks=1))


def _interval(axes: Axes, spec: TachometerSpec, run: Run, scale: float) -> None:
    updates = run.updates
    ticks = updates.interval * (spec.times.interval_unit / spec.timing.tick_cycles)
    for forced, colour, label in ((False, ESTIMATE, spec.facts.update_by), (True, FORCED, "forced")):
        chosen = updates.forced == forced
        time, m_s = updates.clock[chosen] / spec.timing.clock_hz, ticks[chosen]
        kept = columns(time, m_s)
        axes.plot(time[kept] * scale, m_s[kept], ".", color=colour, markersize=2.5, label=label)
    axes.set_yscale("log")
    axes.set_ylim(0.8 * ticks.min(where=ticks > 0, initial=1), spec.timing.max_ticks * 1.25)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_ylabel("measurement (ticks)")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.2, markerscale=3, ncols=2)
