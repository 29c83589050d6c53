"""A tachometer and the control loop of its shaft."""

from amaranth import Module
from amaranth.lib import wiring

from tachometry.hdl.control.command_generator import CommandGenerator
from tachometry.hdl.control.control_clock import ControlClock
from tachometry.hdl.control.controller import Controller
from tachometry.hdl.control.held_inputs import HeldInputs
from tachometry.hdl.control.sigma_delta import SigmaDelta
from tachometry.hdl.control.update_window import UpdateWindow
from tachometry.hdl.core.tachometer import Tachometer
from tachometry.hdl.wires.ports import members
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.ports import GAIN_PORTS

_COMMANDS = ("command_position", "command_velocity", "command_acceleration")
_DEMANDS = ("mode", "velocity", "acceleration", "amplitude", "rate")


class LoopCore(wiring.Component):
    """Encoder pins and commands in, current out, and all that the tachometer shows.

    Parameters
    ----------
    spec : LoopSpec

    Members
    -------
    The ports of the spec, less `clk` and `rst`, which are those of the `sync` domain.
    """

    def __init__(self, spec: LoopSpec) -> None:
        self._spec = spec
        super().__init__(members(spec.ports))
        self.tachometer = Tachometer(spec.tachometer)
        self.control_clock = ControlClock(spec.first_tick, spec.period, tells=bool(spec.held_inputs))
        self.window = UpdateWindow(spec.form)
        self.controller = Controller(spec.form, spec.multiplier)
        self.sigma_delta = SigmaDelta(spec.current_width)
        self.held_inputs = HeldInputs(spec.held_inputs) if spec.held_inputs else None
        self.generator = CommandGenerator(spec.generator, spec.multiplier) if spec.command == "generator" else None

    @property
    def spec(self) -> LoopSpec:
        """The spec that this core was built from."""
        return self._spec

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.tachometer = tachometer = self.tachometer
        m.submodules.control_clock = clock = self.control_clock
        m.submodules.window = window = self.window
        m.submodules.controller = controller = self.controller
        m.submodules.sigma_delta = sigma_delta = self.sigma_delta
        for port in self._spec.tachometer.ports:
            if port.name not in ("clk", "rst"):
                inner, outer = getattr(tachometer, port.name), getattr(self, port.name)
                m.d.comb += inner.eq(outer) if port.direction == "input" else outer.eq(inner)
        given: LoopCore | HeldInputs = self
        if self.held_inputs is not None:
            m.submodules.held_inputs = given = self.held_inputs
            m.d.comb += [
                given.coming.eq(clock.coming),
                given.freeze.eq(self.freeze),
                *(getattr(given, f"given_{port.name}").eq(getattr(self, port.name)) for port in self._spec.held_inputs),
                *(
                    getattr(controller, name).eq(getattr(given, name))
                    for name in (*GAIN_PORTS.values(), "current_limit")
                ),
            ]
        if self.generator is None:
            commands: CommandGenerator | LoopCore | HeldInputs = given
        else:
            m.submodules.generator = commands = generator = self.generator
            m.d.comb += [
                generator.tick.eq(clock.tick),
                generator.enable.eq(self.enable),
                generator.position.eq(tachometer.position),
                *(getattr(generator, name).eq(getattr(given, f"generator_{name}")) for name in _DEMANDS),
                *(getattr(self, name).eq(getattr(generator, name)) for name in _COMMANDS),
            ]
        m.d.comb += [
            window.tick.eq(clock.tick),
            window.update.eq(tachometer.velocity_valid),
            window.velocity.eq(tachometer.velocity),
            window.clear.eq(controller.clear),
            window.add.eq(controller.valid),
            window.current.eq(controller.current),
            controller.tick.eq(clock.tick),
            controller.position.eq(tachometer.position),
            *(getattr(controller, name).eq(getattr(window, name)) for name in ("due", "held", "n", "current_sum")),
            controller.enable.eq(self.enable),
            *(getattr(controller, name).eq(getattr(commands, name)) for name in _COMMANDS),
            self.control_tick.eq(clock.tick),
            self.current_valid.eq(controller.valid),
            self.current.eq(controller.current),
            self.current_saturated.eq(controller.saturated),
            self.filtered_velocity.eq(controller.y),
            self.disturbance.eq(controller.w),
            sigma_delta.value.eq(controller.current),
            self.drive.eq(sigma_delta.drive),
        ]
        return m
