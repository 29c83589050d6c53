"""A core of one axis: its measurement, and the features beside that."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Literal

from tachometry.spec.core.compare import Compare
from tachometry.spec.core.extras import EXTRAS, Extra
from tachometry.spec.core.front_end import FrontEnd
from tachometry.spec.core.latency import TICK_IN_TO_WINDOW_END
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.core.words import Words, speed_notes
from tachometry.spec.language.option import option


@dataclass(frozen=True, kw_only=True)
class Core(Numbers):
    """Features beside the measurement, and the inputs of a core."""

    extras: tuple[Extra, ...] = field(default=(), metadata={"extras": EXTRAS})  # see `spec.core.extras`
    position_compare: Compare | None = option(  # noqa: RUF009
        None,
        "Pulses at positions, such as 100:100:50:10us. Output position_compare has pulses of WIDTH, a "
        "time or clocks, at COUNT positions (0: no end) from START on, STEP counts apart. They come while "
        "the shaft turns forward; with :backward at the end backward, with :both either way. "
        "list:DEPTH:WIDTH takes positions that a program writes, up to DEPTH ahead. With :fine at the end "
        "START and STEP may lie between counts, at places that track finds.",
        metavar="[START:STEP:COUNT|list:DEPTH]:WIDTH",
        parse=Compare.parse,
        tests=("", "2:3:0:2clk", "1.5:2.5:0:2clk:fine", "-2:3:40:1clk:backward", "3:4:9:1clk:both", "list:3:2clk"),
        few=3,
        tacit=True,
    )
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

    @property
    def latency_entries(self) -> dict[str, int]:
        """Latencies in the manifest, in clocks."""
        latency = self.latency
        found = {
            "pin_to_count": latency.pin_to_count,
            "tick_latency": latency.tick,
            "tick_to_velocity": latency.tick_to_velocity,
        }
        if self.position_compare is not None and not self.position_compare.fine:  # else it is at the place itself
            found["pin_to_position_compare"] = latency.pin_to_count + latency.tick + 1
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
