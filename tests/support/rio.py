"""RIO is imitated as far as its plugins meet it: names, and the C code around that of a plugin."""

import re
import sys
import types
from collections.abc import Mapping
from typing import Any

# RIO gives a pin a float with a scale and an offset, or a plain number, or a bit.
_TYPES = {"float": "double", "s32": "int32_t", "u32": "uint32_t", "bit": "bool"}
_AROUND = ("_OFFSET", "_SCALE", "_ABS", "_S32", "_U32_ABS")


class PluginBase:
    """Makes names as RIO does."""

    def __init__(self, plugin_id: int, plugin_setup: Mapping[str, Any], system_setup: Mapping[str, Any]) -> None:
        self.system_setup = system_setup
        self.instances_name = plugin_setup["uid"]
        self.SIGNALS: dict[str, dict[str, Any]] = {}
        self.INTERFACE: dict[str, dict[str, Any]] = {}
        self.setup()

    def setup(self) -> None:
        raise NotImplementedError

    def signals(self) -> dict[str, dict[str, Any]]:
        for name, setup in self.SIGNALS.items():
            way = setup["direction"].upper().replace("PUT", "")
            setup["varname"] = f"SIG{way}_BOARD0_{self.instances_name}_{name}".upper().replace("-", "_")
        return self.SIGNALS

    def interface_data(self) -> dict[str, dict[str, Any]]:
        for name, setup in self.INTERFACE.items():
            setup["variable"] = f"VARIN{setup['size']}_{self.instances_name}_{name}".upper()
        return self.INTERFACE

    def gateware_instances_base(self) -> dict[str, Any]:
        return {self.instances_name: {}}


def loaded(text: str, clock_hz: int) -> Any:
    """Return the plugin of this text, as a part of a configuration with this clock."""
    plugins = types.ModuleType("riocore.plugins")
    plugins.__dict__["PluginBase"] = PluginBase
    kept = {name: sys.modules.get(name) for name in ("riocore", "riocore.plugins")}
    sys.modules |= {"riocore": types.ModuleType("riocore"), "riocore.plugins": plugins}
    try:
        names: dict[str, Any] = {}
        exec(compile(text, "plugin.py", "exec"), names)
    finally:
        for name, module in kept.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module
    return names["Plugin"](0, {"uid": "tacho0"}, {"speed": clock_hz})


def hal_type(pin: Mapping[str, Any]) -> str:
    return "bit" if pin.get("bool") else pin["hal_type"]


def component(plugin: Any) -> str:
    """Return a program in C that reads what the FPGA sends, a frame a line, with index-enable before it, and prints all
    pins.

    An index-enable that a line does not set stays as it is. Scale and offset of the position come first.
    """
    pins, sent = plugin.signals(), plugin.interface_data()
    fields, calls, bodies, begin = [], [], [], []
    for one in sent.values():
        fields.append(f"{'bool' if one['size'] == 1 else 'int{}_t'.format(one['size'])} {one['variable']};")
    for name, pin in pins.items():
        kind, variable = hal_type(pin), pin["varname"]
        around = _AROUND if kind == "float" else ()
        for place in (variable, *(variable + more for more in around)):
            of = "int32_t" if place.endswith("_S32") else "uint32_t" if place.endswith("_U32_ABS") else _TYPES[kind]
            fields.append(f"{of} *{place};")
            begin.append(f"static {of} of_{place}; data->{place} = &of_{place};")
        begin += [f"*data->{variable}_SCALE = 1;"] if around else []
        if pin["direction"] != "input" or pin.get("helper"):
            continue
        source = sent[pin["interface"]]["variable"]
        body = [f"{'float' if kind == 'float' else _TYPES[kind]} value = data->{source};"]
        if around:
            body += [f"float offset = *data->{variable}_OFFSET;", f"float scale = *data->{variable}_SCALE;"]
        body.append(plugin.convert_c(name, pin))
        body += ["value = (value + offset) / scale;"] if around else []
        bodies.append(f"static void convert_{variable}(data_t *data) {{\n" + "\n".join(body))
        bodies[-1] += f"\n*data->{variable} = value;\n}}\n"
        calls.append(f"convert_{variable}(data);")
    positions = [pin["varname"] for name, pin in pins.items() if re.fullmatch(r"position(-\d+)?", name)]
    enables = [pin["varname"] for name, pin in pins.items() if name.startswith("index-enable")]
    read = [f'if (scanf("%lf", &number) != 1) return 1;\ndata->{one["variable"]} = number;' for one in sent.values()]
    show = [f'printf("%.17g ", (double)*data->{pin["varname"]});' for pin in pins.values()]
    lines = [
        *("#include <math.h>", "#include <stdbool.h>", "#include <stdint.h>", "#include <stdio.h>"),
        *("typedef struct {", *fields, "} data_t;", *bodies, "int main(void) {", "data_t all, *data = &all;", *begin),
        'double scale, offset; if (scanf("%lf %lf", &scale, &offset) != 2) return 1;',
        *(f"*data->{one}_SCALE = scale; *data->{one}_OFFSET = offset;" for one in positions),
        *("double number;", 'while (scanf("%lf", &number) == 1) {'),
        *(f"if (number != 0) *data->{enable} = 1;" for enable in enables),
        *(*read, *calls, *show, 'printf("\\n");', "}", "return 0;", "}"),
    ]
    return "\n".join(lines) + "\n"
