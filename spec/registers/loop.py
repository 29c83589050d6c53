"""Registers of a core with a control loop: those of its tachometer, what the loop shows, its commands and gains."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.control.form import GAINS
from tachometry.spec.control.ports import CONTROL, CURRENT, GAIN_PORTS, loop_entries
from tachometry.spec.language.field import WORD, Draft, Field
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import Port
from tachometry.spec.registers.axes import AxesMap
from tachometry.spec.registers.map import RegisterMap

_MODE, _POSITION = "generator_mode", "command_position"
_WORDS = ((0, "_LOW", "Lower word. "), (WORD, "_HIGH", "Upper word. "))


@dataclass(frozen=True)
class LoopMap(RegisterMap):
    """Holds all registers of a core with a control loop.

    What is written is taken with all else in the clock before a control tick, unless LOOP.freeze is set. A value that
    does not fit is held at the nearest that does, but a position wraps.

    It raises ParameterError if the gains of the loop are fixed.
    """

    loop: LoopSpec

    def __post_init__(self) -> None:
        if self.loop.gains != "inputs":
            raise ParameterError("gains", "must be inputs with a bus, which makes them registers, not fixed")

    @classmethod
    def of(cls, core: LoopSpec) -> Self:
        return cls(core.tachometer, core)

    @property
    def core(self) -> LoopSpec:
        return self.loop

    @cached_property
    def ports(self) -> tuple[Port, ...]:
        shown = (port for port in self.loop.ports.outputs if port.held_by in (CONTROL, CURRENT) and not port.is_strobe)
        return (*super().ports, *shown)

    @property
    def quantities(self) -> tuple[tuple[str, float, str], ...]:
        entries = loop_entries(self.loop)
        units = {
            "current": ("amperes_per_lsb", "AMPERES_PER_LSB", "A"),
            "command_position": ("counts_per_lsb", "COUNTS_PER_LSB", "counts"),
            "command_velocity": ("rad_per_s_per_lsb", "RAD_PER_S_PER_LSB", "rad/s"),
            "command_acceleration": ("rad_per_s2_per_lsb", "RAD_PER_S2_PER_LSB", "rad/s²"),
            "filtered_velocity": ("rad_per_s_per_lsb", "RAD_PER_S_PER_LSB", "rad/s"),
            "disturbance": ("torque_per_lsb", "TORQUE_PER_LSB", "Nm"),
        }
        found = [
            (f"{name.upper()}_{macro}", entries[name][key], f"One LSB of {name} in {unit}.")
            for name, (key, macro, unit) in units.items()
        ]
        for name, per_lsb in entries.get("generator", {}).items():
            ((key, value),) = per_lsb.items()
            unit = key.removesuffix("per_lsb").rstrip("_").replace("_per_", "/").replace("tick2", "tick²") or "1"
            text = f"One LSB of generator_{name} in {unit}; a tick is a control tick."
            found.append((f"GENERATOR_{name.upper()}_{key.upper()}", value, text))
        for name, gain in entries["gains"].items():
            found.append(
                (f"{name.upper()}_PER_LSB", gain["per_lsb"], f"One LSB of {name}; the unit is {gain['unit']}.")
            )
        return tuple(found)

    def _added(self) -> Iterable[Draft]:
        inputs = {port.name: port for port in self.loop.held_inputs}
        enable = "The current is 0 unless this is set and the input `enable` is high in the clock of a control tick."
        freeze = "Commands, gains and limit stay as they were, so that several can be written and taken at once."
        fields = [
            Field("enable", 1, 0, enable, writable=True, port="loop_enable"),
            Field("freeze", 1, 1, freeze, writable=True, port="freeze"),
        ]
        if mode := inputs.pop(_MODE, None):
            fields.append(Field("mode", mode.width, 4, mode.help, writable=True, port=mode.name))
        yield "LOOP", "What the control loop does.", tuple(fields), {}
        for port in inputs.values():
            if port.width <= WORD:
                yield port.name.upper(), port.help, (self._whole(port),), {}
                continue
            for shift, end, which in _WORDS:
                yield f"{port.name.upper()}{end}", f"{which}{port.help}", (self._part(port, shift),), {}

    def _reset(self, port: Port) -> int:
        form = self.loop.form
        if port.name == "current_limit":
            return form.current_limit
        gains = {GAIN_PORTS[term]: form.reset_gains[term] for term in GAINS}
        return gains.get(port.name, 0)

    def _whole(self, port: Port) -> Field:
        """Return a port of a word or less."""
        field = replace(_field(port), bits=port.width, signed=port.signed, reset=self._reset(port))
        if port.name == "current_limit":
            return replace(field, least=0, most=self.loop.form.current_limit)
        return field if port.width == WORD else _ranged(field)

    def _part(self, port: Port, shift: int) -> Field:
        """Return a word of a port of two."""
        if not shift:
            return _field(port)
        upper = replace(_field(port), shift=shift, bits=port.width - WORD, signed=port.signed)
        return upper if port.name == _POSITION else _ranged(upper)


def _field(port: Port) -> Field:
    return Field("value", WORD, 0, port.help, writable=True, unit=port.unit, port=port.name)


def _ranged(field: Field) -> Field:
    """Return the field with the limits of its bits, to which a write is held."""
    most = (1 << (field.kept - field.signed)) - 1
    return replace(field, least=-most - 1 if field.signed else 0, most=most)


_MAPS: dict[str, type[RegisterMap]] = {"one": RegisterMap, "axes": AxesMap, "loop": LoopMap}


def registers_of(spec: AnySpec) -> RegisterMap:
    """Return all registers of a core; ParameterError if it can have none."""
    return _MAPS[spec.kind].of(spec)
