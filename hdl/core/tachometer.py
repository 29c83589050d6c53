"""The whole core."""

from functools import reduce
from operator import and_

from amaranth import Cat, Module, Signal, Value
from amaranth.lib import stream, wiring

from tachometry.hdl.arithmetic.idle import Idle, idle_of
from tachometry.hdl.extras import check_inputs, gates_of, place
from tachometry.hdl.front_end.blanking import Blanking
from tachometry.hdl.front_end.conditioner import InputConditioner
from tachometry.hdl.front_end.decoder import decoder_of
from tachometry.hdl.front_end.external_tick import ExternalTick
from tachometry.hdl.front_end.index_capture import IndexCapture
from tachometry.hdl.front_end.index_state import IndexState
from tachometry.hdl.front_end.modulo_counter import ModuloCounter
from tachometry.hdl.front_end.pin_rise import PinRise
from tachometry.hdl.front_end.position_counter import PositionCounter
from tachometry.hdl.front_end.pulse_counter import PulseCounter
from tachometry.hdl.front_end.sampling_clock import SamplingClock
from tachometry.hdl.front_end.standstill import Standstill
from tachometry.hdl.methods import DATAPATHS
from tachometry.hdl.methods.datapath import LongTicks, OwnStandstill, OwnTicks, RestLater, TickSource
from tachometry.hdl.output.low_pass import LowPass
from tachometry.hdl.output.update import rest_layout, update_layout
from tachometry.hdl.output.update_age import UpdateAge
from tachometry.hdl.output.velocity_output import PipelinedVelocityOutput, SerialVelocityOutput
from tachometry.hdl.wires.delay import delay, held_with
from tachometry.hdl.wires.ports import Box, by_name, follow, members
from tachometry.spec import TachometerSpec
from tachometry.spec.formats.displacement import DISPLACED, MAPPED
from tachometry.spec.formats.tracking_sampled import EXCHANGED
from tachometry.spec.language.port import MISSED, TICK, UPDATE, WHOLE, WIDE


class Tachometer(Box):
    """Takes encoder pins, gives position and velocity.

    Latencies are those of the spec: `pin_to_count`, `tick_latency`, `tick_to_velocity`, in clocks of the `sync` domain.
    Members are the ports of the spec, less `clk` and `rst`, which are those of that domain.
    """

    _skipped: tuple[str, ...] = ("conditioner", "datapath")  # boxes that a simulation may move on

    def __init__(self, spec: TachometerSpec) -> None:
        self._spec = spec
        super().__init__(members(spec.ports))
        self._make_front(spec)
        self.datapath = DATAPATHS[spec.method](spec)
        self.sampling_clock: TickSource
        if isinstance(self.datapath, OwnTicks):
            self.sampling_clock = self.datapath
        elif spec.external_tick:
            self.sampling_clock = ExternalTick(spec.times.min_tick_cycles, spec.tick.longest, spec.latency.tick)
        else:
            self.sampling_clock = SamplingClock(spec.timing.tick_cycles, spec.reads.longest if spec.reads else 0)
        layout = update_layout(spec)
        clears = spec.facts.last_at_rest
        self.low_pass = None if spec.lowpass is None else LowPass(spec.velocity.low_pass, layout, clears=clears)
        self.silence: Standstill | None = None
        if not isinstance(self.datapath, OwnStandstill) and spec.facts.rests_with == TICK:
            self.silence = Standstill(spec.timing.max_ticks, spec.widths.count, max_shift=spec.times.max_tick_shift)
        self.update_age = UpdateAge(spec.timing.max_ticks, spec.widths.stamp) if spec.age else None
        self.velocity_output: SerialVelocityOutput | PipelinedVelocityOutput | None = None
        if spec.velocity.output is not None:
            box = SerialVelocityOutput if spec.latency.output_serial else PipelinedVelocityOutput
            self.velocity_output = box(spec.velocity.output, layout)
        self.extras = {extra.name: gates_of(extra, spec) for extra in spec.extras}

    def _make_front(self, spec: TachometerSpec) -> None:
        """Make the boxes from the pins to the counts of a tick."""
        front, latency = spec.front_end, spec.latency.tick
        held = {line: Blanking(spec.blanking_clocks, starts) for line, starts in front.blanked.items()}
        self.conditioner = InputConditioner(spec.filter_clocks, (*front.lines, *front.sensed), front.complemented, held)
        self.decoder = decoder_of(spec.encoder, front.wheel)
        self.pulse_counter = PulseCounter(
            max(spec.tick.longest, spec.widths.max_pulse_count),
            spec.widths.max_pulse_count,
            stretched=spec.facts.own_ticks,
            staged=latency - spec.latency.registers_steps > 2,
        )
        self.position_counter: Box = PositionCounter(spec.position_width, latency, spec.preset)
        self.controls = {name: PinRise(latency) for name in front.controls}
        self.modulo_counter = None if spec.modulus is None else ModuloCounter(spec.modulus, latency)
        self.index_capture = None
        if spec.index:
            early = spec.displacement is not None
            self.index_capture = IndexCapture(spec.position_width, latency, once=front.index_once, early=early)
        self.index_state: IndexState | None = None
        if (state := front.index_state) is not None:
            self.index_state = IndexState(state, spec.encoder.kind.after(state), latency)

    @property
    def spec(self) -> TachometerSpec:
        """The spec that this core was built from."""
        return self._spec

    @property
    def idle(self) -> tuple[Idle, ...]:
        boxes: dict[str, object] = {name: getattr(self, name) for name in self._skipped}
        boxes |= {f"{name}_box": box for name, box in self.extras.items()}
        if not self._spec.facts.own_ticks:
            boxes["sampling_clock"] = self.sampling_clock
        return idle_of(boxes)

    @property
    def settable(self) -> tuple[wiring.Component, ...]:
        """Boxes with inputs that a program sets."""
        return (self.conditioner, *self.extras.values())

    def build(self, m: Module) -> None:
        self._place_front(m)
        m.submodules.datapath = self.datapath
        if not self._spec.facts.own_ticks:
            m.submodules.sampling_clock = self.sampling_clock
        ticks = Signal(max(self._spec.widths.stamp, 1))  # with the one in this clock
        self._measure(m, {**self._count(m), "stamp": ticks})
        self._rest(m)
        updates = self._output(m)
        self._age(m, ticks, updates)
        self._place(m)
        self._index(m)
        self._extend(m)
        if isinstance(self.sampling_clock, ExternalTick):
            m.d.comb += [
                self.sampling_clock.tick_in.eq(self.tick_in),
                self.tick_error.eq(self.sampling_clock.tick_error),
            ]
        if self._spec.front_end.wheel is not None:
            with m.If(self.pulse_counter.coming):
                m.d.sync += self.synced.eq(self.decoder.synced)
        if self._spec.filter_clocks:
            m.d.comb += self.filtered_edges.eq(self.conditioner.filtered_edges)

    def _place_front(self, m: Module) -> None:
        """Add the boxes from the pins to the counts of a tick."""
        m.submodules.conditioner = self.conditioner
        m.submodules.decoder = self.decoder
        m.submodules.pulse_counter = self.pulse_counter
        m.submodules.position_counter = self.position_counter

    def _count(self, m: Module) -> dict[str, Value]:
        """Count the steps of the pins: the position, and the pulses of a window; return what a datapath may take."""
        (step,) = delay(m, self.decoder.step, clocks=int(self._spec.latency.registers_steps))
        conditioner, decoder = self.conditioner, self.decoder
        position_counter, pulse_counter = self.position_counter, self.pulse_counter
        lines = self._spec.encoder.kind.lines
        m.d.comb += [
            *(getattr(conditioner, line).eq(getattr(self, line)) for line in lines),
            *(getattr(decoder, f"level_{line}").eq(self._level(line)) for line in lines),
            decoder.ready.eq(reduce(and_, (getattr(conditioner, f"ready_{line}") for line in lines))),
            self.decode_error.eq(decoder.decode_error),
            position_counter.step.eq(decoder.step),
            self.position.eq(position_counter.position),
            pulse_counter.step.eq(step),
            pulse_counter.last.eq(self.sampling_clock.last),
            self.tick.eq(pulse_counter.tick),
            self.pulse_count.eq(pulse_counter.pulse_count),
            self.overflow.eq(pulse_counter.overflow),
        ]
        taken: dict[str, Value] = {name: getattr(pulse_counter, name) for name in ("coming", "next_count")}
        inputs, latency = self.datapath.signature.members, self._spec.latency.tick
        if "step" in inputs:
            # As late as `tick`: with it, all steps of the window have come.
            (taken["step"],) = delay(m, decoder.step, clocks=latency)
        if "step_before" in inputs:
            (taken["step_before"],) = delay(m, decoder.step, clocks=latency - 1)
        if isinstance(self.datapath, OwnTicks):
            m.d.comb += pulse_counter.beyond.eq(self.datapath.beyond)
        return {**taken, "step_now": step}

    def _level(self, line: str) -> Value:
        """Return the level of a line that is in the clock domain, as it should be read."""
        level: Value = getattr(self.conditioner, f"level_{line}")
        return ~level if line in self._spec.encoder.inverted else level

    def _measure(self, m: Module, counted: dict[str, Value]) -> None:
        """Give the datapath what its method takes of ticks and counts."""
        taken = {name: getattr(self, name) for name in ("tick", "pulse_count", "position", "overflow")} | counted
        inputs = self.datapath.signature.members
        m.d.comb += [getattr(self.datapath, name).eq(value) for name, value in taken.items() if name in inputs]

    def _rest(self, m: Module) -> None:
        """Drive `standstill`."""
        if isinstance(self.datapath, OwnStandstill):
            m.d.comb += self.standstill.eq(self.datapath.standstill)
        if self.silence is not None:
            m.submodules.silence = silence = self.silence
            m.d.comb += [
                silence.tick.eq(self.tick),
                silence.m_e.eq(self.pulse_count),
                self.standstill.eq(silence.standstill),
            ]
            if isinstance(self.datapath, LongTicks):
                m.d.comb += silence.shift.eq(self.datapath.tick_shift)

    def _output(self, m: Module) -> stream.Interface:
        """Lead updates from the datapath to the ports, through low-pass filter and unit if they are there."""
        updates = self.datapath.updates
        if self.low_pass is not None:
            m.submodules.low_pass = low_pass = self.low_pass
            wiring.connect(m, updates, low_pass.updates)
            m.d.comb += low_pass.tick.eq(self.tick)
            updates = low_pass.filtered
        if self.velocity_output is not None:
            m.submodules.velocity_output = output = self.velocity_output
            wiring.connect(m, updates, output.updates)
            updates = output.shown
        m.d.comb += self.velocity_valid.eq(updates.valid)
        m.d.comb += [getattr(self, name).eq(updates.p[name]) for name in self._spec.ports.strobes[UPDATE]]
        if isinstance(self.datapath, RestLater):
            rest = self.datapath.rest
            m.d.comb += self.update_valid.eq(rest.valid)
            m.d.comb += [getattr(self, name).eq(rest.p[name]) for name in self._spec.ports.strobes[WHOLE]]
        return updates

    def _age(self, m: Module, ticks: Signal, updates: stream.Interface) -> None:
        """Show how many ticks ago the velocity was that of the shaft, if `age` is a port."""
        if self.update_age is None:
            return
        m.submodules.age = age = self.update_age
        m.d.comb += [age.tick.eq(self.tick), age.update.eq(self.velocity_valid), self.age.eq(age.age)]
        if self._spec.widths.stamp:
            before = Signal.like(ticks)
            m.d.sync += before.eq(ticks)
            m.d.comb += [ticks.eq(before + self.tick), age.fresh.eq(before - updates.p.stamp)]

    def _place(self, m: Module) -> None:
        """Let inputs set the position and arm the index, and count modulo a number, if they are asked for."""
        for name, box in self.controls.items():
            m.submodules[f"{name}_rise"] = box
            m.d.comb += [
                getattr(self.conditioner, name).eq(getattr(self, name)),
                box.level.eq(getattr(self.conditioner, f"level_{name}")),
                box.ready.eq(getattr(self.conditioner, f"ready_{name}")),
            ]
        if "preset" in self.controls:
            m.d.comb += self.position_counter.load.eq(self.controls["preset"].rises)
        if self.modulo_counter is not None:
            m.submodules.modulo_counter = counter = self.modulo_counter
            m.d.comb += [
                counter.step.eq(self.decoder.step),
                counter.clear.eq(self.position_counter.clear),
                self.position_modulo.eq(counter.count),
            ]

    def _index(self, m: Module) -> None:
        """Capture the position at the index, if the encoder has one."""
        if self.index_capture is None:
            return
        m.submodules.index_capture = index = self.index_capture
        level, ready = self._index_level(m)
        m.d.comb += [
            index.level_z.eq(level),
            index.ready.eq(ready),
            index.position.eq(self.position_counter.next),
            self.position_counter.clear.eq(index.rises & int(self._spec.front_end.index_resets)),
            self.index_position.eq(index.index_position),
            self.index_valid.eq(index.index_valid),
        ]
        if self._spec.front_end.index_once:
            m.d.comb += [index.arm.eq(self.controls["home"].rises), self.homed.eq(index.homed)]

    def _index_level(self, m: Module) -> tuple[Value, Value]:
        """Return Z as it is, in its state alone, or of a gap, and whether it is real, as is the level before."""
        level: Value
        ready: Value
        if self._spec.front_end.wheel is not None:
            return self.decoder.index, self.decoder.ready
        m.d.comb += self.conditioner.z.eq(self.z)
        level, ready = self._level("z"), self.conditioner.ready_z
        if self.index_state is not None:
            m.submodules.index_state = state = self.index_state
            lines = self._spec.encoder.kind.lines
            m.d.comb += [
                state.level.eq(Cat(getattr(self.decoder, f"level_{line}") for line in lines)),
                state.level_z.eq(level),
                state.step.eq(self.decoder.step),
                state.ready.eq(ready & self.decoder.ready),
            ]
            follow(m, self, state, (WIDE, MISSED))
            level, ready = state.index, state.ready
        return level, ready

    def _extend(self, m: Module) -> None:
        """Put the extras into the core."""
        taps = self._taps(m)
        check_inputs(self._spec, self.extras, {*self.signature.members, *taps})
        place(m, self, self.extras, taps)
        for box in self.extras.values():
            given = box.signature.members.keys() & self.datapath.signature.members.keys()
            follow(m, self.datapath, box, given & {*DISPLACED, MAPPED, *EXCHANGED})

    def _whole(self, m: Module) -> dict[str, Value]:
        """Return what extras may be given of an update: as the method makes it, and as the ports show it when whole."""
        updates = self.datapath.updates
        rest = self.datapath.rest if isinstance(self.datapath, RestLater) else updates
        taps: dict[str, Value] = {"native_valid": rest.valid}
        taps |= {f"native_{name}": updates.p[name] for name in update_layout(self._spec).members}
        if rest is not updates:
            taps |= {f"native_{name}": rest.p[name] for name in rest_layout(self._spec).members} | {UPDATE: rest.valid}
            taken = {name for box in self.extras.values() for name in box.signature.members}
            names = [name for name in self._spec.ports.strobes[UPDATE] if name in taken]
            taps |= held_with(m, rest.valid, by_name(self, names))
        return taps

    def _taps(self, m: Module) -> dict[str, Value]:
        """Lead inputs of extras through the conditioner, and return what else they may be given, by name.

        `level_a`, `ready` and `step` are of the decoder; `level_NAME` and `ready_NAME` of an asynchronous input, a bit
        for each line; `equal_a` says that a line equals its complement; `preset_rises` sets the position, and `moves`
        is high when anything but a step changes it; `next_position` is `position` of the next clock;
        `native_velocity` and others are of an update as the method makes it; `index_rises` is a clock before
        `index_valid`, and `index_seen` two clocks after Z, also of an index that is not taken.
        """
        decoder, box, counter = self.decoder, self.conditioner, self.position_counter
        moves = counter.clear if self._spec.preset is None else counter.clear | counter.load
        taps = {"next_position": counter.next, "moves": moves, **self._whole(m)}
        taps |= {
            name: getattr(decoder, name) for name in decoder.signature.members if name[:5] in ("level", "ready", "step")
        }
        if self.index_capture is not None:
            taps |= {"index_rises": self.index_capture.rises, "index_seen": self.index_capture.first}
        taps |= {f"{name}_rises": control.rises for name, control in self.controls.items()}
        for pin in self._spec.front_end.pins:
            name = pin.port.name
            if pin.of:
                follow(m, box, self, [name])
                taps[f"equal_{pin.of}"] = getattr(box, f"equal_{pin.of}")
            if not pin.lines:
                continue
            m.d.comb += [getattr(box, line).eq(bit) for line, bit in zip(pin.lines, getattr(self, name), strict=True)]
            for kind in ("level", "ready"):
                taps[f"{kind}_{name}"] = Cat(getattr(box, f"{kind}_{line}") for line in pin.lines)
        return taps
