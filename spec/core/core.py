"""A core of one axis: its measurement, and the features beside that."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Literal

from tachometry.spec.core.extras import EXTRAS, Extra
from tachometry.spec.core.front_end import FrontEnd
from tachometry.spec.core.latency import TICK_IN_TO_WINDOW_END
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.core.words import Words, speed_notes
from tachometry.spec.formats.displacement import Displacement
from tachometry.spec.language.port import UPDATE


@dataclass(frozen=True, kw_only=True)
class Core(Numbers):
    """Features beside the measurement, and the inputs of a core."""

    extras: tuple[Extra, ...] = field(default=(), metadata={"extras": EXTRAS})  # see `spec.core.extras`
    # why this method was taken, where none was named; empty: it was named
    chosen: str = field(default="", compare=False, repr=False)

    kind: ClassVar[Literal["one"]] = "one"  # of core
    # How many axes its outputs are of, if they say which.
    axes: ClassVar[None] = None

    @cached_property
    def front_end(self) -> FrontEnd:
        """Inputs of the core; where its index and its modulus are."""
        pins = tuple(pin for extra in self.extras for pin in extra.pins(self))
        return FrontEnd(self, self.times.longest, pins)

    @cached_property
    def displacement(self) -> Displacement | None:
        """Format of the displacements that an extra gives to the datapath; None: there are none."""
        return next(filter(None, (extra.displacement(self) for extra in self.extras)), None)

    @property
    def latency_entries(self) -> dict[str, int]:
        """Latencies in the manifest, in clocks."""
        latency = self.latency
        found = {
            "pin_to_count": latency.pin_to_count,
            "tick_latency": latency.tick,
            "tick_to_velocity": latency.tick_to_velocity,
        }
        if self.whole != UPDATE:
            found["tick_to_update"] = latency.tick_to_update
        for extra in self.extras:
            found |= extra.latency(self)
        return found | ({"tick_in_to_window_end": TICK_IN_TO_WINDOW_END} if self.external_tick else {})

    @cached_property
    def words(self) -> Words:
        """Texts about the core."""
        return Words(
            description=self.facts.summary,
            method=", ".join(filter(None, (self.method, self.chosen))),
            heading=f"{self.facts.title} method",
            notes=speed_notes(self, self.velocity),
        )
