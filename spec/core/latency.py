"""Latencies of a core, in clocks, and which of its work is done step by step."""

from dataclasses import dataclass

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.velocity import Velocity

TICK_IN_TO_WINDOW_END = 2  # clocks: the synchroniser


@dataclass(frozen=True)
class Latency:
    """Clocks from a pin to the velocity."""

    asked: Asked
    velocity: Velocity
    room: int  # clocks of work on an update for which updates are far enough apart
    datapath: int = 0  # clocks from `tick` to the native velocity
    busy: int = 0  # clocks that a datapath needs from tick to tick, if it works step by step; else 0
    counting: int = 2  # clocks from the last one of a window to the sum: one completes it, one registers it
    rest: int = 0  # clocks from `tick` to the native rest of an update that comes after its velocity
    registers_steps: bool = False  # whether a step is in a register before it counts: a clock of `counting`

    @property
    def place(self) -> int:
        """Clocks from the last one of a window to its position: a read in it may be compared with those before it."""
        return self.counting + (0 if self.asked.reach is None else self.asked.reach.clocks)

    @property
    def tick(self) -> int:
        """Clocks from the last one of a window to `tick`: all outputs wait for a remainder of the position."""
        return self.place + (0 if self.asked.remainder is None else self.asked.remainder.clocks)

    @property
    def pin_to_count(self) -> int:
        """Clocks from the sampling of a level to its step: the two synchroniser flip-flops and the filter.

        A position that is read is synchronous to the clock.
        """
        return 0 if self.asked.encoder.sampled else 2 + self.asked.filter_clocks

    @property
    def serial(self) -> bool:
        """Whether the datapath needs the time between two ticks."""
        return self.busy > 0

    @property
    def low_pass(self) -> int:
        """Clocks from the measured velocity to the filtered one, if updates are no closer."""
        return 0 if self.asked.lowpass is None else self.velocity.low_pass.latency

    @property
    def output_serial(self) -> bool:
        """Whether `velocity` is computed from the native velocity bit by bit."""
        output = self.velocity.output
        return output is not None and len(output.digits) > 2 and output.serial_latency <= self.room

    @property
    def output(self) -> int:
        """Clocks from the native velocity to `velocity`."""
        output = self.velocity.output
        if output is None:
            return 0
        return output.serial_latency if self.output_serial else output.pipelined_latency

    @property
    def tick_to_velocity(self) -> int:
        """Clocks from `tick` to `velocity_valid`."""
        return self.datapath + self.low_pass + self.output

    @property
    def tick_to_update(self) -> int:
        """Clocks from `tick` to the strobe `whole` of the core."""
        return max(self.tick_to_velocity, self.rest)

    @property
    def native_update(self) -> int:
        """Clocks from `tick` until a method has handed on all of an update."""
        return self.tick_to_update if self.rest else self.datapath

    @property
    def tick_to_result(self) -> int:
        """Clocks from its tick to what the core is for: here to the velocity."""
        return self.tick_to_velocity

    @property
    def min_tick(self) -> int:
        """Fewest clocks between two ticks: all work that is done step by step must be finished."""
        return max(2, self.busy, self.tick - self.place, self.output if self.output_serial else 0)
