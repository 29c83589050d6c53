"""`compare` prints and writes a row per method, with sizes if they were measured, and the cost of settings."""

from collections.abc import Iterator, Mapping
from fractions import Fraction
from types import MappingProxyType

from rich.text import Text

from tachometry.cli.reports.capture import capture_warnings, source_rows
from tachometry.cli.reports.run import merged_edges, print_warnings
from tachometry.cli.reports.terminal import print_rows, print_table, stdout_console
from tachometry.sim.studies.comparing.compare import Score
from tachometry.sim.studies.comparing.comparison import Comparison
from tachometry.sim.studies.size import Measurement
from tachometry.spec.language.units import SpeedUnit, format_time

_SPEEDS = ("rms", "max")  # of a score, in rad/s
_SIZE = {"COMB": "{:.0f}", "FF": "{:.0f}", "Fmax": "{:.0f}MHz"}


def shown_time(seconds: float) -> str:
    """Return a time to four digits."""
    return format_time(Fraction(f"{seconds:.4g}"))


def print_comparison(comparison: Comparison, sizes: Mapping[str, Measurement], left_out: Mapping[str, str]) -> None:
    """Print the table, with sizes if they were measured, below it what each method is, and why others are left out."""
    scores, unit = comparison.scores, comparison.spec.scale.shown_unit
    if source := comparison.recording.source:
        print_rows(source_rows(source))
    print_table(*shown_scores(comparison, unit, sizes))
    console = stdout_console()
    if len(ranked := sorted((row.rms, row.name) for row in scores if row.rms is not None)) > 1:
        (least, best), (second, other) = ranked[:2]
        times = f", {second / least:.2g} times as much" if least else ""
        shown = f"{best} has the least error, {unit.of(least):.3g} {unit.name}; {other} is next{times}"
        console.print(Text(shown))
    if comparison.position_angle:
        rms, most = comparison.position_angle
        console.print(
            "angle: its error at the instant of use; float models have ODrive's interpolation of counts. The position "
            f"alone has {rms:.3g} RMS, {most:.3g} max"
        )
    console.print()
    for row in scores:
        tried = f"; best of {comparison.n_tried[row.name]} settings" if row.name in comparison.n_tried else ""
        console.print(Text(f"{row.name}: {row.what}{tried}"))
    if sizes:
        console.print("COMB, FF, Fmax: of the core on an ECP5, see docs/measured/size.md")
    for name, spec in comparison.specs.items():
        for note in spec.words.notes if spec is not None else ():
            console.print(Text(f"{name}: {note}"))
    for name, reason in left_out.items():
        console.print(Text(f"{name}: left out: {reason}"))
    warnings = merged_edges(comparison.n_merged)
    if comparison.true_speed is None:
        warnings += capture_warnings(comparison.recording)
    print_warnings(warnings)


def shown_scores(
    comparison: Comparison, unit: SpeedUnit, sizes: Mapping[str, Measurement] = MappingProxyType({})
) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return heads and rows of the table as it is shown."""

    def time(seconds: float | None) -> str:
        return "-" if seconds is None else ("-" if seconds < 0 else "") + shown_time(abs(seconds))

    shown = _SIZE if sizes else {}
    rows = [
        (
            row.name,
            f"{row.updates_per_second:.4g}",
            time(row.mean_time),
            time(row.worst_time),
            "-" if row.rms is None else f"{unit.of(row.rms):.4g}",
            "-" if row.max is None else f"{unit.of(row.max):.4g}",
            time(row.delay),
            *(() if row.angle_rms_deg is None else (f"{row.angle_rms_deg:.3g}", f"{row.angle_max_deg:.3g}")),
            *(form.format(sizes[row.name].figures[name]) if row.name in sizes else "-" for name, form in shown.items()),
        )
        for row in comparison.scores
    ]
    errors = (f"RMS ({unit.name})", f"max ({unit.name})")
    angles = ("angle RMS (deg el.)", "angle max") if comparison.position_angle else ()
    heads = ("method", "updates/s", "T_m mean", "T_m worst", *errors, "delay", *angles)
    return [*heads, *shown], rows


def comparison_table(
    comparison: Comparison, sizes: Mapping[str, Measurement]
) -> tuple[list[str], Iterator[list[object]]]:
    """Return heads and rows of the table as CSV."""
    scores, unit = comparison.scores, comparison.spec.scale.shown_unit
    unknown = {"what"} if comparison.position_angle else {"what", "angle_rms_deg", "angle_max_deg"}
    names = [name for name in vars(scores[0]) if name not in unknown]
    figures = list(_SIZE) if sizes else []

    def cells(row: Score) -> list[object]:
        size = sizes.get(row.name)
        values = [getattr(row, name) for name in names]
        shown = [
            unit.of(value) if name in _SPEEDS and value is not None else value
            for name, value in zip(names, values, strict=True)
        ]
        return shown + [size and size.figures[figure] for figure in figures]

    heads = [f"{name}_{unit.suffix}" if name in _SPEEDS else name for name in names]
    return [*heads, *figures], map(cells, scores)


def cost_table(comparison: Comparison) -> tuple[list[str], list[tuple[object, ...]]]:
    """Return heads and rows of what all settings cost; the last column tells those that are in the figure."""
    unit, shown = comparison.spec.scale.shown_unit, comparison.front
    rows: list[tuple[object, ...]] = [
        (cost.method, cost.name, unit.of(cost.rms), cost.delay, int(cost in shown))
        for tried in comparison.costs.values()
        for cost in tried
    ]
    return ["method", "name", f"rms_{unit.suffix}", "equivalent_delay", "shown"], rows
