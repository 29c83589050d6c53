"""The tracking method."""

from typing import Any

from amaranth import Module, Mux, ResetInserter, Signal, Value, signed
from amaranth.lib.wiring import In

from tachometry.hdl.arithmetic.idle import Idle, IdleBox, idle_of
from tachometry.hdl.front_end.sampling_clock import SamplingClock
from tachometry.hdl.methods.datapath import datapath_members
from tachometry.hdl.methods.tick_counts import TickCounts
from tachometry.hdl.methods.track_machine import EXCHANGE, TrackMachine
from tachometry.hdl.wires.ports import Box, drive, follow, only_if
from tachometry.spec import TrackTachometer
from tachometry.spec.formats.displacement import DISPLACED
from tachometry.spec.formats.tracking_code import SMOOTH_DELAY_BITS
from tachometry.spec.formats.tracking_sampled import EXCHANGED, SampledTracking


def delay_of(shown: Value, time_bits: int) -> Value:
    """Return the clocks of a delay that the machine shows; one that the port does not hold is its greatest."""
    clocks = shown[time_bits:]
    return (clocks | clocks[SMOOTH_DELAY_BITS:].any().replicate(SMOOTH_DELAY_BITS))[:SMOOTH_DELAY_BITS]


class TrackMethod(Box):
    """Tracking datapath: least squares over a memory that finds its own length (after Tsuji 2009, eq. (22)).

    Latency: an update comes `spec.latency.datapath` clocks after every `tick`, and the filter has taken it before the
    next may come: no update needs a stamp. `interval` is the number of ticks since the last one with counts; `forced`:
    this tick had none.
    """

    def __init__(self, spec: TrackTachometer) -> None:
        self._spec = spec
        self._reads = spec.encoder.sampled is not None
        self.tick_counts = None if self._reads else TickCounts(spec.form, spec.timing.max_ticks)
        self.machine = TrackMachine(spec.program)
        self.left = SamplingClock(spec.latency.datapath - 1)
        rest = spec.latency.native_update - spec.latency.datapath
        self.rest_left = SamplingClock(rest) if rest else None  # from the velocity to the rest of an update
        super().__init__(
            **datapath_members(spec),
            **only_if(not self._reads, step=In(signed(2))),  # as late as `tick`
            **only_if(
                self._reads,
                number=In(1),
                times=In(spec.form.times_bits),
                phase=In(spec.form.period_bits),
                forgets=In(1),
                silent=In(range(spec.timing.max_ticks + 1)),
                elapsed=In(range(spec.timing.max_ticks + 1)),
                length=In(range(spec.tick.longest + 1)),
            ),  # see `SampledPosition`
            position=In(signed(spec.position_width)),  # valid with `tick`
            **only_if(spec.form.exchanges, **EXCHANGE),
            **({} if (off := spec.displacement) is None else dict.fromkeys(DISPLACED, In(signed(off.width)))),
        )

    @property
    def probes(self) -> dict[str, Value]:
        source: Any = self.tick_counts or self
        return {"counts_number": source.number, "counts_times": source.times}

    @property
    def idle(self) -> tuple[Idle, ...]:
        boxes = {"tick_counts": self.tick_counts, "left": self.left, "rest_left": self.rest_left}
        boxes |= {"machine": self.machine}
        return (IdleBox("machine"), *idle_of(boxes))

    def build(self, m: Module) -> None:
        spec = self._spec
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
        m.d.comb += machine.begin.eq(self.tick)
        elapsed = self._take_counts(m)
        new = self.updates.p
        m.d.sync += self.updates.valid.eq(ready)
        rest, whole = (new, ready) if self.rest_left is None else self._rest(m, self.rest_left, ready)
        shift = spec.form.moved_shift - spec.position_fine_bits
        fine = (position << spec.position_fine_bits) + (machine.position_fine >> shift)
        fine += machine.position_fine[shift - 1]
        if spec.smooth:
            delay = delay_of(machine.smooth_delay, spec.form.time_bits)
            with m.If(ready):
                m.d.sync += [new.velocity_smooth.eq(machine.velocity_smooth), new.smooth_delay.eq(delay)]
        shown = {"acceleration": machine.acceleration, "velocity_std": machine.velocity_std, "position_fine": fine}
        shows = [rest[name].eq(value) for name, value in shown.items()]
        with m.If(ready):
            m.d.sync += [
                new.velocity.eq(machine.velocity),
                *([] if self.rest_left else shows),
                new.interval.eq(elapsed),
                new.forced.eq(~machine.number.any() | (machine.standstill if spec.form.waits else 0)),
                new.standstill.eq(machine.standstill & ~(self.number if self._reads else machine.number.any())),
            ]
        if self.rest_left:
            with m.If(whole):
                m.d.sync += shows

    def _rest(self, m: Module, left: SamplingClock, ready: Value) -> tuple[Any, Value]:
        """Return what follows the velocity of an update, and when it is taken."""
        awaited = Signal()
        whole = Signal()
        m.submodules.rest_left = ResetInserter(ready)(left)
        m.d.comb += whole.eq(awaited & left.last)
        m.d.sync += [awaited.eq(ready | (awaited & ~whole)), self.rest.valid.eq(whole)]
        return self.rest.p, whole

    def _take_counts(self, m: Module) -> Value:
        """Give the machine the counts of a tick, or its read; return the ticks since the one before."""
        if (counts := self.tick_counts) is None:
            follow(m, self.machine, self, ("times", "length", *EXCHANGED * self._spec.form.exchanges))
            follow(m, self, self.machine, ("offset_read",) * self._spec.form.exchanges)
            last = Mux(self.forgets, self._spec.timing.max_ticks, self.silent)
            number = self.number & ~self.forgets
            drive(m, self.machine, {"moved": self.pulse_count, "last": last, "number": number})
            if isinstance(form := self._spec.form, SampledTracking) and form.period_bits:
                kind, fine = form.phase(self.phase)
                drive(m, self.machine, {"kind": kind, "end": kind + 1, "places": fine})
            return Value.cast(self.elapsed)
        m.submodules.tick_counts = counts
        m.d.comb += [counts.tick.eq(self.tick), counts.step.eq(self.step)]
        follow(m, self.machine, counts, ("number", "times", "last", "moved", "length", "kind", "end", "down"))
        self._place(m, counts)
        return Value.cast(counts.elapsed)

    def _place(self, m: Module, counts: TickCounts) -> None:
        """Place the counts where their edges lie; without counts, give the machine the edge that it asks for."""
        machine = self.machine
        if self._spec.displacement is None:
            follow(m, machine, counts, ["places"])
            return
        follow(m, counts, self, DISPLACED)
        places = (counts.places << self._spec.form.fine_bits) + counts.displacements
        edge = Mux(machine.sign, counts.below, counts.above)
        m.d.comb += machine.places.eq(Mux(counts.number > 1, places, Mux(counts.number[0], places, edge) << 6))
