"""An axis of a core of many: what it is as a core of its own, and when it has its turn."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, cast

from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.times import Times
from tachometry.spec.core.timing import Timing
from tachometry.spec.language.port import MISSED, WIDE, Ports

MAX_AXES = 64
# What is counted is back in memory before the same axis is looked at again.
MIN_SLOTS = 4
_APART = 2
WARM_UP = 3  # rounds after reset: two until the levels are those of the pins, one for the level before
# Clocks from a look at an axis: the filter knows its level, and the count is in its register, to be handed over.
FILTER_LATENCY = 3
COUNT_LATENCY = 3


def slots_of(axes: int, cycles: int) -> int | None:
    """Return S for a tick of so many clocks; None if no number divides it."""
    return next((slots for slots in range(max(axes, MIN_SLOTS), MAX_AXES + 1) if cycles % slots == 0), None)


def own_options(spec: TachometerSpec, slots: int) -> dict[str, Any]:
    """Return the options of an axis of such a core, if a round has so many slots: its clock is a round."""
    timing = spec.timing
    # Rounds may be no whole number of hertz, which a clock of a core has.
    clock_hz = cast(int, Fraction(timing.clock_hz, slots))
    asked = {about.name: getattr(spec, about.name) for about in fields(spec)}
    # What is shorter than the time of the filter is not seen at one look more than there are in that time.
    looks = -(-(spec.filter_clocks - 1) // slots) + 1 if spec.filter_clocks else 0
    own = {
        "timing": Timing(clock_hz, timing.tick_cycles // slots, timing.max_ticks),
        "frac_bits": spec.velocity.frac_bits,
        "filter_clocks": looks,
        "extras": tuple(extra.in_turn(slots) for extra in spec.extras),
        "max_tick_cycles": spec.tick.longest // slots if spec.external_tick else None,
    }
    return {**asked, **own}


def output_cycles(axis: TachometerSpec) -> int:
    """Return clocks of the conversion of a velocity, which takes one in every clock."""
    output = axis.velocity.output
    return 0 if output is None else output.pipelined_latency


@dataclass(frozen=True)
class Plan:
    """Says when each axis has its turn."""

    axes: int
    cycles: int  # clocks of a turn
    latency: int  # clocks from the beginning of a turn to what is shown of it
    machines: int = 1  # datapaths that work side by side: axis k has number k modulo this
    beside: int = 0  # clocks for which features beside the measurement work on what is shown, for one axis at a time

    @property
    def apart(self) -> int:
        """Clocks by which a datapath begins later than the one before: no two axes are shown in clocks side by side."""
        return max(_APART, self.beside)

    def start(self, axis: int) -> int:
        """Return clocks from the beginning of the first turn to that of an axis."""
        return axis // self.machines * self.cycles + axis % self.machines * self.apart

    @property
    def end(self) -> int:
        """Clocks from the beginning of the first turn to the end of the last one."""
        return -(-self.axes // self.machines) * self.cycles + (self.machines - 1) * self.apart + self.beside


@dataclass(frozen=True, kw_only=True)
class OneAxis(TachometerSpec):
    """Core of one axis that an axis of many is, to the bit; its clock is a round."""

    axes_of_tick: int  # how many have their turn in a tick
    slots: int  # clocks of a round
    late: int = 0  # clocks from the mean edge of a round to what is shown; only features beside the measurement need it

    @cached_property
    def times(self) -> Times:
        # Each axis has its turn, and a round to hand its counts over.
        return replace(super().times, min_tick_cycles=max(2, -(-self.plan.end // self.slots) + 1))

    @cached_property
    def ports(self) -> Ports:
        """Ports of the core, less the count of the glitch filter and what tells of a wrong index, which no axis has."""
        return Ports(port for port in super().ports if port.name not in ("filtered_edges", WIDE, MISSED))

    @property
    @abstractmethod
    def plan(self) -> Plan:
        """When each axis has its turn."""
