"""An axis of a core of many: what it is as a core of its own, and how long its turn is."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from fractions import Fraction
from functools import cached_property
from typing import cast

from tachometry.spec.core.timing import Timing
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import Ports
from tachometry.spec.methods.s import STachometer, STimes

MAX_AXES = 64
# What is counted is back in memory before the same axis is looked at again.
MIN_SLOTS = 4
_NEAR = 2000  # clocks; 64 axes need some 800
WARM_UP = 3  # rounds after reset: two until the levels are those of the pins, one for the level before
# Clocks from a look at an axis: the filter knows its level, and the count is in its register, to be handed over.
FILTER_LATENCY = 3
COUNT_LATENCY = 3
# Clocks of a turn of the datapath: what its memories have is in registers, and m_e is.
READ, DECIDE = 2, 3


def slots_of(axes: int, cycles: int) -> int | None:
    """Return S for a tick of so many clocks; None if no number divides it."""
    return next((slots for slots in range(max(axes, MIN_SLOTS), MAX_AXES + 1) if cycles % slots == 0), None)


class SAxisTimes(STimes):
    """Says how far ticks of an axis are apart, in rounds."""

    @property
    def min_tick_cycles(self) -> int:
        # Each axis has its turn, and a round to hand its count over.
        spec = self.spec
        assert isinstance(spec, SAxis)
        return max(2, -(-(spec.axes_of_tick * turn_cycles(spec) + spec.slots) // spec.slots))


@dataclass(frozen=True, kw_only=True)
class SAxis(STachometer):
    """Core of one axis that an axis of many is, to the bit; its clock is a round.

    Parameters
    ----------
    axes_of_tick : int
        How many have their turn in a tick.
    slots : int
        Clocks of a round.
    """

    axes_of_tick: int
    slots: int

    times = cached_property(SAxisTimes)

    @property
    def ports(self) -> Ports:
        """Ports of the core, less the count of the glitch filter, which no axis has."""
        return Ports(port for port in super().ports if port.name != "swallowed_edges")


def one_axis(spec: STachometer, axes: int, slots: int) -> SAxis:
    """Return the core that each axis is if a round has so many slots."""
    timing = spec.timing
    # Rounds may be no whole number of hertz, which a clock of a core has.
    clock_hz = cast(int, Fraction(timing.clock_hz, slots))
    asked = {about.name: getattr(spec, about.name) for about in fields(spec)}
    # What is shorter than the time of the filter is not seen at one look more than there are in that time.
    looks = -(-(spec.filter_clocks - 1) // slots) + 1 if spec.filter_clocks else 0
    own = {
        "timing": Timing(clock_hz, timing.tick_cycles // slots, timing.max_ticks),
        "frac_bits": spec.widths.frac_bits,
        "filter_clocks": looks,
        "max_tick_cycles": spec.times.longest_tick // slots if spec.external_tick else None,
    }
    return SAxis(**{**asked, **own, "axes_of_tick": axes, "slots": slots})


def turn_cycles(axis: STachometer) -> int:
    """Return the clocks for which an axis has the datapath."""
    # The next axis begins while the velocity of this one is shown. One clock starts the scaler, one takes its sum.
    return DECIDE + 1 + axis.form.looked_up.digits + 1 + _output_cycles(axis) - READ


def _output_cycles(axis: STachometer) -> int:
    output = axis.scale.output
    return 0 if output is None else output.pipelined_latency


def fits(spec: STachometer, axes: int, cycles: int) -> bool:
    """Tell whether a tick of so many clocks has whole rounds, and room for the turns of all axes."""
    slots = slots_of(axes, cycles)
    if slots is None:
        return False
    most = spec.timing.max_ticks * spec.timing.tick_cycles // cycles
    axis = one_axis(replace(spec, timing=Timing(spec.timing.clock_hz, cycles, max(most, 2))), axes, slots)
    return axes * turn_cycles(axis) + slots <= cycles


def nearest_ticks(spec: STachometer, axes: int) -> list[int]:
    """Return the longest tick below that of `spec` that fits, and the shortest above, in clocks, if they are near."""

    def possible(cycles: int) -> bool:
        try:
            return fits(spec, axes, cycles)
        except ParameterError:  # no axis can have this tick
            return False

    cycles = spec.timing.tick_cycles
    ways = (range(cycles - 1, max(cycles - _NEAR, 0), -1), range(cycles + 1, cycles + _NEAR))
    found = (next(filter(possible, way), None) for way in ways)
    return [one for one in found if one is not None]
