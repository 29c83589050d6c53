"""Options of the core: what all methods share, and what each has of its own, as spec/ declares them."""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import click
from click.core import ParameterSource

from tachometry.cli.options.option import Group, Option, default_of, kind_of, later, option
from tachometry.spec import (
    METHODS,
    ParameterError,
    TachometerSpec,
    common_options,
    methods_with,
    of_texts,
    own_options,
)
from tachometry.spec.language import option as declaration
from tachometry.spec.language.units import parse_frequency

_PREFIX = "core_"
_CLOCK = "clock"

Texts = dict[str, str]  # of options, by their names without dashes
Make = Callable[[str, Mapping[str, str]], TachometerSpec]


def _methods_help() -> str:
    return f"How velocity is measured: {'; '.join(f'{name} {spec.facts.summary}' for name, spec in METHODS.items())}."


_METHOD = option("Core", "--method", default="s", metavar=lambda: f"[{'|'.join(METHODS)}]", help=_methods_help)


def _common() -> tuple[click.Option, ...]:
    return _made_common(common_options())


@cache
def _made_common(declared: tuple[declaration.Option, ...]) -> tuple[click.Option, ...]:
    return tuple(
        Option(
            [f"--{about.name}", _argument(about.name)],
            group=about.group,
            help=(about.help if about.flag else about.help + default_of(about)) + _otherwise(about.name),
            required=about.required,
            **kind_of(about),
        )
        for about in declared
    )


def _otherwise(name: str) -> str:
    """Return what `--help` says of the methods that have a common option in another way."""
    own = {method: about for method in METHODS for about in own_options(method) if about.name == name}
    return "".join(f" Method {method}: {about.help}{default_of(about)}" for method, about in own.items())


def own_click_options() -> Sequence[click.Option]:
    """Return the options that not all methods have; without defaults, so that it is seen where they do not belong."""
    declarations: dict[str, dict[str, declaration.Option]] = {}
    common = {about.name for about in common_options()}
    for method in METHODS:
        for about in own_options(method):
            if about.name in common:  # whose help says so
                continue
            declarations.setdefault(about.name, {})[method] = about
    return tuple(_made_own(name, tuple(by_method.items())) for name, by_method in declarations.items())


@cache
def _made_own(name: str, by_method: tuple[tuple[str, declaration.Option], ...]) -> click.Option:
    """Return the option of one or several methods: if they say different things of it, its help has all of them."""
    about = by_method[0][1]
    alike = len({default_of(one) for _, one in by_method}) == 1
    helps: dict[str, list[str]] = {}
    for method, one in by_method:
        helps.setdefault(one.help + default_of(one) * (not alike), []).append(method)
    help_ = " ".join(f"{', '.join(methods)}: {text}" if len(helps) > 1 else text for text, methods in helps.items())
    help_ += default_of(about) * alike
    words = [f"--{name}/--no-{name}" if about.flag else f"--{name}", _argument(name)]
    kind = {} if about.flag else kind_of(about)
    group = f"Method {' and '.join(method for method, _ in by_method)}"
    return Option(words, group=group, default=None, help=help_, **kind)


def _argument(name: str) -> str:
    """Return what click calls the value of an option of the core."""
    return _PREFIX + name.replace("-", "_")


def own_texts(method: str, words: list[str]) -> Texts:
    """Return options of a method from words such as `average=8` or `cancel=no`, by their names."""
    own = [about.name for about in own_options(method)]
    given: Texts = {}
    for word in words:
        name, _, text = word.partition("=")
        if name not in own:
            raise ValueError(f"options of method {method} must be of {', '.join(own) or 'none'}, not {name!r}")
        given[name] = text
    return given


def _taken(given: dict[str, Any]) -> Texts:
    """Take the options of the core out of what click gives a command, as texts."""
    texts: Texts = {}
    for argument in [name for name in given if name.startswith(_PREFIX)]:
        name, value = argument.removeprefix(_PREFIX).replace("_", "-"), given.pop(argument)
        if value is None or (value is False and not methods_with(name)):
            continue  # a flag without a form for no
        texts[name] = ("no", "yes")[value] if isinstance(value, bool) else value
    return texts


def _read_make(**given: Any) -> dict[str, Any]:
    texts = _taken(given)
    return dict(make=lambda method, own: of_texts(method, texts | own), **given)


def _read_spec_and_make(*, method: str, **given: Any) -> dict[str, Any]:
    texts = _taken(given)
    common = {name: text for name, text in texts.items() if not methods_with(name)}
    return dict(spec=of_texts(method, texts), make=lambda other, own: of_texts(other, common | own), **given)


def _read_spec(*, method: str, **given: Any) -> dict[str, Any]:
    texts = _taken(given)
    return dict(spec=of_texts(method, texts), **given)


def _read_spec_of_board(*, method: str, board: Any, **given: Any) -> dict[str, Any]:
    texts = _taken(given)
    text = texts.pop(_CLOCK, None)
    if text is not None and parse_frequency(_CLOCK, text) != board.clock_hz:
        raise ParameterError(_CLOCK, f"must be that of the board, {board.clock_hz} Hz, not {text}: there is no PLL")
    return dict(spec=of_texts(method, {**texts, _CLOCK: str(board.clock_hz)}), board=board, **given)


def _common_of_board() -> tuple[click.Option, ...]:
    declared = common_options()
    return _made_common(
        tuple(
            replace(about, shown="that of the board, and it cannot be another") if about.name == _CLOCK else about
            for about in declared
        )
    )


@dataclass(frozen=True)
class CoreTexts:
    """Options of a core that may have been given.

    Parameters
    ----------
    method : str
    texts : mapping of str to str
        By the names of the options without dashes.
    given : bool
        Whether there is any.
    """

    method: str
    texts: Texts
    given: bool

    def at(self, clock_hz: int) -> TachometerSpec:
        """Return the core, at the clock of a board.

        Raises
        ------
        ParameterError
            If an option is wrong, or missing.
        """
        text = self.texts.get(_CLOCK)
        if text is not None and parse_frequency(_CLOCK, text) != clock_hz:
            raise ParameterError(_CLOCK, f"must be that of the board, {clock_hz} Hz, not {text}")
        return of_texts(self.method, {**self.texts, _CLOCK: str(clock_hz)})


def _read_core(*, method: str, **given: Any) -> dict[str, Any]:
    texts = _taken(given)
    source = click.get_current_context().get_parameter_source("method")
    return dict(core=CoreTexts(method, texts, bool(texts) or source is ParameterSource.COMMANDLINE), **given)


def _common_optional() -> tuple[click.Option, ...]:
    options = _made_common(
        tuple(
            replace(about, shown="that of the board") if about.name == "clock" else about for about in common_options()
        )
    )
    return tuple(_not_required(option) for option in options)


def _not_required(option: click.Option) -> click.Option:
    option = copy(option)
    option.required = False
    return option


_OWN = later("method-options", own_click_options)

CORE_OPTIONS = Group([later("core-options", _common), _METHOD, _OWN], _read_spec)
"""The options of the core, handed to the command as one argument `spec`."""

CORE_AND_MAKE_OPTIONS = Group(CORE_OPTIONS.options, _read_spec_and_make)
"""As `CORE_OPTIONS`, with what makes a spec of another method as `make`, see `COMMON_CORE_OPTIONS`."""

COMMON_CORE_OPTIONS = Group([later("core-options", _common)], _read_make)
"""What all methods share, handed over as `make`: of a method's name and texts of its own options it makes a spec."""

BOARD_CORE_OPTIONS = Group([later("core-options", _common_of_board), _METHOD, _OWN], _read_spec_of_board)
"""As `CORE_OPTIONS`, of a command that is given a `board`, whose clock is that of the core."""

OPTIONAL_CORE_OPTIONS = Group([later("core-options", _common_optional), _METHOD, _OWN], _read_core)
"""As `CORE_OPTIONS`, but none must be given; handed over as `core`, of `CoreTexts`."""


def core_click_options() -> dict[str, click.Option]:
    """Return all options of cores and methods by their names."""
    return {option.opts[0].removeprefix("--"): option for option in (*_common(), *own_click_options())}
