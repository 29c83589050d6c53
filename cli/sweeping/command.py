"""Commands whose options may vary."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from tachometry.cli.options.option import GroupedCommand, options_named
from tachometry.cli.options.sweep import by_name
from tachometry.cli.sweeping.settings import arguments, of_command_line, of_file


class VaryingCommand(GroupedCommand):
    """A command whose options may also stand in a file, and may vary; one that varies is read with its first value.

    The settings are the object of its context.

    Parameters
    ----------
    points : callable
        Gives the options that may vary, by their names.
    """

    def __init__(self, *args: Any, points: Callable[[], dict[str, click.Option]], **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self._points = points

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        own = super().get_params(ctx)
        return [*own, *(option for option in self._points().values() if option not in own)]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        raw, _, _ = self.make_parser(ctx).parse_args(list(args))
        asked = self.get_help_option(ctx)
        if asked is not None and raw.get(asked.name or ""):
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
