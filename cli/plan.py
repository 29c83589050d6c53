"""`tachometry plan`: what a core can measure, before it is generated."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tachometry.cli.core_options import core_options
from tachometry.cli.files import Outputs
from tachometry.cli.options import GroupedCommand, option, output
from tachometry.spec import Speed, STachometer
from tachometry.spec.manifest import manifest
from tachometry.spec.units import format_time
from tachometry.spec.velocity_output import NATIVE

if TYPE_CHECKING:  # numpy is slow to import, and --help does not need it
    from tachometry.sim.plan import Plan

_ROWS = 12
_SLOWEST = 1e-9  # counts per tick; keeps every number printable
_UNITS = ("rad/s", "rev/s", "rpm")
_WIDE = ("velocity", "pulse_count", "interval", "position")


@click.command(
    cls=GroupedCommand,
    short_help="Tell what a core can measure: resolution and time over speed.",
    epilog="""\b
Examples:
  tachometry plan --ppr 500 --max-speed 400rad/s
  tachometry plan --ppr 2048 --clock 100MHz --tick 50us --max-time 20ms \\
      --speeds 1:6000rpm --plot plan.pdf --csv plan.csv""",
)
@core_options
@option(
    "Range",
    "--speeds",
    metavar="LO:HI",
    help="Speeds of the tables, in rad/s (default), rev/s or rpm; a LO without unit has that of HI. "
    "[default: one count in the maximum time to --max-speed, or to ten counts per tick]",
)
@output("--plot", suffixes=(".png", ".pdf"), help="Figure of resolution and measurement time; .png or .pdf.")
@output("--csv", help="CSV with a row per speed, densely sampled: what the figure is drawn from.")
def plan(spec: STachometer, speeds: str | None, plot: Path | None, csv: Path | None) -> int:
    """Tell what a core can measure, before it is generated.

    Prints what the configuration makes of the core, and what it measures at constant speeds of an ideal encoder: mean
    interval m_s, measurement time T_m and resolution Q_V of the S method (Tsuji 2009, eqs. 18 to 20). It is computed,
    nothing is simulated.

    Equal options give equal files.
    """
    if not isinstance(spec, STachometer):
        raise ValueError(f"method must be s for a plan, not {spec.method}")
    targets = {what: path for what, path in (("--plot", plot), ("--csv", csv)) if path is not None}
    outputs = Outputs(targets)
    low, high, unit = _range(spec, speeds)

    import numpy as np

    from tachometry.sim.plan import dense_speeds, plan_at, write_plan

    with outputs:
        if targets:
            dense = plan_at(spec, dense_speeds(spec, low, high))
        if path := outputs.get("--csv"):
            write_plan(path, dense)
        if path := outputs.get("--plot"):
            from tachometry.sim.plan_plot import save_plan_plot

            save_plan_plot(path, spec, dense, unit)
    _print(spec, plan_at(spec, np.geomspace(low, high, _ROWS)), unit)
    return 0


def _range(spec: STachometer, text: str | None) -> tuple[float, float, str]:
    """Least and greatest speed in rad/s, and the unit to show speeds in."""
    if text is None:
        from tachometry.sim.plan import default_range

        unit = "rad/s" if spec.max_speed is None else spec.max_speed.unit
        return *default_range(spec), unit if spec.unit == NATIVE else spec.unit
    low, _, high = (part.strip() for part in text.partition(":"))
    try:
        last = Speed.parse(_with_unit(high, "rad/s"))
        first = Speed.parse(_with_unit(low, last.unit))
    except ValueError as error:
        raise ValueError(f"speeds must be LO:HI, both greater than 0, in rad/s, rev/s or rpm, not {text!r}") from error
    counts = last.ceil_counts(spec.encoder.counts_per_rev, spec.timing.tick_seconds)
    if counts > spec.max_count or last.rad_per_s > spec.greatest_speed * (1 + 1e-12):
        greatest = spec.greatest_speed / _rad_per_s(last.unit)
        raise ValueError(
            f"speeds must be at most {spec.greatest_speed / spec.unit_velocity:.6g} counts per tick "
            f"({greatest:.6g}{last.unit}), "
            f"the most that this core measures, not {text!r}"
        )
    if first.rad_per_s < _SLOWEST * spec.unit_velocity:
        least = _SLOWEST * spec.unit_velocity / _rad_per_s(first.unit)
        raise ValueError(f"speeds must be at least {least:.6g}{first.unit}, not {text!r}")
    if first.rad_per_s >= last.rad_per_s:
        raise ValueError(f"speeds must be LO:HI with LO less than HI, not {text!r}")
    return first.rad_per_s, last.rad_per_s, last.unit


def _with_unit(number: str, unit: str) -> str:
    return number + unit if number.endswith(tuple("0123456789.")) else number


def _rad_per_s(unit: str) -> float:
    return Speed(Fraction(1), unit).rad_per_s


def _print(spec: STachometer, expected: Plan, unit: str) -> None:
    from rich.table import Table
    from rich.text import Text

    from tachometry.cli.report import print_rows, stdout_console

    print_rows(_configuration(spec))
    per_unit = _rad_per_s(unit)
    heads = (f"speed ({unit})", "counts/tick", "m_s (ticks)", "T_m", f"Q_V ({unit})", "error/V (%)", "update by")
    table = Table(box=None, pad_edge=False, header_style="")
    for head in heads:
        table.add_column(head, justify="left" if head == heads[-1] else "right", no_wrap=True)
    rows = zip(*(column.tolist() for column in vars(expected).values()), strict=True)
    for speed, counts, m_s, t_m, q_v, forced in rows:
        cells = (
            f"{speed / per_unit:.6g}",
            f"{counts:.6g}",
            f"{m_s:.4g}",
            _time(t_m),
            f"{q_v / per_unit:.4g}",
            f"{100 * (q_v + spec.rounding_lsb * spec.rad_per_s_per_lsb) / speed:.3g}",
            "maximum time (forced)" if forced else "alteration",
        )
        table.add_row(*map(Text, cells))
    console = stdout_console()
    console.print()
    console.print(table)
    console.print(
        "\nAt a multiple of the unit velocity m_s would be infinite. At one, and nearer to it than "
        f"1/{spec.timing.max_ticks} of the unit,\nupdates are forced, and Q_V is the bound of their error. "
        "error/V is Q_V and the rounding together."
        + ("\nTimes are those of the nominal tick; an external one may be longer." if spec.max_tick_cycles else ""),
        soft_wrap=True,
    )


def _configuration(spec: STachometer) -> list[tuple[str, str]]:
    from tachometry.sim.plan import standstill_ticks

    encoder, timing = spec.encoder, spec.timing
    kind, entries, width = spec.memory
    equation = "eq. (21), cancels alternate alterations" if spec.cancel else "eq. (17)"
    counts = f"{encoder.pulses_per_rev} pulses per revolution x{encoder.decoding}: {encoder.counts_per_rev} counts"
    greatest = f"{_speed(spec.greatest_speed)} ({spec.greatest_speed / spec.unit_velocity:.6g} counts per tick)"
    latencies = manifest(spec)["latency_cycles"]
    rest = standstill_ticks(spec)
    return [
        ("method", f"{spec.method.upper()}, {equation}"),
        ("encoder", counts),
        ("clock", f"{timing.clock_hz:,} Hz"),
        ("tick", f"{_time(timing.tick_seconds)} ({_plural(timing.tick_cycles, 'clock')})"),
        ("maximum time", f"{_time(timing.max_ticks * timing.tick_seconds)} ({timing.max_ticks} ticks)"),
        ("unit velocity", f"{_speed(spec.unit_velocity)} (1 count per tick)"),
        ("greatest speed", greatest),
        (
            "one LSB of velocity",
            f"2^{-spec.frac_bits} {spec.unit} = {spec.rad_per_s_per_lsb:.6g} rad/s; rounding adds up to "
            f"{spec.rounding_lsb} of it",
        ),
        ("widths", ", ".join(f"{port.name} {port.width}" for port in spec.ports if port.name in _WIDE)),
        ("reciprocal", f"{kind}: {entries} x {width} = {entries * width} bits of block RAM"),
        *((name, f"{_plural(n, 'clock')} ({_time(spec.seconds(n))})") for name, n in latencies.items()),
        (
            "standstill",
            f"reads 0 at most {_time(rest * timing.tick_seconds)} ({rest} ticks) after the last count's tick",
        ),
    ]


def _plural(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"


def _speed(rad_per_s: float) -> str:
    return " = ".join(f"{rad_per_s / _rad_per_s(unit):.6g} {unit}" for unit in _UNITS)


def _time(seconds: Fraction | float) -> str:
    """A time to four digits."""
    return format_time(Fraction(f"{float(seconds):.4g}"))
