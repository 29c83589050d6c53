"""Options that commands share, and how they are shown and explained."""

import functools
import importlib.util
import os
import re
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from tachometry.cli.options.help import line, needed
from tachometry.cli.options.option_aliases import meant, misplaced
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.spec import METHODS, ParameterError, common_options, own_options
from tachometry.spec.language import option as declaration
from tachometry.spec.language.option import options_of, read_options
from tachometry.spec.language.units import QUANTITY

# What a message says that a quantity is.
_NUMBER = re.compile(r", not (-?[\d.]+(?:e[+-]?\d+)?)( (?:rad/s|rev/s|rpm|Hz|Nm|s))?(?=$|[:;,])")
_PICTURES = (".png", ".pdf", ".svg")

Command = TypeVar("Command", bound=Callable[..., Any])


def message_of(error: ValueError) -> str:
    """Return the message of an error, with the option in place of a parameter: "--max-time, in ticks, must be …"."""
    if not isinstance(error, ParameterError):
        return str(error)
    name, _, part = error.parameter.partition(" ")
    shown = _shown(name)
    return " ".join(filter(None, [shown, part, error.rest if part else _as_typed(shown.split(",")[0], error.rest)]))


def _as_typed(name: str, rest: str) -> str:
    """Return a message with what was typed for an option; behind it what that is in the unit of the message."""
    context = click.get_current_context(silent=True)
    if context is None or name.lstrip("-") in getattr(context.obj, "vary", ()):  # of which it says the value
        return rest
    given = (one for one in context.command.get_params(context) if one.opts[0] == name and _is_given(context, one))
    typed = next((context.params.get(one.name or "") for one in given), None)
    quantity = re.fullmatch(QUANTITY, str(typed).strip(), re.ASCII)

    def told(found: re.Match[str]) -> str:
        alike = quantity is not None and float(quantity[1]) == float(found[1])
        return f", not {typed}" if alike else f", not {typed} ({found[1]}{found[2] or ''})"

    return _NUMBER.sub(told, rest) if quantity else rest


def _shown(name: str) -> str:
    parameter = name.replace("-", "_")
    of_methods = [about for method in METHODS for about in own_options(method)]
    options = [*common_options(), *of_methods, *options_of(EncoderOptions)]
    for about in options:
        if about.parameter == parameter:
            return f"--{about.name}"
    of_field = [about for about in options if about.field == parameter]
    context = click.get_current_context(silent=True)
    of_command = [] if context is None else context.command.get_params(context)
    if of_field:
        given = {one.opts[0] for one in of_command if context and _is_given(context, one)}
        shown = next((f"--{about.name}" for about in of_field if f"--{about.name}" in given), f"--{of_field[0].name}")
        unit = next((about.unit for about in of_field if about.unit), "")
        return f"{shown}, in {unit}," if unit else shown
    return next((one.opts[0] for one in of_command if one.name == parameter), name)


def _is_given(context: click.Context, one: click.Parameter) -> bool:
    return context.get_parameter_source(one.name or "") is ParameterSource.COMMANDLINE


@contextmanager
def options_named() -> Iterator[None]:
    """Say of an option of the running command what is said of a parameter."""
    try:
        yield
    except ParameterError as error:
        raise ValueError(message_of(error)) from error


class Option(click.Option):
    """An option that is listed in a group of its command's help.

    - `help`, `metavar`: A function is asked whenever the help is shown, of what may have been registered by then.
    - `fractional`: Whether plain numbers need not be whole; so is every option of a float.
    """

    def __init__(
        self,
        *args: Any,
        group: str = "Other",
        help: str | Callable[[], str],
        metavar: str | Callable[[], str] | None = None,
        fractional: bool = False,
        **attributes: Any,
    ) -> None:
        super().__init__(*args, **attributes)
        self.group = group
        self.fractional = fractional or isinstance(self.type, click.types.FloatParamType)
        self._texts = (help, metavar)

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        help, metavar = self._texts
        self.help = help if isinstance(help, str) else help()
        self.metavar = metavar() if callable(metavar) else metavar
        return super().get_help_record(ctx)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        _, metavar = self._texts
        shown = metavar() if callable(metavar) else metavar
        if shown is None or not shown.startswith("["):
            return super().shell_complete(ctx, incomplete)
        return [CompletionItem(word) for word in shown.strip("[]").split("|") if word.startswith(incomplete)]


class Later(click.Option):
    """Stands for options that are known when the command runs; `make` gives them."""

    def __init__(self, *args: Any, make: Callable[[], Sequence[click.Option]], **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.make = make


def later(name: str, make: Callable[[], Sequence[click.Option]]) -> Callable[[Command], Command]:
    """Decorate a command: the options that `make` gives when the command runs, in this place."""
    return click.option(f"--{name}", cls=Later, make=make, hidden=True)


RESEARCH = "Research"  # the group of options for those who study methods
LONG = "tachometry.long"  # of a context: its help has all sentences
_MOST_LINES = 100  # of --help


def _other(name: str, help: str) -> str:
    """Return how an option is typed to be another than by default, without its value."""
    yes, _, no = name.partition(" / ")
    return no if no and f"default: {yes.removeprefix('--')}]" in help else yes.partition(" ")[0]


def _show_short(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        assert isinstance(ctx.command, GroupedCommand)
        click.echo(ctx.command.short(ctx))
        ctx.exit()


SHORT = click.Option(
    ["-h", "short"], is_flag=True, is_eager=True, expose_value=False, hidden=True, callback=_show_short
)


class GroupedCommand(click.Command):
    """Lists its options in the help under the headings of their groups.

    -h lists the ten most common ones; `tachometry help COMMAND` has all sentences.
    """

    def __init__(self, *args: Any, **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.context_settings.setdefault("help_option_names", ["--help"])
        self.params.append(SHORT)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        words = [*args]  # which the parser takes out of `args`
        try:
            *_, order = self.make_parser(ctx).parse_args(list(args))  # of two values the first would be left out unseen
            for one in () if ctx.resilient_parsing else order:
                if isinstance(one, click.Option) and not one.multiple and order.count(one) > 1:
                    raise click.UsageError(f"{one.opts[0]} must be given once, not {order.count(one)} times")
            with options_named():
                return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            names = [name for one in self.get_params(ctx) if one is not SHORT for name in one.opts]
            near = meant(error.option_name, names)
            message = f"No such option {error.option_name!r}." + (f" Did you mean {' or '.join(near)}?" if near else "")
            raise click.UsageError(message, error.ctx or ctx) from None
        except click.UsageError as error:
            valued = [name for one in self.get_params(ctx) if not getattr(one, "is_flag", True) for name in one.opts]
            if text := misplaced(error.message, words, valued):
                raise click.UsageError(text, error.ctx or ctx) from None
            error.ctx = error.ctx or ctx  # the parser does not say of which command an option has no argument
            raise

    def short(self, ctx: click.Context) -> str:
        """Return the help of -h: the options that most need, and an example."""
        options = [one for one in self.get_params(ctx) if isinstance(one, click.Option)]
        example = (self.epilog or "").partition("Examples:\n")[2].split("\n  tachometry ")[0]
        records = filter(None, (one.get_help_record(ctx) for one in needed(options)))
        return "\n".join(
            [
                *self._head(ctx),
                *map(line, records),
                *(["", "Example:", example.strip("\n")] if example else []),
                "",
                f"{ctx.command_path} --help has all options.",
                f"{(ctx.parent or ctx).command_path} help {self.name} explains them.",
            ]
        )

    def _head(self, ctx: click.Context) -> list[str]:
        """Return the usage, and the first paragraph of what the command does."""
        paragraph = " ".join((self.help or "").split("\n\n")[0].split())
        return [self.get_usage(ctx), "", *textwrap.wrap(paragraph, 78, initial_indent="  ", subsequent_indent="  "), ""]

    def format_help(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        if ctx.meta.get(LONG):
            super().format_help(ctx, formatter)
            return
        lines = self._head(ctx)
        for heading, records in self._groups(ctx).items():
            if heading == RESEARCH:
                names = ", ".join(_other(*record) for record in records)
                lines += textwrap.wrap(f"{heading}: {names}", 79, subsequent_indent="  ", break_on_hyphens=False)
            else:
                lines += [f"{heading}:", *map(line, records)]
        last = f"{(ctx.parent or ctx).command_path} help {self.name} [--OPTION] explains them."
        for block in (self.epilog or "").replace("\b\n", "").split("\n\n"):
            if len(lines) + len(block.splitlines()) + 3 <= _MOST_LINES:
                lines += ["", *(part for line in block.splitlines() for part in textwrap.wrap(line, 79) or [""])]
        formatter.write("\n".join([*lines, "", last]) + "\n")

    def invoke(self, ctx: click.Context) -> Any:
        with options_named():
            return super().invoke(ctx)

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        parameters: list[click.Parameter] = []
        for parameter in super().get_params(ctx):
            parameters += parameter.make() if isinstance(parameter, Later) else [parameter]
        return parameters

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for heading, records in self._groups(ctx).items():
            with formatter.section(heading):
                formatter.write_dl(records, col_max=26)

    def _groups(self, ctx: click.Context) -> dict[str, list[tuple[str, str]]]:
        """Return names and sentences of all options, by the headings of their groups."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                groups.setdefault(getattr(parameter, "group", "Other"), []).append(record)
        return {name: groups[name] for name in sorted(groups, key=RESEARCH.__eq__)}


def command(epilog: str, **attributes: Any) -> Callable[[Callable[..., Any]], click.Command]:
    """Decorate a function: a command that lists its options in groups, and whose help ends with `epilog`."""
    return click.command(cls=GroupedCommand, epilog=epilog, **attributes)


def option(group: str, name: str, *others: str, **attributes: Any) -> Callable[[Command], Command]:
    """Decorate a command with an option in a group; defaults are shown.

    `name` may have what stands for the value behind it, as `--time COLUMN`; others follow as of `click.option`.
    """
    first, _, metavar = name.partition(" ")
    attributes = {"metavar": metavar or None} | attributes
    return click.option(first, *others, cls=Option, group=group, show_default=True, **attributes)


def plain_options(group: str, helps: Mapping[str, str]) -> list[Callable[[Any], Any]]:
    """Return decorators of options by their names, as of `option`: texts, or flags where nothing stands for a value."""
    # What is no flag is not said to be none: click would then take a value that begins with - for another option.
    return [option(group, name, is_flag=None if " " in name else True, help=help) for name, help in helps.items()]


def declared(group: str, about: declaration.Option) -> Callable[[Command], Command]:
    """Decorate a command with an option that a class declares; its value is a text, a flag's yes or no, or None."""
    if about.flag and about.default is False:
        return option(group, f"--{about.name}", is_flag=True, help=about.help)
    if about.flag:
        return option(group, f"--{about.name}/--no-{about.name}", default=None, help=about.help + default_of(about))
    return option(group, f"--{about.name}", help=about.help + default_of(about), **kind_of(about))


def kind_of(about: declaration.Option) -> dict[str, Any]:
    """Return what click is told of a declared option that is read later."""
    if about.flag:
        return {"is_flag": True}
    choices = f"[{'|'.join(about.choices)}]" if about.choices else None
    return {"type": click.STRING, "metavar": about.metavar or choices, "fractional": about.fractional}


def default_of(about: declaration.Option) -> str:
    """Return what `--help` says of the default, behind the rest."""
    shown = about.shown
    if about.flag and about.shown is None and isinstance(about.default, bool):
        shown = about.name if about.default else f"no-{about.name}"
    return "" if shown is None else f" [default: {shown}]"


def take_values(
    spec: type[Any], given: dict[str, Any], timing: Mapping[str, Any] = MappingProxyType({})
) -> dict[str, Any]:
    """Take the declared options of a class out of what click gives a command, and return the values of its fields."""
    return read_options(spec, take_texts(spec, given), timing)


def take_texts(spec: type[Any], given: dict[str, Any]) -> dict[str, str]:
    """Take the declared options of a class out of what click gives a command, as texts by their names."""
    values = {about.name: given.pop(about.parameter, None) for about in options_of(spec)}
    return {
        name: ("no", "yes")[value] if isinstance(value, bool) else value
        for name, value in values.items()
        if value is not None
    }


def refuse_without(needed: str, options: Sequence[Callable[[Any], Any]]) -> None:
    """Check that none of some options is given to the running command: without another one they have no effect.

    It raises ValueError if one is.
    """
    context = click.get_current_context()
    command = click.Command(None)
    all_of(options, command)
    names = {parameter.name for parameter in command.params}
    for parameter in context.command.get_params(context):
        source = context.get_parameter_source(parameter.name or "")
        if parameter.name in names and source is ParameterSource.COMMANDLINE:
            raise ValueError(f"{parameter.opts[0]} must be given together with {needed}")


class Group:
    """Adds options to a command that it decorates; `read` makes the command's arguments of all that click gives it."""

    def __init__(self, options: Sequence[Callable[[Any], Any]], read: Callable[..., dict[str, Any]]) -> None:
        self.options, self._read = options, read

    def __call__(self, command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def run(**given: Any) -> Any:
            return command(**self._read(**given))

        return all_of(self.options, run)


def all_of(options: Sequence[Callable[[Any], Any]], command: Callable[..., Any]) -> Callable[..., Any]:
    """Return a command with all of these options, in order."""
    for decorate in reversed(options):
        command = decorate(command)
    return command


class FilePath(click.Path):
    """A path, which must not be the empty text: that would be the current folder."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(path_type=Path, **attributes)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not os.fspath(value):
            self.fail("must be a path, not ''", param, ctx)
        return super().convert(value, param, ctx)


_OUTPUTS = "Outputs"


def _suffix(*allowed: str) -> Callable[[click.Context, click.Parameter, Path | None], Path | None]:
    def check(ctx: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
        if path is not None and path.suffix.lower() not in allowed:
            names = ", ".join(allowed[:-1]) + " or " * (len(allowed) > 1) + allowed[-1]
            raise click.BadParameter(f"file must end in {names}, not {str(path)!r}")
        if path is not None and path.suffix.lower() in _PICTURES and importlib.util.find_spec("matplotlib") is None:
            raise OSError(f"{parameter.opts[0]} needs Matplotlib: pip install 'tachometry[plot]'")
        return path

    return check


def output(name: str, *others: str, help: str, suffixes: tuple[str, ...] = ()) -> Callable[[Any], Any]:
    """Decorate a command with an option that names a file to be written, with one of some suffixes."""
    callback = _suffix(*suffixes) if suffixes else None
    if len(suffixes) > 1 and suffixes[0] not in help:
        help = f"{help} {', '.join(suffixes[:-1])} or {suffixes[-1]}."
    return option(_OUTPUTS, name, *others, type=FilePath(), metavar="FILE", callback=callback, help=help)


def output_folder(default: str, *, help: str) -> Callable[[Any], Any]:
    """Decorate a command with the option that names the folder of all outputs, handed to the command as `directory`."""
    kind = FilePath(file_okay=False)
    return option(_OUTPUTS, "-o", "--output", "directory", type=kind, default=default, metavar="DIR", help=help)
