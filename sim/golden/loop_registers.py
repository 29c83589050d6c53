"""The golden registers of a core with a control loop show the effect of what is written to them."""

from collections.abc import Iterable, Sequence

from tachometry.sim import golden
from tachometry.sim.golden.command_generator import Command, Demand, Gains
from tachometry.sim.golden.control import run_loop
from tachometry.sim.golden.registers import Access, GoldenBank, initial, written
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec.control.ports import CONTROL, CURRENT, GAIN_PORTS
from tachometry.spec.registers.loop import LoopMap

_COMMANDS = ("command_position", "command_velocity", "command_acceleration")
_DEMANDS = tuple(f"generator_{name}" for name in ("mode", "velocity", "acceleration", "amplitude", "rate"))


class GoldenLoopBank(GoldenBank):
    """Answers for the bank of a core with a control loop whose pins are driven so, with the input `enable` high."""

    def __init__(self, registers: LoopMap, trace: PinTrace) -> None:
        super().__init__(registers, trace)
        self._of_loop, self._trace = registers, trace
        self._strobes = (*self._strobes, CONTROL, CURRENT)

    def answers(self, accesses: Sequence[Access], captures: Iterable[int] = ()) -> list[tuple[int | None, bool]]:
        """Answer accesses, as `GoldenBank.answers` does."""
        loop = self._of_loop.loop
        commands: list[Command] = []
        demands: list[Demand] = []
        gains: list[Gains] = []
        held = dict.fromkeys((port.name for port in loop.held_inputs), 0)
        settings = initial(self._of_loop)
        left = [access for access in accesses if access.data is not None]
        for tick in range(loop.latency.first_tick, self._trace.n_clocks, loop.period):
            # What is written in a clock is there in the next; a clock before the tick all but `enable` is taken.
            while left and left[0].clock + 1 < tick:
                self._write(settings, left.pop(0))
            if not settings["freeze"]:
                held = {name: settings[name] for name in held}
            while left and left[0].clock + 1 <= tick:
                self._write(settings, left.pop(0))
            enable = bool(settings["loop_enable"])
            if loop.command == "generator":
                mode, velocity, acceleration, amplitude, rate = (held[name] for name in _DEMANDS)
                demands.append(Demand(mode, velocity, acceleration, amplitude, rate, enable))
            else:
                place, speed, change = (held[name] for name in _COMMANDS)
                commands.append(Command(place, speed, change, enable))
            gains.append(Gains(*(held[name] for name in (*GAIN_PORTS.values(), "current_limit"))))
        run = run_loop(loop, self._trace, demands or commands, golden.tables, gains)
        self._tables |= {strobe: run.tables[strobe] for strobe in (CONTROL, CURRENT)}
        return super().answers(accesses, captures)

    def _write(self, settings: dict[str, int], access: Access) -> None:
        registers = self._of_loop.registers
        if access.address >= len(registers):
            return
        for field in registers[access.address].fields:
            if field.port in settings:
                settings[field.port] = written(field, access.data or 0, settings[field.port])
