"""Options: what can be wrong with a parameter, defaults that follow from other parameters, and how texts are read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import Field, field, fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tachometry.spec.timing import Timing


class ParameterError(ValueError):
    """A parameter is not what it must be; the message begins with the parameter, "max_ticks must be …".

    Parameters
    ----------
    parameter : str
        Name of the field, or of the option that was read; the command line shows its option in its place.
    rest : str
        The message behind the name.
    """

    def __init__(self, parameter: str, rest: str) -> None:
        super().__init__(parameter, rest)
        self.parameter = parameter
        self.rest = rest

    def __str__(self) -> str:
        return f"{self.parameter} {self.rest}"


def option(
    default: Any,
    help: str,
    *,
    name: str | None = None,
    metavar: str | None = None,
    choices: Sequence[str] = (),
    parse: Callable[[str, Timing], Any] | None = None,
) -> Any:
    """A field with its option: what `--help` says of it, and how its text is read.

    Parameters
    ----------
    default : bool, int, str or None
    help : str
    name : str or None
        Of the option, without dashes; None: that of the field. Of two methods' fields with one name it is one option.
    metavar : str or None
    choices : sequence of str
    parse : callable or None
        Makes the value of the text, given the timing; None: the text, or an int if the default is one.
    """
    metadata = {"help": help, "name": name, "metavar": metavar, "choices": choices, "parse": parse}
    return field(default=default, metadata={"option": metadata})


def options_of(spec: type[Any]) -> list[Field[Any]]:
    """Fields of a spec that are options of its method."""
    return [item for item in fields(spec) if "option" in item.metadata]
