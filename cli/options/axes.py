"""Options of cores of many axes."""

import functools
from collections.abc import Callable
from typing import Any

from tachometry.cli.options.option import all_of, option
from tachometry.spec import AxesSpec, ParameterError, STachometer, TachometerSpec
from tachometry.spec.methods.axes import MAX_AXES

_AXES = "Axes"

_OPTIONS = [
    option(
        _AXES,
        "--axes",
        type=int,
        metavar="N",
        help=f"Measure N encoders, up to {MAX_AXES}, with one datapath of method s: a and b have N bits, and what is "
        "measured comes with the number of its axis. Without it: one encoder, and no such number.",
    ),
    option(_AXES, "--parallel", is_flag=True, help="With --axes: outputs for each axis, which hold its values."),
]


def axes_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a command, below that of the options of the core: `spec` is that of many axes, if there are to be
    many.
    """

    @functools.wraps(command)
    def build(*, spec: TachometerSpec, axes: int | None, parallel: bool, **others: Any) -> Any:
        if axes is None:
            if parallel:
                raise ParameterError("parallel", "must be given together with --axes")
            return command(spec=spec, **others)
        return command(spec=of_axes(spec, axes, parallel), **others)

    return all_of(_OPTIONS, build)


def of_axes(spec: TachometerSpec, axes: int, parallel: bool) -> AxesSpec:
    """Return a core of so many axes, each of which is as `spec`.

    Raises
    ------
    ParameterError
        If there cannot be such a core.
    """
    if not isinstance(spec, STachometer):
        raise ParameterError("method", f"must be s together with --axes, not {spec.method}")
    return AxesSpec(tachometer=spec, axes=axes, parallel=parallel)
