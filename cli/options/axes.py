"""Options of cores of many axes."""

from typing import Any

from tachometry.cli.options.option import Group, option
from tachometry.spec import ParameterError, TachometerSpec, with_axes
from tachometry.spec.methods.axis import MAX_AXES

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


def _read(*, spec: TachometerSpec, axes: int | None, parallel: bool, **others: Any) -> dict[str, Any]:
    if axes is None and parallel:
        raise ParameterError("parallel", "must be given together with --axes")
    return dict(spec=spec if axes is None else with_axes(spec, axes, parallel=parallel), **others)


AXES_OPTIONS = Group(_OPTIONS, _read)
"""Below the options of the core: `spec` is that of many axes, if there are to be many."""
