"""Options: fields of a spec that say how they are named, read, explained and tested."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from fractions import Fraction
from functools import cache
from types import MappingProxyType
from typing import Any

_YES = frozenset(("yes", "y", "true", "t", "on", "1"))
_NO = frozenset(("no", "n", "false", "f", "off", "0"))
_MOST_DIGITS = 20

REQUIRED: Any = MISSING  # default of an option that must be given


class ParameterError(ValueError):
    """A parameter is not what it must be; the message begins with the parameter, "max_ticks must be …".

    - `rest`: The message behind the name.
    - `brief`: Why, in a few words behind the name of a method that another one is taken for; empty: the message.
    - `refused`: The spec, if this is all that is wrong with it; what is made of it may say better what is allowed.
    """

    def __init__(self, parameter: str, rest: str, brief: str = "", refused: Any = None) -> None:
        super().__init__(parameter, rest)
        self.refused, self.parameter, self.rest = refused, parameter, rest
        self.brief = brief or f"refuses: {self}"

    def __str__(self) -> str:
        return f"{self.parameter} {self.rest}"

    @staticmethod
    def longer(error: ValueError, more: str) -> ValueError:
        """Return this error with more text at the end of its message."""
        if isinstance(error, ParameterError):
            return ParameterError(error.parameter, error.rest + more)
        return ValueError(f"{error}{more}")


def parse_flag(what: str, text: str) -> bool:
    """Return whether a text says yes."""
    if (word := text.strip().lower()) not in _YES | _NO:
        raise ParameterError(what, f"must be yes or no, not {text!r}")
    return word in _YES


def parse_whole(what: str, text: str) -> int:
    """Return a whole number."""
    if len(text) <= _MOST_DIGITS and re.fullmatch(r"\s*[-+]?\d+(_\d+)*\s*", text, re.ASCII):
        return int(text)
    plain = re.sub(r"(?<=\d),(?=\d{3}\b)|(?<=\d)\s*[a-zA-Z]+$", "", text)
    typed = f": type {plain}" if plain != text and re.fullmatch(r"\d{1,30}", plain, re.ASCII) else ""
    raise ParameterError(what, f"must be a whole number{typed}, not {text!r}")


@dataclass(frozen=True)
class Option:
    """An option of the command line, of sweeps and of files: how a field of a spec is given as a text."""

    help: str  # a sentence for `--help`
    # without dashes; empty: that of the field. Fields of several methods that have one name are one option.
    name: str = ""
    metavar: str | None = None
    unit: str = ""  # what the field's number counts: `clocks`, `ticks` or `rad/s`
    group: str = ""  # heading in `--help`; empty: `_group` of the class, or Core
    choices: tuple[str, ...] = ()  # all texts that it takes; empty: others
    limits: tuple[int, int] | None = None  # the least number that it may be, and the greatest
    shown: str | None = None  # the default, as `--help` shows it
    # makes the value from the name of the option in messages, and from the text
    parse: Callable[[str, str], Any] = lambda what, text: text
    # makes it instead, of a text that says nothing without other options: its third argument is what is known of the
    # fields of the same class and of `Timing`
    parse_at: Callable[[str, str, Mapping[str, Any]], Any] | None = None
    text: str | None = None  # the default, if it is read as it would be if it were given
    # makes the value of a default instead of `parse_at`: what nobody has typed must fit the other options
    fit_at: Callable[[str, str, Mapping[str, Any]], Any] | None = None
    flag: bool = False  # whether it stands alone, for yes
    needs: str = ""  # name of the flag that must be given with it
    adds: bool = False  # whether this option of an extra adds it, as the first one does
    fits: Callable[[type[Any]], bool] | None = None  # whether the spec of a method has the option; None: always
    # values that pairwise tests use, the empty text for leaving it out; see `sim.studies.pairs` for those in words.
    # None: both values of a flag, all choices, else no values.
    tests: tuple[str, ...] | None = None
    few: int = 2  # for a method that hardly depends on the option, the first so many of these values are enough
    tacit: bool = False  # whether manifests say nothing of it where it has its default
    # for a flag whose field is None or an object of this class: the fields of that are options that need the flag
    part: type[Any] | None = None
    field: str = ""  # name of the field; set by `options_of`
    default: Any = None  # default of the field; set by `options_of`
    within: tuple[str, ...] = ()  # the field of a part, and the one of its own in that; set by `options_of`
    extra: type[Any] | None = None  # the class of `spec.core.extras` whose field it is; set by `options_of`

    @property
    def parameter(self) -> str:
        """The name of the option in messages."""
        return self.name.replace("-", "_")

    @property
    def required(self) -> bool:
        """Whether it must be given."""
        return self.default is MISSING and self.text is None

    @property
    def fractional(self) -> bool:
        """Whether it takes plain numbers that are not whole."""
        return isinstance(self.default, Fraction | float)

    @property
    def tested(self) -> tuple[str, ...]:
        """Values that pairwise tests use."""
        if self.tests is not None:
            return self.tests
        if self.flag:
            return ("", "no" if self.default is True else "yes")
        return tuple("" if choice == self.default else choice for choice in self.choices)

    def fits_in(self, spec: Any) -> bool:
        """Return whether a spec, or its class, has the option."""
        return self.fits is None or self.fits(spec)

    def value_in(self, spec: Any) -> Any:
        """Return its value in a spec, or in what has some of its options."""
        if self.within:
            part = self.extra.of(spec.extras) if self.extra else getattr(spec, self.within[0])
            return self.default if part is None else getattr(part, self.within[1])
        value = getattr(spec, self.field)
        return value is not None if self.part else value

    def canonical(self, value: Any) -> Any:
        """Return a value of the field for a manifest."""
        if isinstance(value, Fraction):
            return f"{float(value)!r}{self.unit}" if self.unit else float(value)
        return value if isinstance(value, bool | int | str | None) else str(value)

    def written(self, value: Any) -> str:
        """Return a text that is read as this value."""
        if isinstance(value, bool):
            return ("no", "yes")[value]
        return str(getattr(self.parse_at or self.parse, "written", str)(value))


def option(default: Any, help: str, *, text: str | None = None, also: tuple[Option, ...] = (), **about: Any) -> Any:
    """Return a field that is an option.

    - `default`: Default of the field; with a text, None for that of the text, or `REQUIRED` where only `read_options`
      has one.
    - `text`: The default as a text, read as it would be if it were given.
    - `**about`: See `Option`. Without `parse`, the kind of the default tells how the text is read.
    """
    if isinstance(default, bool) or "part" in about:
        about.update(flag=True, parse=parse_flag)
    elif type(default) is int:
        about = {"parse": parse_whole} | about
    main = Option(help, shown=about.pop("shown", text), text=text, **about)
    if text is not None and default is not REQUIRED:
        default = main.parse(main.parameter, text)
    elif main.shown is None and type(default) in (int, str):
        main = replace(main, shown=str(default))
    return field(default=default, metadata={"options": (main, *also)})


def options_of(spec: Any) -> tuple[Option, ...]:
    """Return options of the fields of a class, in order."""
    return _declared(spec)


@cache
def _declared(spec: Any) -> tuple[Option, ...]:
    return tuple(about for item in fields(spec) for about in _of_field(spec, item))


def _of_field(spec: Any, item: Field[Any]) -> Iterator[Option]:
    for extra in item.metadata.get("extras", ()):
        main, *more = options_of(extra)
        yield replace(
            main, field=main.parameter, default=False if main.flag else None, within=("", main.field), extra=extra
        )
        for one in more:
            yield replace(
                one, needs="" if one.adds else main.name, field=one.parameter, within=("", one.field), extra=extra
            )
    options = item.metadata.get("options", ())
    for about in options:
        name = about.name or item.name.replace("_", "-")
        own: dict[str, Any] = {"group": about.group or getattr(spec, "_group", "Core"), "text": options[0].text}
        yield replace(about, name=name, field=item.name, default=False if about.part else item.default, **own)
        for one in options_of(about.part) if about.part else ():
            yield replace(one, needs=name, field=one.parameter, within=(item.name, one.field))


def check_options(spec: Any) -> None:
    """Check what options of a spec are, by their choices and limits; ParameterError names the first that is wrong."""
    for about in options_of(type(spec)):
        if (value := about.value_in(spec)) is None:
            continue
        if about.choices and value not in about.choices:
            listed = " or ".join(about.choices) if len(about.choices) == 2 else f"one of {', '.join(about.choices)}"
            raise ParameterError(about.parameter, f"must be {listed}, not {value!r}")
        if about.limits and not about.limits[0] <= value <= about.limits[1]:
            least, most = about.limits
            raise ParameterError(about.parameter, f"must be from {least} to {most}, not {value}")


def read_options(
    spec: type[Any],
    texts: Mapping[str, str],
    timing: Mapping[str, Any] = MappingProxyType({}),
    usual: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, Any]:
    """Return values of the fields of a class, from the texts that are given for its options.

    - `texts`: By the names of the options.
    - `timing`: What is known of the fields of `Timing`, for texts that say nothing without.
    - `usual`: Defaults in place of those of the options, by their names.

    It raises ParameterError if a text cannot be read, two options for one field are given, or one is missing.
    """
    given: dict[str, Option] = {}
    for about in (one for one in options_of(spec) if one.name in texts):
        if about.needs and texts.get(about.needs, "no").strip().lower() in _NO:
            raise ParameterError(about.parameter, f"must be given together with --{about.needs}")
        if other := given.get(about.field):
            raise ParameterError(about.parameter, f"must not be given together with --{other.name}")
        given[about.field] = about
    read: dict[str, Option] = {}
    for about in options_of(spec):
        if about.required and about.field not in given and about.extra is None:
            others = [f", or --{one.name}" for one in options_of(spec) if one.field == about.field and one is not about]
            raise ParameterError(about.parameter, f"must be given{''.join(others)}")
        if about.field in given or about.text is not None:
            read.setdefault(about.field, given.get(about.field, about))
    known = {about.field: about.default for about in options_of(spec)} | dict(timing)
    values: dict[str, Any] = {}
    for about in sorted(read.values(), key=lambda one: one.parse_at is not None):  # which needs what others say
        text = texts.get(about.name, usual.get(about.name, about.text or ""))
        text = next((choice for choice in about.choices if choice.lower() == text.strip().lower()), text)
        if about.parse_at is None:
            values[about.field] = about.parse(about.parameter, text)
        else:
            read_at = about.fit_at if about.fit_at and about.name not in texts else about.parse_at
            values[about.field] = read_at(about.parameter, text, {**known, **values})
    return _grouped(spec, values)


def _grouped(spec: type[Any], values: dict[str, Any]) -> dict[str, Any]:
    """Return values of fields: those of an extra, and of a part, are one value."""
    extras: dict[type[Any], dict[str, Any]] = {}
    for about in options_of(spec):
        if about.extra and about.field in values:
            value = values.pop(about.field)
            if not (about.flag and not about.needs and value is False):  # which asks for none
                extras.setdefault(about.extra, {})[about.within[1]] = value
    if extras:
        values["extras"] = tuple(extra(**given) for extra, given in extras.items())
    for part in (about for about in options_of(spec) if about.part and about.field in values):
        own = [about for about in options_of(spec) if about.within[:1] == (part.field,) and about.field in values]
        made = {about.within[1]: values.pop(about.field) for about in own}
        values[part.field] = part.part(**made) if values[part.field] and part.part else None
    return values
