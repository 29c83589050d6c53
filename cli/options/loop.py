"""Options of cores with a control loop."""

from typing import Any

from tachometry.cli.options.core import Part
from tachometry.cli.options.option import declared, option, take_texts
from tachometry.spec import CoreSpec, LoopSpec, ParameterError, with_loop
from tachometry.spec.control import AnySpec
from tachometry.spec.language.option import options_of

_LOOP = "Loop"

_LOOP_HELP = """Add a control loop: disturbance observer and controller. Commands for position and velocity are \
inputs, the current is an output."""


_OPTIONS = [
    option(_LOOP, "--loop", is_flag=True, help=_LOOP_HELP),
    *(declared(_LOOP, about) for about in options_of(LoopSpec)),
]


def _take(given: dict[str, Any]) -> Any:
    loop, texts = given.pop("loop"), take_texts(LoopSpec, given)
    if texts and not loop:
        raise ParameterError(next(iter(texts)).replace("-", "_"), "must be given together with --loop")

    def within(spec: CoreSpec) -> AnySpec:
        return with_loop(spec, texts) if loop else spec

    return within


LOOP = Part(_OPTIONS, _take)
"""The core has a control loop, if there is to be one; behind the axes."""
