"""A tachometer and the control loop of its shaft."""

from amaranth import Module
from amaranth.lib import wiring

from tachometry.hdl.arithmetic.idle import Idle, IdleEcho, IdleSum, idle_of
from tachometry.hdl.control.command_generator import CommandGenerator
from tachometry.hdl.control.control_clock import ControlClock
from tachometry.hdl.control.controller import Controller
from tachometry.hdl.control.held_inputs import HeldInputs
from tachometry.hdl.control.sigma_delta import SigmaDelta
from tachometry.hdl.control.update_window import UpdateWindow
from tachometry.hdl.core.tachometer import Tachometer
from tachometry.hdl.wires.ports import Box, by_name, drive, follow, hand_through, members
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.ports import GAIN_PORTS

_COMMANDS = ("command_position", "command_velocity", "command_acceleration")
_DEMANDS = ("mode", "velocity", "acceleration", "amplitude", "rate")


class LoopCore(Box):
    """Takes encoder pins and commands, gives the current, and shows all that the tachometer does."""

    def __init__(self, spec: LoopSpec) -> None:
        self._spec = spec
        super().__init__(members(spec.ports))
        self.tachometer = Tachometer(spec.tachometer)
        self.control_clock = ControlClock(spec.latency.first_tick, spec.period, tells=bool(spec.held_inputs))
        self.window = UpdateWindow(spec.form)
        self.controller = Controller(spec.form, spec.multiplier)
        self.sigma_delta = SigmaDelta(spec.current_width)
        self.held_inputs = HeldInputs(spec.held_inputs) if spec.held_inputs else None
        self.generator = CommandGenerator(spec.generator, spec.multiplier) if spec.command == "generator" else None

    @property
    def spec(self) -> LoopSpec:
        """The spec that this core was built from."""
        return self._spec

    @property
    def idle(self) -> tuple[Idle, ...]:
        boxes = {"tachometer": self.tachometer, "control_clock": self.control_clock, "controller": self.controller}
        return (IdleSum("sigma_delta.left"), IdleEcho("sigma_delta.current_pdm"), *idle_of(boxes))

    def build(self, m: Module) -> None:
        m.submodules.tachometer = self.tachometer
        m.submodules.control_clock = self.control_clock
        m.submodules.window = self.window
        m.submodules.controller = self.controller
        m.submodules.sigma_delta = self.sigma_delta
        hand_through(m, self, self.tachometer, members(self._spec.tachometer.ports))
        self._control(m, self._commands(m, self._held(m)))
        self._show(m)

    def _held(self, m: Module) -> wiring.Component:
        """Return the box that has the inputs: this one, or what holds them between two programs."""
        held = self.held_inputs
        if held is None:
            return self
        m.submodules.held_inputs = held
        m.d.comb += [held.coming.eq(self.control_clock.coming), held.freeze.eq(self.freeze)]
        drive(m, held, by_name(self, (port.name for port in self._spec.held_inputs)), "given_{}")
        follow(m, self.controller, held, (*GAIN_PORTS.values(), "current_limit"))
        return held

    def _commands(self, m: Module, given: wiring.Component) -> wiring.Component:
        """Return the box that has the commands: that with the inputs, or the generator, which then shows them."""
        generator = self.generator
        if generator is None:
            return given
        m.submodules.generator = generator
        m.d.comb += [
            generator.tick.eq(self.control_clock.tick),
            generator.enable.eq(self.enable),
            generator.position.eq(self.tachometer.position),
        ]
        drive(m, generator, by_name(given, _DEMANDS, "generator_{}"))
        follow(m, self, generator, _COMMANDS)
        return generator

    def _control(self, m: Module, commands: wiring.Component) -> None:
        """Give the controller what it takes at a control tick, and the window what happens between two of them."""
        clock, tachometer, window, controller = self.control_clock, self.tachometer, self.window, self.controller
        m.d.comb += [
            window.tick.eq(clock.tick),
            window.update.eq(tachometer.velocity_valid),
            window.measured.eq(~tachometer.forced if self._spec.tachometer.facts.awaits_count else 1),
            window.velocity.eq(tachometer.velocity),
            window.clear.eq(controller.clear),
            window.add.eq(controller.valid),
            window.current.eq(controller.current),
            controller.tick.eq(clock.tick),
            controller.position.eq(tachometer.position),
        ]
        follow(m, controller, window, ("due", "held", "n", "current_sum"))
        m.d.comb += controller.enable.eq(self.enable)
        follow(m, controller, commands, _COMMANDS)

    def _show(self, m: Module) -> None:
        """Show the current, as a number and as a stream of bits, and what it was made of."""
        controller, sigma_delta = self.controller, self.sigma_delta
        m.d.comb += [
            self.control_tick.eq(self.control_clock.tick),
            self.current_valid.eq(controller.valid),
            self.current.eq(controller.current),
            self.current_saturated.eq(controller.saturated),
            self.filtered_velocity.eq(controller.y),
            self.disturbance.eq(controller.w),
            sigma_delta.value.eq(controller.current),
            self.current_pdm.eq(sigma_delta.current_pdm),
        ]
