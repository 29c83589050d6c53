"""The whole core."""

from typing import Any

from amaranth import Module, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.conditioner import InputConditioner
from tachometry.hdl.decoder import QuadratureDecoder
from tachometry.hdl.position_counter import PositionCounter
from tachometry.hdl.pulse_counter import PulseCounter
from tachometry.hdl.s_method import SMethod
from tachometry.hdl.sampling_clock import SamplingClock
from tachometry.spec import TachometerSpec

DATAPATHS: dict[str, Any] = {"s": SMethod}


class Tachometer(wiring.Component):
    """Encoder pins in, position and velocity out.

    Latencies are those of the spec: `pin_to_count`, `tick_latency`, `tick_to_velocity`, in clocks of the `sync` domain.

    Parameters
    ----------
    spec : TachometerSpec
        For instance an `STachometer`.

    Members
    -------
    The ports of the spec, less `clk` and `rst`, which are those of the `sync` domain: `a`, `b` in; `velocity`,
    `velocity_valid`, `interval`, `forced`, `tick`, `pulse_count`, `position`, `decode_error`, `overflow`, `stalled`
    out.
    """

    def __init__(self, spec: TachometerSpec) -> None:
        self._spec = spec
        flow = {"input": In, "output": Out}
        super().__init__(
            {
                port.name: flow[port.direction](signed(port.width) if port.signed else port.width)
                for port in spec.ports
                if port.name not in ("clk", "rst")
            }
        )
        cycles = spec.timing.tick_cycles
        self.conditioner = InputConditioner(spec.filter_clocks)
        self.decoder = QuadratureDecoder(spec.encoder.decoding)
        self.sampling_clock = SamplingClock(cycles)
        self.pulse_counter = PulseCounter(cycles, spec.max_count)
        self.position_counter = PositionCounter(spec.position_width)
        self.datapath = DATAPATHS[spec.method](spec)

    @property
    def spec(self) -> TachometerSpec:
        """What this core was built from."""
        return self._spec

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.conditioner = conditioner = self.conditioner
        m.submodules.decoder = decoder = self.decoder
        m.submodules.sampling_clock = sampling_clock = self.sampling_clock
        m.submodules.pulse_counter = pulse_counter = self.pulse_counter
        m.submodules.position_counter = position_counter = self.position_counter
        m.submodules.datapath = datapath = self.datapath
        m.d.comb += [
            conditioner.a.eq(self.a),
            conditioner.b.eq(self.b),
            decoder.level_a.eq(conditioner.level_a),
            decoder.level_b.eq(conditioner.level_b),
            decoder.ready.eq(conditioner.ready),
            self.decode_error.eq(decoder.decode_error),
            position_counter.step.eq(decoder.step),
            self.position.eq(position_counter.position),
            pulse_counter.step.eq(decoder.step),
            pulse_counter.last.eq(sampling_clock.last),
            self.tick.eq(pulse_counter.tick),
            self.pulse_count.eq(pulse_counter.pulse_count),
            self.overflow.eq(pulse_counter.overflow),
            datapath.tick.eq(self.tick),
            datapath.pulse_count.eq(self.pulse_count),
        ]
        m.d.comb += [getattr(self, name).eq(getattr(datapath, name)) for name in datapath.outputs]
        if self._spec.filter_clocks:
            m.d.comb += self.swallowed_edges.eq(conditioner.swallowed_edges)
        return m
