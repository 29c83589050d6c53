"""Options of cores with a control loop."""

from typing import Any

from tachometry.cli.options.option import Group, declared, option, take_texts
from tachometry.spec import CoreSpec, ParameterError
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.language.option import options_of, read_options

_LOOP = "Loop"


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


def _read(*, spec: CoreSpec, loop: bool, **others: Any) -> dict[str, Any]:
    texts = take_texts(LoopSpec, others)
    return dict(spec=of_loop(spec, texts) if loop else _alone(spec, texts), **others)


LOOP_OPTIONS = Group(_OPTIONS, _read)
"""Below those of the axes: `spec` is that of a core with a control loop, if there is to be one."""


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
    if spec.axes is not None:
        raise ParameterError("axes", "must not be given together with --loop: it is of one axis")
    return LoopSpec(tachometer=spec.tachometer, **read_options(LoopSpec, texts, vars(spec.timing)))
