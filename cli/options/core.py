"""Options of the core: what all methods share, and what each has of its own, as spec/ declares them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial, reduce
from typing import Any

import click
from click.core import ParameterSource

from tachometry.cli.options.option import RESEARCH, Group, Option, default_of, kind_of, later, option
from tachometry.sim.studies.estimate import FAMILIES
from tachometry.spec import (
    AUTO,
    METHODS,
    ParameterError,
    TachometerSpec,
    Timing,
    common_options,
    methods_with,
    of_texts,
    own_options,
)
from tachometry.spec.language import option as declaration
from tachometry.spec.language.option import options_of
from tachometry.spec.language.units import parse_frequency
from tachometry.spec.registers.buses import BUSES

_PREFIX = "core_"
_CLOCK = "clock"

Texts = dict[str, str]  # of options, by their names without dashes
Make = Callable[[str, Mapping[str, str]], TachometerSpec]


def _methods_help() -> str:
    each = "; ".join(f"{name} {spec.facts.summary}" for name, spec in METHODS.items())
    return (
        f"Method of the velocity measurement. {each}. auto is track where its program fits the tick, else mt, else s; "
        "the choice is printed. Methods that lack a given option are skipped."
    )


_METHOD = option(
    "Core", "--method", default=AUTO, metavar=lambda: f"[{'|'.join((AUTO, *METHODS))}]", help=_methods_help
)


def _common(clock: str | None = None) -> tuple[click.Option, ...]:
    """Return what all methods have; `clock` is what help says of the clock's default, where it is that of a board."""
    every = common_options()
    if clock is not None:
        every = tuple(replace(about, shown=clock) if about.name == _CLOCK else about for about in every)
    return _made_common(every)


@cache
def _made_common(declared: tuple[declaration.Option, ...]) -> tuple[click.Option, ...]:
    return tuple(
        Option(
            [f"--{about.name}", _argument(about.name)],
            group=about.group,
            help=(about.help if about.flag else about.help + default_of(about)) + _otherwise(about.name),
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


_RESEARCH = {"paper-exact", "cancel", "reciprocal", "adaptive", "whole-cycles", "bound-decay"}


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
    group = RESEARCH if name in _RESEARCH else f"Method {' and '.join(method for method, _ in by_method)}"
    return Option(words, group=group, default=None, help=help_, **kind)


def _argument(name: str) -> str:
    """Return what click calls the value of an option of the core."""
    return _PREFIX + name.replace("-", "_")


def own_texts(method: str, words: list[str]) -> Texts:
    """Return options of a method from words such as `average=8` or `cancel=no`, by their names."""
    own = [] if method == AUTO else [about.name for about in own_options(method)]
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


@dataclass(frozen=True)
class Part:
    """Options of what a core of one axis may be made into."""

    options: Sequence[Callable[[Any], Any]]  # see `Group`
    # takes the options out of what click gives a command, and gives what makes of a core what it is for
    take: Callable[[dict[str, Any]], Callable[[Any], Any]]


def _read_make(**given: Any) -> dict[str, Any]:
    texts = _with_tick(_taken(given))
    return dict(make=lambda method, own: of_texts(method, texts | own), sensor=texts.get("sensor"), **given)


def _read_spec_and_make(parts: Sequence[Part], *, method: str, **given: Any) -> dict[str, Any]:
    texts = _taken(given)
    read = _reader(parts)(method=method, **{f"{_PREFIX}{name}": text for name, text in texts.items()}, **given)
    common = {name: text for name, text in texts.items() if not methods_with(name)}
    common = _with_tick(common, read["spec"].options["tick"])
    return dict(make=lambda other, own: of_texts(other, common | own), **read)


def _with_tick(texts: Texts, tick: str = "20us") -> Texts:
    """Return options with a tick that all methods have alike."""
    given = any(about.name in texts for about in options_of(Timing) if about.field == "tick_cycles")
    return texts if given else {**texts, "tick": tick}


def _reader(parts: Sequence[Part]) -> Callable[..., dict[str, Any]]:
    """Return what reads the options of a core, of a board if there is one, and of what it is made into."""

    def read(*, method: str, **given: Any) -> dict[str, Any]:
        texts, steps = _taken(given), [part.take(given) for part in parts]
        if (board := given.get("board")) is not None:
            texts = _at(texts, board.clock_hz, ": there is no PLL")

        def build_core(spec: TachometerSpec) -> Any:
            return reduce(lambda core, step: step(core), steps, spec)

        return dict(spec=build_core(of_texts(method, texts, build_core)), **given)

    return read


def _at(texts: Texts, clock_hz: int, why: str = "") -> Texts:
    """Return options with the clock of a board, which none may contradict."""
    text = texts.get(_CLOCK)
    if text is not None and parse_frequency(_CLOCK, text) != clock_hz:
        raise ParameterError(_CLOCK, f"must be that of the board, {clock_hz} Hz, not {text}{why}")
    return {**texts, _CLOCK: parse_frequency.written(clock_hz)}


@dataclass(frozen=True)
class CoreTexts:
    """Options of a core that may have been given."""

    method: str
    texts: Texts  # by the names of the options without dashes
    given: bool  # whether there is any

    def at(self, clock_hz: int) -> TachometerSpec:
        """Return the core, at the clock of a board; ParameterError if an option is wrong, or missing."""
        return of_texts(self.method, _at(self.texts, clock_hz))


def _read_core(*, method: str, **given: Any) -> dict[str, Any]:
    texts = _taken(given)
    source = click.get_current_context().get_parameter_source("method")
    return dict(core=CoreTexts(method, texts, bool(texts) or source is ParameterSource.COMMANDLINE), **given)


def _of_core(clock: str | None = None) -> list[Callable[[Any], Any]]:
    return [later("core-options", partial(_common, clock)), _METHOD, later("method-options", own_click_options)]


def core_options(*parts: Part, clock: str | None = None) -> Group:
    """Return options of the core, and of what it may be made into, handed to the command as one argument `spec`."""
    return Group(_with_parts(parts, clock), _reader(parts))


def _with_parts(parts: Sequence[Part], clock: str | None = None) -> list[Callable[[Any], Any]]:
    return [*_of_core(clock), *(one for part in parts for one in part.options)]


def core_and_make_options(*parts: Part) -> Group:
    """As `core_options`, with what makes a spec of another method as `make`, see `COMMON_CORE_OPTIONS`."""
    return Group(_with_parts(parts), partial(_read_spec_and_make, parts))


COMMON_CORE_OPTIONS = Group([later("core-options", _common)], _read_make)
"""What all methods share, handed over as `make`: of a method's name and texts of its own options it makes a spec."""


def board_core_options(*parts: Part) -> Group:
    """Return those of a command that is given a `board`, whose clock is that of the core."""
    return core_options(*parts, clock="that of the board, and it cannot be another")


OPTIONAL_CORE_OPTIONS = Group(_of_core("that of the board"), _read_core)
"""As `core_options`, but none must be given; handed over as `core`, of `CoreTexts`."""


_CAPTURED = ("ppr", "lines", "cpr", "pole-pairs", "decoding", "sensor", "reverse", "invert", "index", "index-at")


CAPTURED_OPTIONS = Group(
    [later("encoder-options", lambda: _made_common(tuple(one for one in common_options() if one.name in _CAPTURED)))],
    lambda **given: dict(spec=of_texts("s", _taken(given)), **given),
)
"""What captured lines must be known of, handed over as `spec`; all else of it does not matter."""


def core_click_options() -> dict[str, click.Option]:
    """Return all options of cores and methods by their names."""
    return {option.opts[0].removeprefix("--"): option for option in (*_common(), *own_click_options())}


BUS = option(
    "Files",
    "--bus",
    type=click.Choice(["none", *BUSES], case_sensitive=False),
    help="Registers of the core on a bus. "
    + "; ".join(f"{bus.name}: {bus.help}" for bus in BUSES.values())
    + ". Files that describe and read the registers are written, too. Without it there is no bus, or that of "
    "--for.",
)

FAMILY = option(
    "Files",
    "--family",
    type=click.Choice([*FAMILIES], case_sensitive=False),
    default="ecp5",
    help="FPGA family of the estimated cells and greatest clock. "
    + ", ".join(f"{name} for {family.title}" for name, family in FAMILIES.items())
    + ". Nothing that is written depends on it.",
)
"""Handed over as the name of the family."""

_BAUD = """Bits a second of --bus uart, 1000000 without it. The clock must make them within 2 %, with at least 8 \
clocks a bit."""


BAUD = option("Files", "--baud BITS", type=click.IntRange(min=1), help=_BAUD)
