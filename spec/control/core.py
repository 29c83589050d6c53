"""A tachometer and the control loop of its shaft as one core."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal

from tachometry.spec.control.loop import Loop
from tachometry.spec.control.ports import loop_entries, loop_ports
from tachometry.spec.core.described import written
from tachometry.spec.language.option import options_of
from tachometry.spec.language.port import Port, Ports
from tachometry.spec.methods.axes import CoreSpec


@dataclass(frozen=True, kw_only=True)
class LoopSpec(Loop):
    """A core of a tachometer with a control loop; see `Loop`."""

    kind: ClassVar[Literal["loop"]] = "loop"
    # Outputs are of one axis.
    axes: ClassVar[None] = None

    @cached_property
    def ports(self) -> Ports:
        """Ports of the exported core, in order: those of the tachometer first."""
        return Ports((*self.tachometer.ports, *loop_ports(self)))

    @property
    def held_inputs(self) -> tuple[Port, ...]:
        """Inputs that are taken in the clock before a control tick: commands, gains and limit, if gains are inputs."""
        if self.gains == "fixed":
            return ()
        return tuple(
            port for port in loop_ports(self) if port.direction == "input" and port.name not in ("enable", "freeze")
        )

    @property
    def options(self) -> dict[str, str]:
        """Texts of all options that are asked for, by their names."""
        return {**self.tachometer.options, "loop": "yes", **written(self, self.tachometer)}

    @property
    def parameters(self) -> dict[str, Any]:
        """Every option in canonical form, defaults included."""
        follows = {"velocity_filter": self.filter, "control_period": self.period}
        own = {
            about.parameter: about.canonical(follows.get(about.field, getattr(self, about.field)))
            for about in options_of(LoopSpec)
        }
        return {**self.tachometer.parameters, "loop": own}

    @property
    def entries(self) -> dict[str, Any]:
        """Entries of the manifest, see `TachometerSpec.entries`."""
        of_tachometer = self.tachometer.entries
        of_tachometer.pop("recovery_cycles", None)  # a loop forgets gradually
        return of_tachometer | {"loop": loop_entries(self)}


# A core of any kind: all have ports, options, parameters, `axes`, `latency.tick_to_result`, and a `tachometer`,
# the core of one axis that they are, or that is in them.
AnySpec = CoreSpec | LoopSpec
