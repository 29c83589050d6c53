"""A plugin for RIO, the generator of gateware for LinuxCNC: HAL pins as users of encoders know them.

All that RIO carries to the host in a frame is of one clock. What belongs to the host is done there, in C code that RIO
puts into its HAL component: `position-scale`, `index-enable`, and counting on where a number of the frame wraps.
"""

import json
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import INDEX, TICK, UPDATE, Port
from tachometry.spec.language.provenance import notice
from tachometry.spec.registers.map import RegisterMap

WORD = 32  # bits of the widest number that RIO's component takes as it is
EVENT_BITS = 8  # of a counter that wraps in the gateware and counts on at the host
# What RIO's users know by another name, and what tells a controller of machines nothing.
_NO_PIN = ("velocity", "position", "interval", "forced", "pulse_count", "overflow")
# When what `RegisterMap.counted` names happens, in Verilog. RIO reads what is latest, so no update is lost.
_EVENTS = {"decode_errors": "decode_error", "overflows": "tick & overflow", "tick_errors": "tick_error"}

_VERILOG = """\
// Gateware of the RIO plugin @NAME@_rio: the core @NAME@, with its outputs as wide as RIO carries them.
@NOTICE_SLASHES@
module @NAME@_rio (
@PORTS@
);
@BODY@
endmodule
"""

_PLUGIN = '''\
"""RIO plugin @NAME@_rio, a tachometer. This folder belongs into the folder `plugins` of riocore."""
@NOTICE_HASH@

from string import Template

from riocore.plugins import PluginBase

CLOCK_HZ = @CLOCK_HZ@
COUNTS_PER_S = @COUNTS_PER_S@  # one LSB of the velocity in counts per second
RPM = @RPM@  # the same in rpm

# Pins of the FPGA.
PINS = {
@PINS@
}
# What the FPGA sends, in bits.
SENT = {
@SENT@
}
# Pins of HAL: the type, what it is made of, and what it means. What is made of nothing, C_CODE sets.
HAL = {
@HAL@
}
# RIO computes in single precision and returns here; the position is exact, and counts on where it wraps in the FPGA.
POSITION = """
    static int64_t total = 0;
    static int32_t before = 0;
    const int32_t now = data->$sent_position;
    total += (int32_t)(((uint32_t)now - (uint32_t)before) << @SHIFT@) >> @SHIFT@;
    before = now;@INDEX@
    const double shown = ((double)@COUNT@ + *data->${position}_OFFSET) / *data->${position}_SCALE;
    *data->$count = (int32_t)(uint32_t)@COUNT@;
    *data->${position}_ABS = fabs(shown);
    *data->${position}_S32 = (int32_t)shown;
    *data->${position}_U32_ABS = (uint32_t)fabs(shown);
    *data->$position = shown;
    return;
"""
# The FPGA counts what happens, and its counter wraps.
EVENTS = """
    static uint32_t events = 0;
    static uint8_t before = 0;
    events += (uint8_t)((uint8_t)value - before);
    before = (uint8_t)value;
    value = events;
"""
# What RIO does with a value before it divides it by the scale of its pin.
C_CODE = {
    "velocity": f"value = value * {COUNTS_PER_S!r} / *data->${{position}}_SCALE;",
    "velocity-rpm": f"value = value * {RPM!r};",
    "position": POSITION,
@OF_EVENTS@
}


class Plugin(PluginBase):
    def setup(self):
        self.NAME = "@NAME@_rio"
        self.INFO = "tachometer: velocity and position of an incremental encoder"
        self.DESCRIPTION = @DESCRIPTION@
        self.KEYWORDS = "encoder feedback velocity spindle tachometer"
        self.VERILOGS = ["@NAME@_rio.v", "@NAME@.v"]
        self.NEEDS = ["fpga"]
        self.PINDEFAULTS = {
            name: {"direction": "input", "invert": False, "pull": "up", "description": told}
            for name, told in PINS.items()
        }
        self.INTERFACE = {name: {"size": bits, "direction": "input"} for name, bits in SENT.items()}
        self.SIGNALS = {name: self.hal_pin(*about) for name, about in HAL.items()}

    @staticmethod
    def hal_pin(kind, source, told):
        pin = {"direction": "input", "description": told}
        pin |= {"bool": True} if kind == "bit" else {"hal_type": kind}
        if source:
            return pin | {"interface": source}
        return pin | ({"direction": "inout"} if kind == "bit" else {"helper": True})

    def gateware_instances(self):
        speed = int(self.system_setup["speed"])
        if speed != CLOCK_HZ:
            raise ValueError(f"the clock of the FPGA must be {CLOCK_HZ} Hz for @NAME@_rio, not {speed} Hz")
        return self.gateware_instances_base()

    def convert(self, signal_name, signal_setup, value):
        """What RIO's own test programs show."""
        return value * {"velocity": COUNTS_PER_S, "velocity-rpm": RPM}.get(signal_name, 1)

    def convert_c(self, signal_name, signal_setup):
        names = {name.replace("-", "_"): setup["varname"] for name, setup in self.signals().items()}
        names |= {f"sent_{name}": setup["variable"] for name, setup in self.interface_data().items()}
        return Template(C_CODE.get(signal_name, "")).substitute(names)
'''

_INDEX = """
    static int64_t origin = 0;
    static int indexes_before = -1;
    const int indexes = (uint8_t)data->$sent_indexes;
    if (indexes != indexes_before && indexes_before >= 0 && *data->$index_enable) {
        origin = total - ((int32_t)(((uint32_t)now - (uint32_t)data->$sent_indexed_at) << @SHIFT@) >> @SHIFT@);
        *data->$index_enable = 0;
    }
    indexes_before = indexes;"""


@dataclass(frozen=True)
class HalPin:
    """A pin of HAL.

    Parameters
    ----------
    kind : str
        `float`, `s32`, `u32` or `bit`.
    help : str
    source : str
        What of the frame it is made of; empty: the host makes it.
    """

    kind: str
    help: str
    source: str = ""


def rio_files(name: str) -> tuple[str, ...]:
    """Names of the files: a folder that goes into that of RIO's plugins."""
    return tuple(f"{name}_rio/{file}" for file in ("plugin.py", f"{name}_rio.v", f"{name}.v"))


def rio(spec: TachometerSpec, name: str, verilog: str) -> dict[str, str]:
    """Texts by file name: the plugin, the Verilog between RIO and the core, and the core.

    Parameters
    ----------
    spec : TachometerSpec
    name : str
        Of the module of the core.
    verilog : str
        The core.

    Raises
    ------
    ParameterError
        If a number of the core is wider than RIO's, or the index sets the position of the core to 0.
    """
    if spec.index_reset:
        raise ParameterError("index_reset", "must not be given for RIO: its pin index-enable resets the position")
    values = _values(spec)
    for port in values:
        if port.width > WORD:
            what = "position_width" if port.unit == "counts" else "velocity_width"
            raise ParameterError(what, f"must be at most {WORD} for RIO, whose numbers have no more, not {port.width}")
    events = {what: told for what, told in RegisterMap(spec).counted.items() if what in _EVENTS}
    sent = {_sent(port): WORD if port.width > 1 else 1 for port in values}
    sent |= dict.fromkeys([*events, *(["indexes"] if spec.index else [])], EVENT_BITS)
    text = _PLUGIN.replace("@INDEX@", _INDEX if spec.index else "")
    per_s = spec.rad_per_s_per_lsb / (2 * math.pi) * spec.encoder.counts_per_rev
    parts: dict[str, object] = {
        "CLOCK_HZ": spec.timing.clock_hz,
        "COUNTS_PER_S": repr(per_s),
        "RPM": repr(per_s * 60 / spec.encoder.counts_per_rev),
        "PINS": _table({pin.name: pin.help for pin in spec.pins}),
        "SENT": _table(sent),
        "HAL": _table({pin: (one.kind, one.source, one.help) for pin, one in hal_pins(spec).items()}),
        "SHIFT": WORD - spec.position_width,
        "COUNT": "(total - origin)" if spec.index else "total",
        "OF_EVENTS": "\n".join(f'    "{_hal(what)}": EVENTS,' for what in events),
        "DESCRIPTION": _literal(_description(spec, name)),
    }
    texts = (_filled(text, name, parts), _wrapper(spec, name, values, events), verilog)
    return dict(zip(rio_files(name), texts, strict=True))


def hal_pins(spec: TachometerSpec) -> dict[str, HalPin]:
    """Pins of HAL by their names."""
    found = {
        "velocity": HalPin("float", "Velocity, in units of the position per second.", "velocity"),
        "velocity-rpm": HalPin("float", "Velocity of the encoder in rpm, whatever position-scale is.", "velocity"),
        "position": HalPin("float", "The sum of count and position-offset, divided by position-scale.", "position"),
        "count": HalPin("s32", "Counts since power-up" + ", or since the index that reset them." * spec.index),
    }
    if spec.index:
        told = "While it is true, the next index sets count to 0, and this to false."
        found["index-enable"] = HalPin("bit", told)
    for port in _values(spec):
        if port.name not in (*_NO_PIN, "index_position"):
            found[_hal(port.name)] = HalPin("u32" if port.width > 1 else "bit", port.help, port.name)
    for what, told in RegisterMap(spec).counted.items():
        if what in _EVENTS:
            found[_hal(what)] = HalPin("u32", told, what)
    return found


def _values(spec: TachometerSpec) -> tuple[Port, ...]:
    """Outputs that the frame has."""
    left_out = {port.name for port in (*spec.method_ports, *spec.bound_ports)} | {*_NO_PIN} - {"velocity", "position"}
    kept = (port for port in spec.outputs if port.held_by in (TICK, UPDATE, INDEX) and not port.is_strobe)
    return tuple(port for port in kept if port.name not in left_out)


def _wrapper(spec: TachometerSpec, name: str, values: Iterable[Port], events: Iterable[str]) -> str:
    """The Verilog between RIO and the core."""
    ports = [f"input wire {pin}" for pin in ("clk", *(pin.name for pin in spec.pins))]
    wires, connected = [], {pin.name: pin.name for pin in spec.pins} | {"clk": "clk", "rst": "1'b0"}
    after = []
    for port in values:
        ports.append(f"output wire {f'[{WORD - 1}:0] ' * (port.width > 1)}{_sent(port)}")
        connected[port.name] = _sent(port)
        if 1 < port.width < WORD:
            connected[port.name] = inner = f"core_{port.name}"
            wires.append(f"wire [{port.width - 1}:0] {inner};")
            fill = f"{inner}[{port.width - 1}]" if port.signed else "1'b0"
            after.append(f"assign {_sent(port)} = {{{{{WORD - port.width}{{{fill}}}}}, {inner}}};")
    counted = {what: _EVENTS[what] for what in events} | ({"indexes": INDEX} if spec.index else {})
    for what, happens in counted.items():
        ports.append(f"output reg [{EVENT_BITS - 1}:0] {what}")
        after += [
            f"initial {what} = {EVENT_BITS}'d0;",
            f"always @(posedge clk) if ({happens}) {what} <= {what} + {EVENT_BITS}'d1;",
        ]
        for signal in happens.split(" & "):
            if signal not in connected:
                connected[signal] = signal
                wires.append(f"wire {signal};")
    pairs = [f".{port.name}({connected.get(port.name, '')})" for port in spec.ports]
    body = [
        "/* verilator lint_off PINCONNECTEMPTY */",
        *wires,
        f"{name} core (",
        *(f"  {pair}{',' * (place < len(pairs))}" for place, pair in enumerate(pairs, 1)),
        ");",
        *after,
    ]
    return _filled(_VERILOG, name, {"PORTS": ",\n".join(f"  {port}" for port in ports), "BODY": _indented(body)})


def _description(spec: TachometerSpec, name: str) -> str:
    return (
        f"Measures with the core {name}, method {spec.method}: {spec.encoder.counts_per_rev} counts per revolution, a "
        f"clock of {spec.timing.clock_hz} Hz. position-scale is in counts per unit of the position."
    )


def _sent(port: Port) -> str:
    """What a value is called in the frame; RIO takes names with the same last word for one."""
    return "indexed_at" if port.name == "index_position" else port.name


def _hal(name: str) -> str:
    return name.replace("_", "-")


def _filled(text: str, name: str, parts: Mapping[str, object]) -> str:
    known = {
        "NAME": name,
        "NOTICE_HASH": notice("#").rstrip("\n"),
        "NOTICE_SLASHES": notice("//").rstrip("\n"),
        **parts,
    }
    return re.sub("@([A-Z_]+)@", lambda mark: str(known[mark[1]]), text)


def _table(rows: Mapping[str, object]) -> str:
    """The inside of a dictionary of Python."""
    return "\n".join(f"    {_literal(key)}: {_literal(value)}," for key, value in rows.items())


def _literal(value: object) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_literal, value))})"
    return json.dumps(value, ensure_ascii=False)


def _indented(lines: Iterable[str]) -> str:
    return "\n".join(f"  {line}" for line in lines)
