"""An axis of a core of many with the tracking method."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from tachometry.spec.formats.tracking_code import Program
from tachometry.spec.formats.tracking_units import BLOCK, Serial
from tachometry.spec.language.port import UPDATE
from tachometry.spec.methods.axis import WARM_UP, OneAxis, Plan, output_cycles, own_options
from tachometry.spec.methods.track import TrackTachometer


@dataclass(frozen=True, kw_only=True)
class TrackAxis(OneAxis, TrackTachometer):
    """Describes one of many axes with the tracking method."""

    tick_clocks: int  # clocks of the shortest tick in which all turns must end
    ahead: int = 0  # rounds from an edge to what is shown: the velocity is that of the clock in which it is shown

    @classmethod
    def of(cls, spec: TrackTachometer, axes: int, slots: int) -> TrackAxis:
        """Return the core that each axis is if a round has so many slots; ParameterError if it cannot be."""
        own = own_options(spec, slots)
        if spec.max_memory is not None:
            own["max_memory"] = max(spec.max_memory // slots, own["timing"].tick_cycles)
        return cls(**own, axes_of_tick=axes, slots=slots, tick_clocks=spec.timing.tick_cycles)

    @cached_property
    def program(self) -> Program:
        """The program of a turn, on the block unit if nothing else is asked for."""
        times = Serial(self.form).times if self.multiplier == "serial" else BLOCK
        made = Program(self.form, times, 0, self.smooth)
        return replace(made, delay=self.ahead - made.velocity_clocks)

    @property
    def whole(self) -> str:
        return UPDATE

    @property
    def clock_unit(self) -> str:
        return f"{self.slots} clocks"

    @cached_property
    def plan(self) -> Plan:
        """When each axis has its turn: on as few machines as all turns end in time with."""
        program = self.program
        cycles, output = program.all_clocks + 1, output_cycles(self)
        more = sum(extra.turn_clocks(self) for extra in self.extras)
        latency, beside = program.clocks + output + more, more and output + more + 2
        found = [Plan(self.axes_of_tick, cycles, latency, n, beside) for n in range(1, self.axes_of_tick + 1)]
        room = self.tick_clocks // (1 + self.external_tick)  # external ticks may come in half the time
        fitting = (plan for plan in found if plan.end + self.slots <= room and plan.machines * beside <= cycles)
        return next(fitting, found[0])

    def at(self, axis: int, clocks: int) -> TrackAxis:
        """Return the core that one of the axes is, which is shown so many clocks after its last look."""
        late = WARM_UP - 1 + self.slots // 2 + self.filter_clocks * self.slots + clocks
        return replace(self, ahead=self.latency.pin_to_count + round(clocks / self.slots), late=late)
