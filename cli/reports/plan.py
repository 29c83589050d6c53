"""What `tachometry plan` prints: the configuration, and tables over speed."""

import math
from collections.abc import Mapping
from fractions import Fraction

from rich.text import Text

from tachometry.cli.reports.terminal import print_rows, print_table, stdout_console
from tachometry.sim.studies.plan import Plan
from tachometry.spec import Speed, TachometerSpec
from tachometry.spec.manifest import manifest
from tachometry.spec.units import format_time, plural

_UNITS = ("rad/s", "rev/s", "rpm")
_WIDE = ("velocity", "pulse_count", "interval", "position")


def print_plan(spec: TachometerSpec, expected: Plan, unit: str) -> None:
    """Print the configuration of a core and its plan, speeds in `unit`."""
    print_rows(_configuration(spec))
    per_unit = _rad_per_s(unit)
    heads = (f"speed ({unit})", "counts/tick", "m_s (ticks)", "T_m", f"Q_V ({unit})", "error/V (%)", "update by")
    rows = []
    columns = zip(*(column.tolist() for column in vars(expected).values()), strict=True)
    for speed, counts, m_s, t_m, q_v, forced in columns:
        cells = (
            f"{speed / per_unit:.6g}",
            f"{counts:.6g}",
            _number(m_s, ".4g"),
            _duration(t_m),
            _number(q_v / per_unit, ".4g"),
            _number(100 * (q_v + spec.rounding_lsb * spec.rad_per_s_per_lsb) / speed, ".3g"),
            "maximum time (forced)" if forced else spec.update_by,
        )
        rows.append(cells)
    console = stdout_console()
    console.print()
    print_table(heads, rows, left=(len(heads) - 1,))
    remark = f"{spec.remark} " if spec.remark else ""
    console.print(
        f"\n{remark}error/V is Q_V and the rounding together."
        + ("\nTimes are those of the nominal tick; an external one may be longer." if spec.max_tick_cycles else ""),
        soft_wrap=True,
    )


def print_plans(plans: Mapping[str, Plan], left_out: Mapping[str, str], unit: str) -> None:
    """Print a table for each quantity, with a column for each method, and why others were left out."""
    per_unit = _rad_per_s(unit)
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


def _configuration(spec: TachometerSpec) -> list[tuple[str, str]]:
    encoder, timing = spec.encoder, spec.timing
    counts = f"{encoder.pulses_per_rev} pulses per revolution x{encoder.decoding}: {encoder.counts_per_rev} counts"
    greatest = f"{_speed(spec.greatest_speed)} ({spec.greatest_speed / spec.unit_velocity:.6g} counts per tick)"
    latencies = manifest(spec)["latency_cycles"]
    memory = spec.memory
    return [
        ("method", f"{spec.method.upper()}, {spec.description}"),
        ("encoder", counts),
        ("clock", f"{timing.clock_hz:,} Hz"),
        ("tick", f"{_time(timing.tick_seconds)} ({plural(timing.tick_cycles, 'clock')})"),
        ("maximum time", f"{_time(timing.max_ticks * timing.tick_seconds)} ({timing.max_ticks} ticks)"),
        ("unit velocity", f"{_speed(spec.unit_velocity)} (1 count per tick)"),
        ("greatest speed", greatest),
        (
            "one LSB of velocity",
            f"2^{-spec.frac_bits} {spec.unit} = {spec.rad_per_s_per_lsb:.6g} rad/s; rounding adds up to "
            f"{spec.rounding_lsb} of it",
        ),
        ("widths", ", ".join(f"{port.name} {port.width}" for port in spec.ports if port.name in _WIDE)),
        *([] if memory is None else [("reciprocal", _memory(*memory))]),
        *((name, f"{plural(n, 'clock')} ({_time(spec.seconds(n))})") for name, n in latencies.items()),
        ("standstill", _standstill(spec)),
    ]


def _memory(kind: str, entries: int, width: int) -> str:
    return f"{kind}: {entries} x {width} = {entries * width} bits of block RAM"


def _standstill(spec: TachometerSpec) -> str:
    rest = spec.standstill_ticks
    time = _time(rest * spec.timing.tick_seconds)
    return f"reads 0 at most {time} ({plural(rest, 'tick')}) after the last count's tick"


def _rad_per_s(unit: str) -> float:
    return Speed(Fraction(1), unit).rad_per_s


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)


def _duration(seconds: float) -> str:
    return "-" if math.isnan(seconds) else _time(seconds)


def _speed(rad_per_s: float) -> str:
    return " = ".join(f"{rad_per_s / _rad_per_s(unit):.6g} {unit}" for unit in _UNITS)


def _time(seconds: Fraction | float) -> str:
    """A time to four digits."""
    return format_time(Fraction(f"{float(seconds):.4g}"))
