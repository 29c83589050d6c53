"""`tachometry plan` prints the configuration, and tables over speed."""

import math
from collections.abc import Mapping

from rich.text import Text

from tachometry.cli.reports.axes import axes_rows
from tachometry.cli.reports.core import advice, configuration, measured, registers_row, size_rows
from tachometry.cli.reports.terminal import print_rows, print_table, stdout_console
from tachometry.sim.studies.estimate import Estimate
from tachometry.sim.studies.plan import Plan, Plans
from tachometry.spec import CoreSpec
from tachometry.spec.language.units import SpeedUnit, short_time
from tachometry.spec.registers.buses import Bus


def print_plan(core: CoreSpec, plans: Plans, unit: str, bus: Bus | None, size: Estimate) -> None:
    """Print the configuration of a core, what it or an axis of it measures and its plan, speeds in `unit`."""
    expected, spec = plans.table, plans.spec
    more = [*([] if bus is None else [registers_row(core, bus)]), *size_rows(size)]
    if core.axes is not None:
        print_rows([*axes_rows(core), *more])
    else:
        print_rows([*configuration(spec), *measured(spec, plans), *advice(plans), *more])
    per_unit = SpeedUnit(unit).rad_per_s
    heads = (f"speed ({unit})", "counts/tick", "m_s (ticks)", "T_m", f"Q_V ({unit})", "error/V (%)", "update by")
    rows = []
    times = expected.interval, expected.measurement_time
    columns = expected.speed, expected.counts_per_tick, *times, expected.resolution, expected.forced
    for speed, counts, m_s, t_m, q_v, forced in zip(*(column.tolist() for column in columns), strict=True):
        cells = (
            f"{speed / per_unit:.6g}",
            f"{counts:.6g}",
            _number(m_s, ".4g"),
            _duration(t_m),
            _number(q_v / per_unit, ".4g"),
            _number(100 * (q_v + spec.velocity.rounding_lsb * spec.velocity.rad_per_s_per_lsb) / speed, ".3g"),
            "maximum time (forced)" if forced else spec.facts.update_by,
        )
        rows.append(cells)
    console = stdout_console()
    console.print()
    print_table(heads, rows, left=(len(heads) - 1,))
    remark = f"{spec.words.remark} " if spec.words.remark else ""
    console.print(
        f"\n{remark}error/V is Q_V and the rounding together, with an ideal encoder."
        + ("\nTimes are those of the nominal tick; an external one may be longer." if spec.external_tick else ""),
        soft_wrap=True,
    )


def print_plans(plans: Mapping[str, Plan], left_out: Mapping[str, str], unit: str) -> None:
    """Print a table for each quantity, with a column for each method, and why others were left out."""
    per_unit = SpeedUnit(unit).rad_per_s
    console = stdout_console()
    for head, cell in (
        (f"Q_V ({unit})", lambda plan, row: _number(plan.resolution[row] / per_unit, ".4g")),
        ("Q_V/V (%)", lambda plan, row: _number(100 * plan.relative[row], ".4g")),
        ("T_m", lambda plan, row: _duration(float(plan.measurement_time[row]))),
        ("Q_V T_m (rad)", lambda plan, row: _number(plan.product[row], ".4g")),
    ):
        speeds = next(iter(plans.values())).speed.tolist()
        rows = [
            (f"{speed / per_unit:.6g}", *(cell(plan, row) for plan in plans.values()))
            for row, speed in enumerate(speeds)
        ]
        console.print(f"\n{head}")
        print_table((f"speed ({unit})", *plans), rows, left=())
    if any(math.isnan(value) for plan in plans.values() for value in plan.resolution.tolist()):
        console.print("\n-: too fast for the method, or there are no equations for it.")
    for name, reason in left_out.items():
        console.print(Text(f"\n{name}: left out: {reason}"))


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)


def _duration(seconds: float) -> str:
    return "-" if math.isnan(seconds) else short_time(seconds)
