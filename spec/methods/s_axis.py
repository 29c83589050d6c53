"""An axis of a core of many with the S method."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from tachometry.spec.language.option import ParameterError
from tachometry.spec.methods.axis import OneAxis, Plan, output_cycles, own_options
from tachometry.spec.methods.s import MAX_TABLE, STachometer

# Clocks of a turn of the datapath: what its memories have is in registers, and m_e is.
READ, DECIDE = 2, 3


@dataclass(frozen=True, kw_only=True)
class SAxis(OneAxis, STachometer):
    """Describes one of many axes with the S method."""

    @classmethod
    def of(cls, spec: STachometer, axes: int, slots: int) -> SAxis:
        """Return the core that each axis is if a round has so many slots; ParameterError if it cannot be."""
        if spec.timing.max_ticks > MAX_TABLE:
            raise ParameterError(
                "max_ticks",
                f"must be at most {MAX_TABLE} with --axes, where 1/m_s is looked up, not {spec.timing.max_ticks}: "
                f"try --max-time {spec.timing.time_of(MAX_TABLE)}",
            )
        return cls(**own_options(spec, slots), axes_of_tick=axes, slots=slots)

    @cached_property
    def plan(self) -> Plan:
        """When each axis has its turn."""
        # The next axis begins while the velocity of this one is shown. One clock starts the scaler, one takes its sum.
        cycles = DECIDE + 1 + self.form.looked_up.digits + 1 + output_cycles(self) - READ
        return Plan(self.axes_of_tick, cycles, cycles + READ)

    def at(self, axis: int, clocks: int) -> SAxis:
        """Return the core that one of the axes is, which is shown so many clocks after its last look."""
        return self
