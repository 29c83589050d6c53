"""Options that a sweep can vary: those of cores, of methods and of the encoder; and commands whose options may vary."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from tachometry.cli.options.core import core_click_options
from tachometry.cli.options.motion import MOTION_OPTIONS
from tachometry.cli.options.option import SHORT, GroupedCommand, all_of, option, options_named
from tachometry.cli.options.sweep_settings import arguments, of_command_line, of_file

_SCHEDULER = """Run on a Dask scheduler, such as tcp://host:8786. Its workers need the same version of tachometry. \
Everyone who can connect to it can run code there and here, see docs/guides/sweep.md."""


SCHEDULER = option("Machines", "--scheduler ADDRESS", help=_SCHEDULER)
JOBS = option(
    "Machines", "--jobs N", type=int, help="Number of processes on this machine. [default: one for each core]"
)


def check_machines(jobs: int | None, scheduler: str | None) -> None:
    """Refuse machines that cannot be: both kinds, or none; a ValueError."""
    if jobs is not None and scheduler is not None:
        raise ValueError("--jobs must not be given together with --scheduler")
    if jobs is not None and jobs < 1:
        raise ValueError(f"--jobs must be at least 1, not {jobs}")


def by_name(command: click.Command) -> dict[str, click.Option]:
    """Return the options of a command by their names, without dashes."""
    options = [one for one in command.params if isinstance(one, click.Option) and one is not SHORT]
    return {option.opts[0].lstrip("-"): option for option in options}


def made_by_name(options: Sequence[Callable[[Any], Any]]) -> dict[str, click.Option]:
    """Return the options that decorators of a command make, by their names."""
    return by_name(click.command()(all_of(options, lambda: None)))


def point_options() -> dict[str, click.Option]:
    """Return all options that a sweep can vary, by their names."""
    return core_click_options() | made_by_name(MOTION_OPTIONS.options)


class VaryingCommand(GroupedCommand):
    """A command whose options may also stand in a file, and may vary; one that varies is read with its first value.

    The settings are the object of its context. `points` gives the options that may vary, by their names.
    """

    def __init__(self, *args: Any, points: Callable[[], dict[str, click.Option]], **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self._points = points

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        own = super().get_params(ctx)
        return [*own, *(option for option in self._points().values() if option not in own)]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if ctx.resilient_parsing:
            return super().parse_args(ctx, args)
        try:
            raw, _, _ = self.make_parser(ctx).parse_args(list(args))
        except click.UsageError:
            return super().parse_args(ctx, args)  # which says what is wrong
        help_option = self.get_help_option(ctx)
        if raw.get("short") or (help_option is not None and raw.get(help_option.name or "")):
            return super().parse_args(ctx, args)
        options = by_name(self) | self._points()
        file = raw.get("file")
        with options_named():
            settings = of_command_line(raw, options)
            if isinstance(file, str) and file:
                settings = settings.over(of_file(Path(file), options))
        ctx.obj = settings
        first = {name: text for name, text in settings.first().items() if name in options}
        words = [*arguments(first, options), *([file] if isinstance(file, str) else [])]
        return super().parse_args(ctx, words)
