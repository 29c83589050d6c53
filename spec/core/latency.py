"""Latencies of a core, in clocks, and which of its work is done step by step."""

from tachometry.spec.core.follows import Follows, S

TICK_IN_TO_WINDOW_END = 2  # clocks: the synchroniser


class Latency(Follows[S]):
    """Counts the clocks from a pin to the velocity, and says which work is done step by step."""

    @property
    def pin_to_count(self) -> int:
        """Clocks from the sampling of a level to its step: the two synchroniser flip-flops and the filter."""
        return 2 + self.spec.filter_clocks

    @property
    def tick(self) -> int:
        """Clocks from the last one of a window to `tick`: one completes the sum, one registers it."""
        return 2

    @property
    def registers_steps(self) -> bool:
        """Whether a step is in a register before it counts for the tick: a clock of `tick`."""
        return False

    @property
    def serial(self) -> bool:
        """Whether the datapath needs the time between two ticks."""
        raise NotImplementedError

    @property
    def datapath(self) -> int:
        """Clocks from `tick` to the native velocity."""
        raise NotImplementedError

    @property
    def busy(self) -> int:
        """Clocks that a serial datapath needs from tick to tick."""
        return self.datapath

    @property
    def low_pass(self) -> int:
        """Clocks from the measured velocity to the filtered one, if updates are no closer."""
        return 0 if self.spec.lowpass is None else self.spec.scale.low_pass.latency

    @property
    def output_serial(self) -> bool:
        """Whether `velocity` is computed from the native velocity bit by bit."""
        output = self.spec.scale.output
        return output is not None and len(output.digits) > 2 and self._has_room(output.serial_latency)

    def _has_room(self, clocks: int) -> bool:
        """Tell whether updates are far enough apart for work of so many clocks on each."""
        return self.spec.times.has_room(clocks)

    @property
    def output(self) -> int:
        """Clocks from the native velocity to `velocity`."""
        output = self.spec.scale.output
        if output is None:
            return 0
        return output.serial_latency if self.output_serial else output.pipelined_latency

    @property
    def tick_to_velocity(self) -> int:
        """Clocks from `tick` to `velocity_valid`."""
        return self.datapath + self.low_pass + self.output

    @property
    def tick_to_result(self) -> int:
        """Clocks from its tick to what the core is for: here to the velocity."""
        return self.tick_to_velocity

    @property
    def entries(self) -> dict[str, int]:
        """Entries of the manifest."""
        found = {
            "pin_to_count": self.pin_to_count,
            "tick_latency": self.tick,
            "tick_to_velocity": self.tick_to_velocity,
        }
        if self.spec.compare is not None and not self.spec.compare.fine:  # else it is at the place itself
            found["pin_to_compare"] = self.pin_to_count + self.tick + 1
        if self.spec.probe:
            found["pin_to_probe"] = self.pin_to_count + self.tick
        return found | ({"tick_in_to_window_end": TICK_IN_TO_WINDOW_END} if self.spec.external_tick else {})
