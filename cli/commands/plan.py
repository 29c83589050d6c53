"""`tachometry plan`: what a core can measure, before it is generated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tachometry.cli.files import Outputs
from tachometry.cli.options.axes import AXES
from tachometry.cli.options.core import BAUD, BUS, FAMILY, Make, core_and_make_options
from tachometry.cli.options.methods import Methods, named_methods
from tachometry.cli.options.option import command, option, output
from tachometry.cli.reports.plan import print_plan, print_plans
from tachometry.sim.studies.estimate import Estimate
from tachometry.sim.studies.plan import Plans, default_range
from tachometry.spec import CoreSpec, Speed, TachometerSpec
from tachometry.spec.formats.velocity_output import NATIVE
from tachometry.spec.language.units import SpeedUnit
from tachometry.spec.registers.buses import bus_of, ports_on

_SLOWEST = 1e-9  # counts per tick; keeps every number printable

_SPEEDS = """Range of speeds, in rad/s, rev/s or rpm. A LO without unit has that of HI. The tables are in --unit, or \
for count/tick in the unit of HI. [default: one count in the maximum time to --max-speed, or to ten counts per tick]"""
_METHODS = "Methods to compare: all, or names with commas between. They may have options, as in m:average=10."


@command("""\b
Examples:
  tachometry plan --ppr 500 --max-speed 400rad/s
  tachometry plan --ppr 500 --methods all --plot methods.png
  tachometry plan --ppr 2048 --clock 100MHz --tick 50us --max-time 20ms \\
      --speeds 1:6000rpm --plot plan.pdf --csv plan.csv""")
@core_and_make_options(AXES)
@option("Range", "--speeds LO:HI", help=_SPEEDS)
@option("Range", "--methods LIST", help=_METHODS)
@BUS
@BAUD
@FAMILY
@output("--plot", suffixes=(".png", ".pdf", ".svg"), help="Figure of resolution and measurement time.")
@output("--csv", help="CSV with a row per speed: the data of the figure.")
def plan(
    spec: CoreSpec,
    make: Make,
    speeds: str | None,
    methods: str | None,
    bus: str | None,
    baud: int | None,
    family: str,
    plot: Path | None,
    csv: Path | None,
) -> int:
    """Show what a core can measure, before it is generated.

    Prints what the configuration makes of the core, and what it measures at constant speeds of an ideal encoder: mean
    interval m_s, measurement time T_m and resolution Q_V of its method (Tsuji 2009, eqs. 4 to 20; Rairán 2013). With
    --methods, the same of several methods beside each other, and Q_V/V and Q_V T_m. With --axes it is that of each
    axis. It is computed, nothing is simulated.

    Equal options give equal files.
    """
    outputs = Outputs({"--plot": plot, "--csv": csv})
    core = spec if spec.axes is None else spec.axis
    if spec is not core and methods is not None:
        raise ValueError("--methods must be left out with --axes: a plan of axes is of one method")
    on = bus_of(bus or "none", baud)
    if on is not None:
        spec = spec if spec.axes is None else replace(spec, parallel=True)
        ports_on(spec, on)  # refuses registers that the bus does not reach
    low, high, unit = _range(core, speeds)
    named = Methods({}) if methods is None else named_methods(methods, make)
    plans = Plans(core, {name: one for name, one in named.specs.items() if one is not None}, low, high)
    with outputs:
        if path := outputs.get("--csv"):
            plans.write(path)
        if path := outputs.get("--plot"):
            from tachometry.sim.plots.plan import save_plan_plot, save_plans_plot  # Matplotlib is slow to import

            if methods is None:
                save_plan_plot(path, core, plans.line, unit)
            else:
                save_plans_plot(path, core, plans.lines, unit)
    print_plan(spec, plans, unit, on, Estimate.of(spec, on, family))
    if methods is not None:
        print_plans(plans.tables, named.left_out, unit)
    return 0


def _range(spec: TachometerSpec, text: str | None) -> tuple[float, float, str]:
    """Return least and greatest speed in rad/s, and the unit to show speeds in."""
    if text is None:
        unit = "rad/s" if spec.max_speed is None else spec.max_speed.unit
        return *default_range(spec), unit if spec.unit == NATIVE else spec.unit
    low, _, high = (part.strip() for part in text.partition(":"))
    try:
        last = Speed.parse(high)
        first = Speed.parse(low, last.unit)
    except ValueError as error:
        raise ValueError(
            f"--speeds must be LO:HI, both greater than 0, in rad/s, rev/s or rpm such as 10:3000rpm, not {text!r}"
        ) from error
    counts = last.ceil_counts(spec.encoder.counts_per_rev, spec.timing.tick_seconds)
    if counts > spec.tick.max_count or last.rad_per_s > spec.velocity.greatest_speed * (1 + 1e-12):
        greatest = spec.velocity.greatest_speed / SpeedUnit(last.unit).rad_per_s
        raise ValueError(
            f"--speeds must be at most {spec.velocity.greatest_speed / spec.scale.unit_velocity:.6g} counts per tick "
            f"({greatest:.6g}{last.unit}), "
            f"the most that this core measures, not {text!r}"
        )
    if first.rad_per_s < _SLOWEST * spec.scale.unit_velocity:
        least = _SLOWEST * spec.scale.unit_velocity / SpeedUnit(first.unit).rad_per_s
        raise ValueError(f"--speeds must be at least {least:.6g}{first.unit}, not {text!r}")
    if first.rad_per_s >= last.rad_per_s:
        raise ValueError(f"--speeds must be LO:HI with LO less than HI, not {text!r}")
    return first.rad_per_s, last.rad_per_s, last.unit if spec.unit == NATIVE else spec.unit
