"""Options of cores of many axes."""

from typing import Any

from tachometry.cli.options.core import Part
from tachometry.cli.options.option import option
from tachometry.spec import CoreSpec, ParameterError, with_axes
from tachometry.spec.methods.axis import MAX_AXES

_AXES = "Axes"

_PARALLEL = "Add held outputs for each axis (with --axes). A --bus and --for rio add them as well."


_OPTIONS = [
    option(
        _AXES,
        "--axes N",
        type=int,
        help=f"Measure N encoders, up to {MAX_AXES}, with one datapath in turn. Its method is s or track. a and b "
        "have N bits, and results come with the number of their axis.",
    ),
    option(_AXES, "--parallel", is_flag=True, help=_PARALLEL),
]


def _take(given: dict[str, Any]) -> Any:
    axes, parallel = given.pop("axes"), given.pop("parallel")
    if axes is None and parallel:
        raise ParameterError("parallel", "must be given together with --axes")

    def within(spec: CoreSpec) -> CoreSpec:
        return spec if axes is None else with_axes(spec.tachometer, axes, parallel=parallel)

    return within


AXES = Part(_OPTIONS, _take)
"""The core is of many axes, if there are to be many."""
