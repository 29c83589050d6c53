"""The tracking method."""

from amaranth import Module, ResetInserter, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from tachometry.hdl.arithmetic.idle import Idle, IdleBox, idle_of
from tachometry.hdl.front_end.sampling_clock import SamplingClock
from tachometry.hdl.methods.datapath import datapath_members
from tachometry.hdl.methods.tick_counts import TickCounts
from tachometry.hdl.methods.track_machine import TrackMachine
from tachometry.hdl.wires.ports import follow
from tachometry.spec import TrackTachometer
from tachometry.spec.formats.tracking import PLACE_BITS
from tachometry.spec.formats.tracking_code import SMOOTH_DELAY_BITS


def delay_of(shown: Value, time_bits: int) -> Value:
    """Return the clocks of a delay that the machine shows; one that the port does not hold is its greatest."""
    clocks = shown[time_bits:]
    return (clocks | clocks[SMOOTH_DELAY_BITS:].any().replicate(SMOOTH_DELAY_BITS))[:SMOOTH_DELAY_BITS]


class TrackMethod(wiring.Component):
    """Tracking datapath: least squares over a memory that finds its own length (after Tsuji 2009, eq. (22)).

    Latency: an update comes `spec.latency.datapath` clocks after every `tick`, and the filter has taken it before the
    next may come: no update needs a stamp. `interval` is the number of ticks since the last one with counts; `forced`:
    this tick had none.
    """

    def __init__(self, spec: TrackTachometer) -> None:
        self._spec = spec
        self.tick_counts = TickCounts(spec.form, spec.timing.max_ticks)
        self.machine = TrackMachine(spec.program)
        self.left = SamplingClock(spec.latency.datapath - 1)
        super().__init__(
            {
                **datapath_members(spec),
                "step": In(signed(2)),  # as late as `tick`
                "position": In(signed(spec.position_width)),  # valid with `tick`
            }
        )

    @property
    def probes(self) -> dict[str, Value]:
        """Signals of the inside that a waveform should show."""
        return {"counts_number": self.tick_counts.number, "counts_times": self.tick_counts.times}

    @property
    def idle(self) -> tuple[Idle, ...]:
        """Registers that a simulation may move on."""
        boxes = {"tick_counts": self.tick_counts, "left": self.left, "machine": self.machine}
        return (IdleBox("machine"), *idle_of(boxes))

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._spec
        m.submodules.tick_counts = counts = self.tick_counts
        m.submodules.machine = machine = self.machine
        position = Signal.like(self.position)
        # All ways through the program take as long.
        awaited = Signal()
        ready = Signal()
        m.submodules.left = ResetInserter(self.tick)(self.left)
        m.d.comb += ready.eq(awaited & self.left.last)
        with m.If(ready):
            m.d.sync += awaited.eq(0)
        with m.If(self.tick):
            m.d.sync += [position.eq(self.position), awaited.eq(1)]
        m.d.comb += [counts.tick.eq(self.tick), counts.step.eq(self.step), machine.begin.eq(self.tick)]
        names = ("number", "times", "places", "last", "moved", "length", "kind", "end", "down")
        follow(m, machine, counts, names)
        new = self.updates.p
        shift = PLACE_BITS - spec.position_fine_bits
        m.d.sync += self.updates.valid.eq(ready)
        if spec.smooth:
            delay = delay_of(machine.smooth_delay, spec.form.time_bits)
            with m.If(ready):
                m.d.sync += [new.velocity_smooth.eq(machine.velocity_smooth), new.smooth_delay.eq(delay)]
        with m.If(ready):
            m.d.sync += [
                new.velocity.eq(machine.velocity),
                new.acceleration.eq(machine.acceleration),
                new.velocity_std.eq(machine.velocity_std),
                new.position_fine.eq(
                    (position << spec.position_fine_bits)
                    + (machine.position_fine >> shift)
                    + machine.position_fine[shift - 1]
                ),
                new.interval.eq(counts.elapsed),
                new.forced.eq(~counts.number.any()),
                new.standstill.eq(machine.standstill & ~counts.number.any()),
            ]
        return m
