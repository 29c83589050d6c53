"""Options that commands share, and how they are shown and explained."""

import functools
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from tachometry.spec import METHODS
from tachometry.spec.option import options_of

INTERRUPTED = 130  # exit status: 128 + SIGINT, as shells have it

Command = TypeVar("Command", bound=Callable[..., Any])

# What the objects behind the options call their parameters, at the head of a message.
_PARAMETERS = {
    "pulses_per_rev": "--ppr",
    "tick_cycles": "--tick, in clocks,",
    "max_ticks": "--max-time, in ticks,",
    "max_time": "--max-time",
    "frac_bits": "--frac-bits",
    "max_speed": "--max-speed",
    "position_width": "--position-width",
    "filter_clocks": "--filter",
    "velocity_bits": "--velocity-width",
    "index_reset": "--index-reset",
    "max_tick_cycles": "--max-tick-period, in clocks,",
    "max_tick_period": "--max-tick-period",
    "phase_error_deg": "--phase-error",
    "duty_error_deg": "--duty-error",
    "vcd_from": "--vcd-from",
    "vcd_to": "--vcd-to",
}
_SAME_NAME = (
    "clock",
    "tick",
    "dt",
    "decoding",
    "name",
    "vibration",
    "jitter",
    "nonuniformity",
    "illegal",
    "bounce",
    "lost",
    "seed",
    "samplerate",
    "motion",
    "unit",
    "lsb",
    "method",
    "methods",
    "engines",
    "speeds",
    "only",
    "from",
    "vcd",
    "engine",
    "vary",
    "axes",
    "jobs",
    "results",
)
_OPTIONS = _PARAMETERS | {name: f"--{name}" for name in _SAME_NAME}
_OPTIONS |= {item.name: f"--{item.name.replace('_', '-')}" for spec in METHODS.values() for item in options_of(spec)}


def in_terms_of_options(message: str) -> str:
    """A message about a parameter, such as `max_ticks must be …`, as one about its option."""
    return re.sub(r"^[\w-]+(?= (?:\w+ )?must )", lambda match: _OPTIONS.get(match[0], match[0]), message)


class Option(click.Option):
    """An option that is listed in a group of its command's help.

    Parameters
    ----------
    group : str
        Heading of the group.
    """

    def __init__(self, *args: Any, group: str = "Other", **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.group = group


class GroupedCommand(click.Command):
    """A command whose help lists its options under the headings of their groups."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        groups: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                groups.setdefault(getattr(parameter, "group", "Other"), []).append(record)
        for heading, records in groups.items():
            with formatter.section(heading):
                formatter.write_dl(records, col_max=26)


def option(group: str, *names: str, **attributes: Any) -> Callable[[Command], Command]:
    """Decorator for an option in a group; defaults are shown."""
    return click.option(*names, cls=Option, group=group, show_default=True, **attributes)


def all_of(options: list[Callable[[Any], Any]], command: Callable[..., Any]) -> Callable[..., Any]:
    """A command with all of these options, in order."""
    for decorate in reversed(options):
        command = decorate(command)
    return command


_OUTPUTS = "Outputs"


def _suffix(*allowed: str) -> Callable[[click.Context, click.Parameter, Path | None], Path | None]:
    def check(ctx: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
        if path is not None and path.suffix.lower() not in allowed:
            names = ", ".join(allowed[:-1]) + " or " * (len(allowed) > 1) + allowed[-1]
            raise click.BadParameter(f"file must end in {names}, not {str(path)!r}")
        return path

    return check


def output(name: str, *, help: str, suffixes: tuple[str, ...] = ()) -> Callable[[Any], Any]:
    """Decorator for an option that names a file to be written, with one of some suffixes."""
    callback = _suffix(*suffixes) if suffixes else None
    return option(_OUTPUTS, name, type=click.Path(path_type=Path), metavar="FILE", callback=callback, help=help)


def output_folder(default: str, *, help: str) -> Callable[[Any], Any]:
    """Decorator for the option that names the folder of all outputs, handed to the command as `directory`."""
    kind = click.Path(path_type=Path, file_okay=False)
    return option(_OUTPUTS, "-o", "--output", "directory", type=kind, default=default, metavar="DIR", help=help)


_OUTPUT_OPTIONS = [
    output(
        "--vcd",
        suffixes=(".vcd",),
        help="Waveform of pins, ports and inner values, with a GTKWave save file (.gtkw) beside it: open that.",
    ),
    output(
        "--plot",
        suffixes=(".png", ".pdf"),
        help="Figure of velocity, error, pulse numbers and measurement times; .png or .pdf.",
    ),
    output(
        "--trace",
        help="CSV with a row per update: clock, tick, interval (the manifest has its unit), forced, raw velocity, "
        "velocity in rad/s; then all other outputs that change with an update.",
    ),
    output("--counts", help="CSV with a row per tick: tick, pulse count, position (counts), and what else ticks have."),
    output("--events", help="CSV with a row per index pulse, illegal transition and external tick that was wrong."),
    output(
        "--save-capture",
        suffixes=(".sr",),
        help="Encoder lines as the core samples them, as a sigrok capture: open in PulseView or replay it.",
    ),
]


def output_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator: the outputs of a simulation, handed to the command as `targets`, a dictionary of option to path.

    A `.gtkw` comes with `--vcd`.
    """

    @functools.wraps(command)
    def collect(
        *,
        vcd: Path | None,
        plot: Path | None,
        trace: Path | None,
        counts: Path | None,
        events: Path | None,
        save_capture: Path | None,
        **others: Any,
    ) -> Any:
        given = {
            "--vcd": vcd,
            "--vcd (its .gtkw)": None if vcd is None else vcd.with_suffix(".gtkw"),
            "--plot": plot,
            "--trace": trace,
            "--counts": counts,
            "--events": events,
            "--save-capture": save_capture,
        }
        return command(targets={what: path for what, path in given.items() if path is not None}, **others)

    return all_of(_OUTPUT_OPTIONS, collect)
