"""A tachometer is what is asked for: from encoder pins to velocity, whatever the method."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tachometry.spec.core.checks import check
from tachometry.spec.core.core import Core
from tachometry.spec.core.described import options_as_asked, parameters_of
from tachometry.spec.core.ports import bound_ports, ports_of
from tachometry.spec.language.port import Ports


@dataclass(frozen=True, kw_only=True)
class TachometerSpec(Core):
    """A core of one axis; a method is a subclass, which states what it has of its own.

    Its fields are options, None where nothing is asked for: those of the measurement are in `Asked`, those of features
    beside it in `Core`. What follows from them is in stages: `tick`, `scale`, `bound`, `velocity`, `form` (of the
    method alone), `latency`, `times`, `widths`, `recovery`, `front_end` and `words`; see `Numbers`. A value out of
    range raises ParameterError.
    """

    def __post_init__(self) -> None:
        check(self)

    @property
    def tachometer(self) -> "TachometerSpec":
        """The spec itself."""
        return self

    @cached_property
    def ports(self) -> Ports:
        """Ports of the exported core, in order."""
        return Ports(ports_of(self, (*bound_ports(self), *self.method_ports)))

    @property
    def options(self) -> dict[str, str]:
        """Texts of all options that are asked for, by their names; `of_options` makes the core of them again."""
        return options_as_asked(self)

    @property
    def parameters(self) -> dict[str, Any]:
        """Every option in canonical form, defaults and what follows included."""
        return parameters_of(self)
