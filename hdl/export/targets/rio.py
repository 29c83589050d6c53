"""A plugin for RIO, the generator of gateware for LinuxCNC: HAL pins as users of encoders know them.

All that RIO carries to the host in a frame is of one clock. What belongs to the host is done there, in C code that RIO
puts into its HAL component: `position-scale`, `index-enable`, and counting on where a number of the frame wraps.
"""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from tachometry.hdl.export.render import render_files
from tachometry.spec import CoreSpec, TachometerSpec
from tachometry.spec.core.extras.extra import refuse
from tachometry.spec.core.front_end import OF_CONTROLS
from tachometry.spec.core.ports import bound_ports
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import INDEX, TICK, UPDATE, WHOLE, Port
from tachometry.spec.registers.buses import Bus
from tachometry.spec.registers.map import RegisterMap

WORD = 32  # bits of the widest number that RIO's component takes as it is
EVENT_BITS = 8  # of a counter that wraps in the gateware and counts on at the host
_MADE = ("NAME_rio/plugin.py", "NAME_rio/NAME_rio.v")
FILES = (*_MADE, "NAME_rio/NAME.v")
# What RIO's users know by another name, and what tells a controller of machines nothing.
_NO_PIN = ("velocity", "position", "interval", "forced", "pulse_count", "overflow")
# When what `RegisterMap.counted` names happens, in Verilog. RIO reads what is latest, so no update is lost.
# Of many axes it happens to the axis that a port tells.
_EVENTS = {"decode_errors": "decode_error", "overflows": "tick & overflow", "tick_errors": "tick_error"}
_WHOSE = {"decode_errors": "decode_error_axis", "overflows": "axis", "indexes": "index_axis"}


@dataclass(frozen=True)
class HalPin:
    """Describes a pin of HAL."""

    kind: str  # `float`, `s32`, `u32` or `bit`
    help: str
    source: str = ""  # what of the frame it is made of; empty: the host makes it


def rio(spec: CoreSpec, name: str, bus: Bus | None, made: Mapping[str, str]) -> dict[str, str]:
    """Return the plugin, the Verilog between RIO and the core, and the core, as `Target.files` says."""
    alone, values = spec.tachometer, _values(spec)
    counted = _counted(spec)
    sent = {_sent_as(port): WORD if port.width > 1 else 1 for port in values}
    files = render_files(
        _MADE,
        name,
        spec=alone,
        ports=spec.ports,
        pins=_pins(spec),
        hal=hal_pins(spec),
        events=_events(alone),
        sent=sent | dict.fromkeys(counted, EVENT_BITS),
        shift=WORD - alone.position_width,
        counts_per_s=alone.velocity.rad_per_s_per_lsb / (2 * math.pi) * alone.encoder.counts_per_rev,
        values=values,
        counted=counted,
        sent_as=_sent_as,
        **_connections(spec, values, counted.values()),
    )
    return files | {f"{name}_rio/{name}.v": made[f"{name}.v"]}


def check(spec: CoreSpec) -> None:
    """Raise ParameterError for a core with more than RIO has, or without what its pins need."""
    alone = spec.tachometer
    if spec.axes is not None and not spec.parallel:
        raise ParameterError("parallel", "must be given together with --axes for RIO: HAL has pins for each axis")
    for name in alone.front_end.controls:
        raise ParameterError(OF_CONTROLS[name], "must not be given for RIO, which has no pin for it")
    refuse(alone.extras, "rio")
    if alone.front_end.index_resets:
        raise ParameterError("index_reset", "must not be given for RIO: its pin index-enable resets the position")
    for port in _values(spec):
        if port.width > WORD:
            option = "position_width" if port.unit == "counts" else "velocity_width"
            most = f"must be at most {WORD} for RIO, whose numbers have no more"
            raise ParameterError(option, f"{most}, not {port.width}")


def _ends(spec: CoreSpec) -> list[str]:
    """Return what the names of each axis end with: of a core of one axis, nothing."""
    return [""] if spec.axes is None else [f"_{axis}" for axis in range(spec.axes)]


def _pins(spec: CoreSpec) -> dict[str, str]:
    """Return the pins of the FPGA by their names, and what each is."""
    alone = spec.tachometer.ports.pins
    if spec.axes is None:
        return {pin.name: pin.help for pin in alone}
    own = {f"{pin.name}{end}": pin.help for end in _ends(spec) for pin in alone if pin.name != "tick_in"}
    return own | {pin.name: pin.help for pin in alone if pin.name == "tick_in"}


def hal_pins(spec: CoreSpec) -> dict[str, HalPin]:
    """Return the pins of HAL by their names, which end with the number of the axis if there are axes."""
    alone = spec.tachometer
    pins = {
        "velocity": HalPin("float", "Velocity, in units of the position per second.", "velocity"),
        "velocity-rpm": HalPin("float", "Velocity of the encoder in rpm, whatever position-scale is.", "velocity"),
        "position": HalPin("float", "The sum of count and position-offset, divided by position-scale.", "position"),
        "count": HalPin(
            "s32", "Counts since power-up" + (", or since the index that reset them." if alone.index else "")
        ),
    }
    if alone.index:
        help = "While it is true, the next index sets count to 0, and this to false."
        pins["index-enable"] = HalPin("bit", help)
    first = _ends(spec)[0]
    for port in _values(spec):
        name, help = port.name.removesuffix(first), port.help.removeprefix("Of axis 0, held: ")
        if port.name.endswith(first) and name not in (*_NO_PIN, "index_position"):
            pins[_hal(name)] = HalPin("u32" if port.width > 1 else "bit", help, name)
    events = {_hal(event): HalPin("u32", help, event) for event, help in _events(alone).items()}
    of_all = {name: pin for name, pin in events.items() if spec.axes is not None and pin.source not in _WHOSE}
    own = pins | {name: pin for name, pin in events.items() if name not in of_all}
    return {
        name + _hal(end): replace(pin, source=pin.source and pin.source + end)
        for end in _ends(spec)
        for name, pin in own.items()
    } | of_all


def _events(alone: TachometerSpec) -> dict[str, str]:
    """Return the events that are counted and shown, and what each is."""
    return {event: help for event, help in RegisterMap(alone).counted.items() if event in _EVENTS}


def _counted(spec: CoreSpec) -> dict[str, str]:
    """Return the events that are counted, by the names in the frame, each as a condition in Verilog."""
    events = {event: _EVENTS[event] for event in _events(spec.tachometer)}
    events |= {"indexes": INDEX} if spec.tachometer.index else {}
    if spec.axes is None:
        return events
    width = {port.name: port.width for port in spec.ports}
    own = {
        f"{event}{end}": f"{happens.replace('overflow', f'overflow{end}')} & ({whose} == {width[whose]}'d{axis})"
        for axis, end in enumerate(_ends(spec))
        for event, happens in events.items()
        if (whose := _WHOSE.get(event))
    }
    return own | {event: happens for event, happens in events.items() if event not in _WHOSE}


def _values(spec: CoreSpec) -> tuple[Port, ...]:
    """Return the outputs that the frame has."""
    alone = spec.tachometer
    left_out = {port.name for port in (*alone.method_ports, *bound_ports(alone))} | {*_NO_PIN}
    left_out -= {"velocity", "position"}
    kept = [port for port in spec.ports.outputs if port.held_by in (TICK, UPDATE, WHOLE, INDEX) and not port.is_strobe]
    return tuple(
        port
        for end in _ends(spec)
        for port in kept
        if port.name.endswith(end) and port.name not in _WHOSE.values() and port.name.removesuffix(end) not in left_out
    )


def _connections(spec: CoreSpec, values: Iterable[Port], happens: Iterable[str]) -> dict[str, object]:
    """Return what each port of the core is connected to, and the wires for it: what is widened, and what is counted."""
    connected = {port.name: "" for port in spec.ports} | {pin.name: pin.name for pin in spec.ports.pins}
    if spec.axes is not None:
        lines = [pin.name for pin in spec.ports.pins if pin.name != "tick_in"]
        connected |= {line: f"{{{', '.join(line + end for end in reversed(_ends(spec)))}}}" for line in lines}
    connected |= {"clk": "clk", "rst": "1'b0"} | {port.name: _sent_as(port) for port in values}
    narrow = [port for port in values if 1 < port.width < WORD]
    connected |= {port.name: f"core_{port.name}" for port in narrow}
    words = {word for event in happens for word in re.findall(r"\w+", event)}
    signals = [port for port in spec.ports.outputs if port.name in words and not connected[port.name]]
    connected |= {port.name: port.name for port in signals}
    return {"connected": connected, "narrow": narrow, "signals": signals}


def _sent_as(port: Port) -> str:
    """Return the name of a value in the frame; RIO takes names with the same last word for one."""
    return port.name.replace("index_position", "indexed_at")


def _hal(name: str) -> str:
    return name.replace("_", "-")
