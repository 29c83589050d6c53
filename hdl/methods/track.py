"""The tracking method."""

from amaranth import Module, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from tachometry.hdl.methods.datapath import datapath_members
from tachometry.hdl.methods.tick_counts import TickCounts
from tachometry.hdl.methods.track_machine import TrackMachine
from tachometry.spec import TrackTachometer


class TrackMethod(wiring.Component):
    """Tracking datapath: a filter for fluctuating measurement time (Tsuji 2009, eq. (22)) of third order.

    Latency: an update comes `spec.latency.datapath` clocks after every `tick`.

    Parameters
    ----------
    spec : TrackTachometer

    Members
    -------
    tick : In(1)
    pulse_count, position : In(signed)
        Valid with `tick`.
    overflow : In(1)
        The tick had more counts than `pulse_count` shows; valid with `tick`, until the next.
    step : In(signed(2))
        As late as `tick`.
    updates : Out(stream)
        `interval` is the number of ticks since the last one with counts. `forced`: this tick had none.
    """

    def __init__(self, spec: TrackTachometer) -> None:
        self._spec = spec
        self.tick_counts = TickCounts(spec.form, spec.timing.max_ticks)
        self.machine = TrackMachine(spec.program, moved_width=spec.widths.count)
        super().__init__(
            {
                **datapath_members(spec),
                "step": In(signed(2)),
                "overflow": In(1),
                "position": In(signed(spec.position_width)),
            }
        )

    @property
    def probes(self) -> dict[str, Value]:
        """Signals of the inside that a waveform should show."""
        return {"counts_number": self.tick_counts.number, "counts_times": self.tick_counts.times}

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._spec
        m.submodules.tick_counts = counts = self.tick_counts
        m.submodules.machine = machine = self.machine
        position = Signal.like(self.position)
        with m.If(self.tick):
            m.d.sync += position.eq(self.position)
        m.d.comb += [
            counts.tick.eq(self.tick),
            counts.step.eq(self.step),
            counts.tracks.eq(machine.tracks),
            machine.begin.eq(self.tick),
            machine.counted.eq(counts.counted),
            machine.beyond.eq(self.overflow),
            machine.quiet.eq(counts.quiet),
            machine.number.eq(counts.number),
            machine.times.eq(counts.times),
            machine.places.eq(counts.places),
            machine.moved.eq(self.pulse_count),
            machine.length.eq(counts.length),
        ]
        new = self.updates.p
        shift = spec.form.frac_bits - spec.fine_bits
        m.d.sync += self.updates.valid.eq(machine.out)
        with m.If(machine.out):
            m.d.sync += [
                new.velocity.eq(machine.velocity),
                new.acceleration.eq(machine.acceleration),
                new.position_fine.eq((position << spec.fine_bits) + (machine.p >> shift) + machine.p[shift - 1]),
                new.interval.eq(counts.elapsed),
                new.forced.eq(~counts.counted),
            ]
        if spec.widths.stamp:
            stamp = Signal.like(self.stamp)
            with m.If(self.tick):
                m.d.sync += stamp.eq(self.stamp)
            with m.If(machine.out):
                m.d.sync += new.stamp.eq(stamp)
        return m
