"""Options of cores with a control loop."""

import functools
from collections.abc import Callable, Mapping
from typing import Any

from tachometry.cli.options.option import all_of, option
from tachometry.spec import AxesSpec, CoreSpec, ParameterError
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.language.option import Option, options_of, read_options

_LOOP = "Loop"


def declared(group: str, about: Option) -> Callable[[Any], Any]:
    """Return the option of the command line for one of a loop."""
    if about.flag:
        return option(group, f"--{about.name}/--no-{about.name}", default=None, help=f"{about.help} {_default(about)}")
    metavar = about.metavar or f"[{'|'.join(about.choices)}]"
    return option(
        group,
        f"--{about.name}",
        metavar=metavar,
        fractional=about.fractional,
        help=f"{about.help} {_default(about)}",
    )


def _default(about: Option) -> str:
    return f"[default: {about.name if about.flag else about.shown}]"


_OPTIONS = [
    option(
        _LOOP,
        "--loop",
        is_flag=True,
        help="Add a disturbance observer and a controller of position and velocity, with commands as inputs and the "
        "current as output.",
    ),
    *(declared(_LOOP, about) for about in options_of(LoopSpec)),
]


def texts_of(spec: type[Any], given: Mapping[str, str | bool | None]) -> dict[str, str]:
    """Return the texts of the options of a class, by their names, from what the command line has by parameters."""
    values = {about.name: given[about.parameter] for about in options_of(spec)}
    return {
        name: ("no", "yes")[value] if isinstance(value, bool) else value
        for name, value in values.items()
        if value is not None
    }


def loop_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a command, below that of the axes: `spec` is that of a core with a control loop, if there is to be
    one.
    """

    @functools.wraps(command)
    def build(*, spec: CoreSpec, loop: bool, **others: Any) -> Any:
        texts = texts_of(LoopSpec, {about.parameter: others.pop(about.parameter) for about in options_of(LoopSpec)})
        return command(spec=of_loop(spec, texts) if loop else _alone(spec, texts), **others)

    return all_of(_OPTIONS, build)


def _alone(spec: CoreSpec, texts: dict[str, str]) -> CoreSpec:
    for name in texts:
        raise ParameterError(name.replace("-", "_"), "must be given together with --loop")
    return spec


def of_loop(spec: CoreSpec, texts: dict[str, str]) -> AnySpec:
    """Return a core with a control loop, from texts of its options by their names.

    Raises
    ------
    ParameterError
        If there cannot be such a core.
    """
    if isinstance(spec, AxesSpec):
        raise ParameterError("axes", "must not be given together with --loop: it is of one axis")
    return LoopSpec(tachometer=spec, **read_options(LoopSpec, texts))
