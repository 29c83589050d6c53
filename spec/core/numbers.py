"""Numbers of the measurement: each stage is made of those above it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.front_end import FrontEnd
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.recovery import Recovery
from tachometry.spec.core.tick import Scale, Tick
from tachometry.spec.core.times import Times, Widths
from tachometry.spec.core.velocity import Bound, Velocity
from tachometry.spec.formats.carrying import Carrying
from tachometry.spec.language.port import UPDATE, Port, Ports


@dataclass(frozen=True, kw_only=True)
class Numbers(Asked):
    """Numbers of the measurement, in the order in which they follow from the options and from each other.

    A method makes anew the stages in which it differs, from the same ones or from its `form`, which is made of the
    velocity and what is above it.
    """

    @cached_property
    def tick(self) -> Tick:
        """The sampling period."""
        return Tick(self)

    @cached_property
    def scale(self) -> Scale:
        """One count per tick, in other units."""
        return Scale(self)

    @cached_property
    def bound(self) -> Bound:
        """How far the shaft may have gone beside what was counted: a window may have missed a count at its ends."""
        return Bound.of(self, self.tick.max_count + 1)

    @cached_property
    def velocity(self) -> Velocity:
        """The velocity: a mean of pulse numbers never exceeds the largest of them."""
        return Velocity(self, self.scale, self.bound, self.tick.max_count)

    @cached_property
    def latency(self) -> Latency:
        """Clocks from a pin to the velocity."""
        raise NotImplementedError

    @cached_property
    def carrying(self) -> Carrying | None:
        """How `position_fine` is carried on to the next update; None: the method has none."""
        return None

    @cached_property
    def times(self) -> Times:
        """Deadlines: how far ticks and updates are apart, and when the shaft is known to rest."""
        timing = self.timing
        return Times(
            self,
            self.tick,
            self.latency,
            min_tick_cycles=self.latency.min_tick,
            longest=timing.max_ticks * timing.tick_cycles,
            standstill_ticks=timing.max_ticks,
            interval_unit=timing.tick_cycles,
        )

    @cached_property
    def front_end(self) -> FrontEnd:
        """Inputs; where the index and the modulus are."""
        return FrontEnd(self, self.times.longest)

    @cached_property
    def widths(self) -> Widths:
        """Bits of the numbers beside the velocity."""
        stamp = 0
        if self.age:
            # An update may have to wait for the filter as long as this works.
            clocks = self.latency.tick_to_velocity + self.latency.low_pass
            ticks = -(-clocks // self.times.shortest_tick) - (self.facts.update_by != "count")
            stamp = ticks.bit_length()
        return Widths(self.tick.max_count, self.timing.max_ticks.bit_length(), stamp)

    @cached_property
    def ports(self) -> Ports:
        """Ports of the exported core, in order; features beside the measurement have some of them."""
        raise NotImplementedError

    @cached_property
    def recovery(self) -> Recovery:
        """Clocks after which all is right again after an upset."""
        return Recovery(self, self.tick, self.latency, self.remembered)

    @property
    def remembered(self) -> int | None:
        """Clocks of right counts after which the method remembers nothing from before; None: it forgets gradually."""
        raise NotImplementedError

    @property
    def wanted_room(self) -> int:
        """Clocks for which a tick must have room, that `auto` takes this method."""
        return 0

    @property
    def method_entries(self) -> dict[str, dict[str, Any]]:
        """Entries of the manifest that describe outputs of this method alone, by the names of the ports."""
        return {}

    @property
    def method_ports(self) -> tuple[Port, ...]:
        """Outputs that only this method has; they are new with `velocity_valid`, or with `whole`."""
        return ()

    @property
    def whole(self) -> str:
        """The strobe with which all of an update is there."""
        return UPDATE
