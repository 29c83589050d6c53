"""Options of cores with a control loop."""

from typing import Any

from tachometry.cli.options.option import Group, declared, option, take_texts
from tachometry.spec import CoreSpec, LoopSpec, ParameterError, with_loop
from tachometry.spec.language.option import options_of

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
    return dict(spec=with_loop(spec, texts) if loop else _alone(spec, texts), **others)


LOOP_OPTIONS = Group(_OPTIONS, _read)
"""Below those of the axes: `spec` is that of a core with a control loop, if there is to be one."""


def _alone(spec: CoreSpec, texts: dict[str, str]) -> CoreSpec:
    for name in texts:
        raise ParameterError(name.replace("-", "_"), "must be given together with --loop")
    return spec
