"""The figure of a plan shows resolution and measurement time over speed."""

from collections.abc import Mapping
from pathlib import Path

from matplotlib.figure import Figure

from tachometry.sim.plots.style import COLOURS, ESTIMATE, FORCED, in_words, place_panels, save_figure
from tachometry.sim.studies.plan import Plan
from tachometry.spec import TachometerSpec
from tachometry.spec.language.units import SpeedUnit

_HEIGHTS = {"resolution": 3.4, "time": 2.4}  # inches


def save_plan_plot(path: Path, spec: TachometerSpec, plan: Plan, unit: str) -> None:
    """Draw a plan, whose speeds increase, into a `.png` or `.pdf`; `unit` is that of the speeds in the figure."""
    save_figure(path, lambda: _draw(spec, plan, unit))


def save_plans_plot(path: Path, spec: TachometerSpec, plans: Mapping[str, Plan], unit: str) -> None:
    """Draw the plans of several methods at the same speeds: Q_V, Q_V/V, T_m and Q_V·T_m, a line for each."""
    save_figure(path, lambda: _draw_all(spec, plans, unit))


def _draw_all(spec: TachometerSpec, plans: Mapping[str, Plan], unit: str) -> Figure:
    figure, panels = place_panels(spec, dict.fromkeys(("resolution", "relative", "time", "product"), 2.2), "Methods")
    per_unit = SpeedUnit(unit).rad_per_s
    for (name, plan), colour in zip(plans.items(), COLOURS * len(plans), strict=False):
        values = (plan.resolution / per_unit, 100 * plan.relative, plan.measurement_time, plan.product)
        for axes, value in zip(panels.values(), values, strict=True):
            axes.loglog(plan.speed / per_unit, value, color=colour, label=in_words(name))
    labels = (f"resolution ({unit})", "resolution/speed (%)", "measurement time (s)", "resolution × time (rad)")
    for axes, label in zip(panels.values(), labels, strict=True):
        axes.axvline(spec.scale.unit_velocity / per_unit, color="0.4", linestyle=":")
        axes.set_ylabel(label)
    panels["resolution"].legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.2, ncols=6)
    panels["product"].set_xlabel(f"speed ({unit})")
    panels["product"].set_xlim(plan.speed[0] / per_unit / 1.05, plan.speed[-1] / per_unit * 1.05)
    return figure


def _draw(spec: TachometerSpec, plan: Plan, unit: str) -> Figure:
    figure, panels = place_panels(spec, _HEIGHTS)
    resolution, time = panels["resolution"], panels["time"]
    per_unit = SpeedUnit(unit).rad_per_s
    speed, forced = plan.speed / per_unit, plan.forced
    left, right = speed[0] / 1.05, speed[-1] * 1.05
    marks = [("one count per tick", spec.scale.unit_velocity / per_unit, ":")]
    if spec.max_speed is not None:
        marks.append(("greatest speed", spec.max_speed.rad_per_s / per_unit, "--"))
    for axes, values in ((resolution, 100 * plan.resolution / plan.speed), (time, plan.measurement_time)):
        axes.loglog(speed, values, color=ESTIMATE, label=f"update by {spec.facts.update_by}")
        if forced.any():
            axes.loglog(
                speed[forced], values[forced], ".", color=FORCED, markersize=2.5, label="update by the maximum time"
            )
        for label, mark, style in marks:
            if left <= mark <= right:
                axes.axvline(mark, color="0.4", linestyle=style, label=label)
    rounding = 100 * spec.velocity.rounding_lsb * spec.velocity.rad_per_s_per_lsb / plan.speed
    resolution.loglog(speed, rounding, color="0.6", linewidth=0.8, label=f"rounding, {spec.velocity.rounding_lsb} LSB")
    resolution.set_ylabel("resolution/speed (%)")
    resolution.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.2, markerscale=3, ncols=5)
    time.set_ylabel("measurement time (s)")
    time.set_xlabel(f"speed ({unit})")
    time.set_xlim(left, right)
    return figure
