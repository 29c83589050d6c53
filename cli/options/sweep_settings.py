"""The settings of a sweep are texts by the names of options, from a file and from the command line."""

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import click

from tachometry.cli.options.motion import tables_of
from tachometry.spec.language.files import read_text
from tachometry.spec.language.option import ParameterError, parse_flag
from tachometry.spec.language.units import CLOCKS, QUANTITY, ratio

Text = str | None  # None: without the option

_RANGE = re.compile(rf"{QUANTITY}\s*\.\.\s*{QUANTITY}\s*:\s*(\d{{1,30}})\s*(log)?")
_MOST = 100_000  # values of an axis
_MOST_TOML = 1 << 20  # bytes
_DIGITS = 4  # of values between the ends of a logarithmic range
_LISTS = ("methods", "axes")


@dataclass
class Settings:
    """Options by their names, without dashes, and axes with their values."""

    fixed: dict[str, str] = field(default_factory=dict)  # texts as on the command line; `yes` or `no` of a flag
    # values of each axis in order; None stands for leaving the option out
    vary: dict[str, list[Text]] = field(default_factory=dict)

    def over(self, other: "Settings") -> "Settings":
        """Return these settings, and from the others what these leave open; axes are in the order of the others."""
        fixed = {name: text for name, text in other.fixed.items() if name not in self.vary}
        vary = {name: values for name, values in other.vary.items() if name not in self.fixed}
        return Settings(fixed | self.fixed, vary | self.vary)

    def first(self) -> dict[str, Text]:
        """Return all options, with the first value of every axis."""
        return self.fixed | {name: values[0] for name, values in self.vary.items()}

    @property
    def axes(self) -> dict[str, list[str]]:
        """The axes with their values as they are shown."""
        return {name: [text or "none" for text in values] for name, values in self.vary.items()}

    @property
    def tables(self) -> list[Path]:
        """The files that the motions read."""
        motions = self.vary.get("motion") or [self.fixed.get("motion")]
        return [table for motion in motions if motion is not None for table in tables_of(motion)]


def of_command_line(raw: Mapping[str, Any], options: Mapping[str, click.Option]) -> Settings:
    """Return settings of what click's parser has found, by the names of its parameters."""
    fixed = {}
    for name, option in options.items():
        if name != "vary" and (given := raw.get(option.name or "")) is not None:
            fixed[name] = _text(given)
    vary: dict[str, list[Text]] = {}
    for text in raw.get("vary") or ():
        name, equals, values = text.partition("=")
        if not equals:
            raise ValueError(f"--vary must be NAME=VALUES, not {text!r}")
        if name.strip() in vary:
            raise ValueError(f"--vary must be given once for {name.strip()}")
        vary[name.strip()] = _values(name.strip(), values.split(","), options)
    return _checked(Settings(fixed, vary))


def of_file(path: Path, options: Mapping[str, click.Option]) -> Settings:
    """Return settings of a TOML file: keys are names of options, and axes stand in its table `vary`.

    It raises ValueError, with the name of the file, if it is not of this form, and OSError if it cannot be read.
    """
    try:
        content = tomllib.loads(read_text(path, _MOST_TOML))
    except RecursionError:
        raise ValueError(f"{path} must be TOML of few levels: it is nested too deeply") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} must be TOML: {error}") from None
    try:
        vary = content.pop("vary", {})
        if not isinstance(vary, dict):
            raise ValueError(f"vary must be a table of axes, not {vary!r}")
        allowed = [name for name in options if name != "vary"]
        for name in content:
            if name not in allowed:
                raise ValueError(f"{name!r} is no key of a sweep: keys must be of {', '.join(allowed)}, and [vary]")
        fixed = {name: _of_toml(name, value) for name, value in content.items()}
        axes = {name: _values(name, _items(name, value), options) for name, value in vary.items()}
        return _checked(Settings(fixed, axes))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def arguments(texts: Mapping[str, Text], options: Mapping[str, click.Option]) -> list[str]:
    """Return these settings as words of a command line."""
    words = []
    for name, text in texts.items():
        option = options[name]
        if text is None:
            continue
        if not option.is_flag:
            words.append(f"{option.opts[0]}={text}")
        elif yes(name, text):
            words.append(option.opts[0])
        else:
            words += option.secondary_opts[:1]
    return words


def yes(name: str, text: str) -> bool:
    """Return what the text of a flag says."""
    return parse_flag(f"--{name}", text)


def _checked(settings: Settings) -> Settings:
    for name in settings.vary:
        if name in settings.fixed:
            raise ParameterError(name, "must be given or varied, not both")
    return settings


def _text(value: Any) -> str:
    return ("no", "yes")[value] if isinstance(value, bool) else str(value)


def _of_toml(name: str, value: Any) -> str:
    if isinstance(value, list) and name in _LISTS:
        return ",".join(_of_toml(name, item) for item in value)
    if not isinstance(value, str | int | float):
        instead = ": a list belongs into [vary]" if isinstance(value, list) else ""
        raise ParameterError(name, f"must be a text, a number, true or false, not {value!r}{instead}")
    return _text(value)


def _items(name: str, value: Any) -> list[str]:
    if isinstance(value, list):
        return [_of_toml(name, item) for item in value]
    return _of_toml(name, value).split(",")


def _values(name: str, items: Iterable[str], options: Mapping[str, click.Option]) -> list[Text]:
    """Return values of an axis: items are values, `none`, or ranges."""
    option = options.get(name)
    values: list[Text] = []
    for item in (item.strip() for item in items):
        if not item:
            raise ValueError(f"values of {name} must be separated by one comma, and none may be empty")
        if match := _RANGE.fullmatch(item):
            values += _range(name, item, match, whole=option is not None and not getattr(option, "fractional", False))
        elif re.match(rf"{QUANTITY}\s*\.\.", item):
            raise ValueError(f"a range of {name} must be LO..HI:N, or LO..HI:Nlog, not {item!r}")
        else:
            values.append(None if item == "none" and option is not None else item)
    if not values:
        raise ParameterError(name, "must have values to be varied")
    if len(values) > _MOST:
        raise ParameterError(name, f"must have at most {_MOST} values, not {len(values)}")
    return list(dict.fromkeys(values))


def _range(name: str, item: str, match: re.Match[str], whole: bool) -> list[str]:
    """Return values from LO to HI, evenly or logarithmically spaced; whole ones between plain whole numbers."""
    low, high, count, log = Fraction(match[1]), Fraction(match[3]), int(match[5]), match[6]
    unit = match[2] or match[4]
    if match[4] != unit:
        factor = ratio(unit, match[4])
        if factor is None:
            raise ValueError(f"a range of {name} must have one unit, not {item!r}")
        high *= factor
    if not 2 <= count <= _MOST:
        raise ValueError(f"a range of {name} must have 2 to {_MOST} values, not {item!r}")
    if low >= high or (log and low <= 0):
        raise ValueError(f"a range of {name} must go up{', from more than 0' * bool(log)}, not {item!r}")
    try:
        step = float(high / low) if log else 1.0
        _ = float(low), float(high)
    except OverflowError:
        raise ValueError(
            f"a range of {name} must be of numbers, and factors between, below 1e308, not {item!r}"
        ) from None
    if log:
        inner = [Fraction(f"{float(low) * step ** (k / (count - 1)):.{_DIGITS}g}") for k in range(1, count - 1)]
    else:
        inner = [low + (high - low) * k / (count - 1) for k in range(1, count - 1)]
    every = [low, *inner, high]
    if whole and unit in ("", CLOCKS) and low.denominator == high.denominator == 1:
        every = [Fraction(round(value)) for value in every]
    return [f"{_decimal(value)}{unit}" for value in every]


def _decimal(value: Fraction) -> str:
    return str(value.numerator) if value.denominator == 1 else f"{float(value):.9g}"
