"""A plugin for RIO, the generator of gateware for LinuxCNC: HAL pins as users of encoders know them.

All that RIO carries to the host in a frame is of one clock. What belongs to the host is done there, in C code that RIO
puts into its HAL component: `position-scale`, `index-enable`, and counting on where a number of the frame wraps.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from tachometry.hdl.export.render import render_files
from tachometry.spec.core.front_end import OF_CONTROLS
from tachometry.spec.core.ports import bound_ports
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import INDEX, TICK, UPDATE, Port
from tachometry.spec.registers.buses import Bus
from tachometry.spec.registers.map import RegisterMap

WORD = 32  # bits of the widest number that RIO's component takes as it is
EVENT_BITS = 8  # of a counter that wraps in the gateware and counts on at the host
_MADE = ("NAME_rio/plugin.py", "NAME_rio/NAME_rio.v")
FILES = (*_MADE, "NAME_rio/NAME.v")
# What RIO's users know by another name, and what tells a controller of machines nothing.
_NO_PIN = ("velocity", "position", "interval", "forced", "pulse_count", "overflow")
# When what `RegisterMap.counted` names happens, in Verilog. RIO reads what is latest, so no update is lost.
_EVENTS = {"decode_errors": "decode_error", "overflows": "tick & overflow", "tick_errors": "tick_error"}


@dataclass(frozen=True)
class HalPin:
    """Describes a pin of HAL."""

    kind: str  # `float`, `s32`, `u32` or `bit`
    help: str
    source: str = ""  # what of the frame it is made of; empty: the host makes it


def rio(spec: TachometerSpec, name: str, bus: Bus | None, made: Mapping[str, str]) -> dict[str, str]:
    """Return the plugin, the Verilog between RIO and the core, and the core, as `Target.files` says.

    Raises
    ------
    ParameterError
        If a number of the core is wider than RIO's, or the index sets the position of the core to 0.
    """
    values = _values(spec)
    _check(spec, values)
    events = [event for event in RegisterMap(spec).counted if event in _EVENTS]
    counted = {event: _EVENTS[event] for event in events} | ({"indexes": INDEX} if spec.index else {})
    sent = {_sent_as(port): WORD if port.width > 1 else 1 for port in values}
    files = render_files(
        _MADE,
        name,
        spec=spec,
        hal=hal_pins(spec),
        events=events,
        sent=sent | dict.fromkeys(counted, EVENT_BITS),
        shift=WORD - spec.position_width,
        counts_per_s=spec.scale.rad_per_s_per_lsb / (2 * math.pi) * spec.encoder.counts_per_rev,
        values=values,
        counted=counted,
        sent_as=_sent_as,
        **_connections(spec, values, counted.values()),
    )
    return files | {f"{name}_rio/{name}.v": made[f"{name}.v"]}


def _check(spec: TachometerSpec, values: Iterable[Port]) -> None:
    for name in spec.front_end.controls:
        raise ParameterError(OF_CONTROLS[name], "must not be given for RIO, which has no pin for it")
    if spec.stream:
        raise ParameterError("stream", "must not be given for RIO, which has no DMA for it")
    if spec.front_end.index_resets:
        raise ParameterError("index_reset", "must not be given for RIO: its pin index-enable resets the position")
    for port in values:
        if port.width > WORD:
            option = "position_width" if port.unit == "counts" else "velocity_width"
            most = f"must be at most {WORD} for RIO, whose numbers have no more"
            raise ParameterError(option, f"{most}, not {port.width}")


def hal_pins(spec: TachometerSpec) -> dict[str, HalPin]:
    """Return the pins of HAL by their names."""
    pins = {
        "velocity": HalPin("float", "Velocity, in units of the position per second.", "velocity"),
        "velocity-rpm": HalPin("float", "Velocity of the encoder in rpm, whatever position-scale is.", "velocity"),
        "position": HalPin("float", "The sum of count and position-offset, divided by position-scale.", "position"),
        "count": HalPin(
            "s32", "Counts since power-up" + (", or since the index that reset them." if spec.index else "")
        ),
    }
    if spec.index:
        help = "While it is true, the next index sets count to 0, and this to false."
        pins["index-enable"] = HalPin("bit", help)
    for port in _values(spec):
        if port.name not in (*_NO_PIN, "index_position"):
            pins[_hal(port.name)] = HalPin("u32" if port.width > 1 else "bit", port.help, port.name)
    for event, help in RegisterMap(spec).counted.items():
        if event in _EVENTS:
            pins[_hal(event)] = HalPin("u32", help, event)
    return pins


def _values(spec: TachometerSpec) -> tuple[Port, ...]:
    """Return the outputs that the frame has."""
    left_out = {port.name for port in (*spec.method_ports, *bound_ports(spec))} | {*_NO_PIN} - {"velocity", "position"}
    kept = (port for port in spec.ports.outputs if port.held_by in (TICK, UPDATE, INDEX) and not port.is_strobe)
    return tuple(port for port in kept if port.name not in left_out)


def _connections(spec: TachometerSpec, values: Iterable[Port], happens: Iterable[str]) -> dict[str, object]:
    """Return what each port of the core is connected to, and the wires for it: what is widened, and what is counted."""
    connected = {port.name: "" for port in spec.ports} | {pin.name: pin.name for pin in spec.ports.pins}
    connected |= {"clk": "clk", "rst": "1'b0"} | {port.name: _sent_as(port) for port in values}
    narrow = [port for port in values if 1 < port.width < WORD]
    connected |= {port.name: f"core_{port.name}" for port in narrow}
    signals = [signal for event in happens for signal in event.split(" & ") if not connected[signal]]
    connected |= {signal: signal for signal in signals}
    return {"connected": connected, "narrow": narrow, "signals": signals}


def _sent_as(port: Port) -> str:
    """Return the name of a value in the frame; RIO takes names with the same last word for one."""
    return "indexed_at" if port.name == "index_position" else port.name


def _hal(name: str) -> str:
    return name.replace("_", "-")
