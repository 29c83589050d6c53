"""The page asks these functions: each takes texts of options, and returns what JSON can hold.

Nothing here knows of a server, so that the page can also be served without one. A wrong option is refused as on the
command line, by `Refused` with the same line.
"""

import base64
import io
import re
import shlex
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any, TypeVar
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import click

from tachometry.cli.commands import Refused, refusals
from tachometry.cli.commands.generate import ASKED, Asked
from tachometry.cli.options.help import needed
from tachometry.cli.options.option import GroupedCommand, Option, options_named
from tachometry.cli.options.settings import arguments
from tachometry.spec import METHODS, methods_with
from tachometry.spec.registers.buses import bus_of, ports_on

Texts = Mapping[str, str]  # of options, by their names without dashes; empty: without the option
Answer = dict[str, Any]
Made = TypeVar("Made")

_LONGEST = 4000  # characters of a text
# Groups that are no part of a core, by the part of the page that has them.
_PARTS = {"Motion": "motion", "Encoder faults": "motion", "Capture": "capture"}
_DEFAULT = re.compile(r"\s+\[(?:default: ([^\]]+?))?(?:(?:; )?\d*<?=?x[<>=]+\d+|required)?\]$")
_START = {"ppr": "500", "clock": "100MHz", "tick": "100us", "max-speed": "6000rpm"}
_FACTS = (
    *("method", "range", "worst error", "real disc", "delay", "standstill", "one LSB of velocity", "advice", "note"),
)
_AGES = (1980, 1, 1, 0, 0, 0)  # of all files in archives, so that equal ones have equal bytes


@click.command("generate", cls=GroupedCommand)
@ASKED
def _generate(asked: Asked) -> Asked:
    return asked


def answer(name: str, args: Mapping[str, Any]) -> Answer:
    """Return what a function of `FUNCTIONS` answers; where it refuses, the line as `error` and the `field` it is of."""
    try:
        function = FUNCTIONS.get(name)
        if function is None:
            raise Refused(f"the page must ask one of {', '.join(FUNCTIONS)}, not {name!r}")
        for given in args.values():
            if not isinstance(given, dict) or not all(isinstance(text, str) for text in given.values()):
                raise Refused("what the page asks must be texts by the names of options")
        return function(**args)
    except TypeError as error:
        return {"error": f"the page must ask as it is written: {error}", "field": ""}
    except Refused as error:
        line = str(error).partition(" (see tachometry ")[0]
        named = re.search(r"--([a-z][a-z-]*)", line)
        return {"error": line, "field": named[1] if named else ""}


def options() -> Answer:
    """Return what can be asked for: options by groups, and those that most need."""
    with _generate.make_context("generate", [], resilient_parsing=True) as context:
        found = [one for one in _generate.get_params(context) if isinstance(one, Option) and one.name != "short"]
        groups: dict[str, list[Answer]] = {}
        for one in found:
            groups.setdefault(one.group, []).append(_described(one, context))
    return {
        "groups": [{"title": title, "part": _PARTS.get(title, "core"), "options": of} for title, of in groups.items()],
        "needed": [_name(one) for one in needed(found)],
        "start": _START,
        "methods": {name: spec.facts.summary for name, spec in METHODS.items()},
    }


def check(options: Texts) -> Answer:
    """Return what a core is: the command that writes it, its ports, and rows of names and values."""

    def of(asked: Asked) -> Answer:
        ports = ports_on(asked.spec, bus_of(asked.bus, asked.baud))
        return {
            "module": asked.manifest["module"],  # which also says what cannot be
            "method": asked.spec.tachometer.method,
            "command": f"tachometry generate {_typed(options)} -o build",
            "rows": asked.rows,
            "facts": _FACTS,
            "ports": [asdict(port) for port in ports],
        }

    return _run(_generate, options, of)


def files(options: Texts) -> Answer:
    """Return an archive with the files that `generate` writes; its bytes in base64."""
    name, texts = _run(_generate, options, lambda asked: (asked.name, asked.texts()))
    packed = io.BytesIO()
    with ZipFile(packed, "w", ZIP_DEFLATED) as archive:
        for file, text in texts.items():
            archive.writestr(ZipInfo(file, _AGES), text.encode(), ZIP_DEFLATED)
    return {"name": f"{name}.zip", "files": [*texts], "zip": base64.b64encode(packed.getvalue()).decode()}


def _run(command: click.Command, texts: Texts, of: Callable[[Any], Made], *words: str) -> Made:
    """Run a command with these options, and return what `of` makes of its result; `Refused` as on the command line."""
    with refusals():
        known = _options_of(command)
        for name, text in texts.items():
            if name not in known:
                raise ValueError(f"there is no option --{name} of {command.name}")
            if len(text) > _LONGEST:
                raise ValueError(f"--{name} must have at most {_LONGEST} characters, not {len(text)}")
        given = arguments({name: text or None for name, text in texts.items()}, known)
        with command.make_context(f"tachometry {command.name}", [*given, *words]) as context, options_named():
            return of(command.invoke(context))


def _options_of(command: click.Command) -> dict[str, click.Option]:
    with command.make_context(str(command.name), [], resilient_parsing=True) as context:
        return {_name(one): one for one in command.get_params(context) if isinstance(one, Option)}


def _name(one: click.Option) -> str:
    return one.opts[0].removeprefix("--")


def _described(one: Option, context: click.Context) -> Answer:
    _, help = one.get_help_record(context) or ("", "")
    metavar, choices = one.metavar or "", []
    if isinstance(one.type, click.Choice):
        choices = [*one.type.choices]
    elif metavar.startswith("[") and metavar == metavar.lower():
        choices = metavar.strip("[]").split("|")
    default = _DEFAULT.search(help)
    return {
        "name": _name(one),
        "help": _DEFAULT.sub("", help),
        "default": (default[1] or "") if default else "",
        "required": one.required or help.endswith("[required]"),
        "choices": choices,
        "flag": one.is_flag,
        "metavar": "" if choices else metavar.strip("[]").replace("|", " or "),
        "methods": methods_with(_name(one)) if one.group.startswith("Method ") else [],
    }


def _typed(texts: Texts) -> str:
    """Return options as they are typed."""
    words = arguments({name: text or None for name, text in texts.items()}, _options_of(_generate))
    pairs = [(name, text) for name, _, text in (word.partition("=") for word in words)]
    return " ".join(
        name if not text else f"{name}{'=' if text.startswith('-') else ' '}{shlex.quote(text)}" for name, text in pairs
    )


FUNCTIONS: dict[str, Callable[..., Answer]] = {function.__name__: function for function in (options, check, files)}
