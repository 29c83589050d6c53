"""Programs for a core on the bus of a processor with Linux, and the device-tree overlay that they need."""

import re
from collections.abc import Mapping

from tachometry.hdl.export.registers.values import captured_values
from tachometry.hdl.export.render import render_files
from tachometry.spec.control import AnySpec
from tachometry.spec.registers.buses import Bus, registers_on

BUSES = ("axi-lite", "apb", "wishbone")
FILES = ("NAME.dtso", "NAME_uio.c", "NAME_uio.py")
_PAGE = 4096  # bytes, the least that can be mapped


def linux(spec: AnySpec, name: str, bus: Bus, made: Mapping[str, str]) -> dict[str, str]:
    """Return texts by file name, those of `FILES`, as `Target.files` says; the program in C needs the core's driver."""
    registers = registers_on(spec, bus)
    values = captured_values(registers)
    speeds, positions = (
        [value.name for value in values if re.fullmatch(rf"{kind}(_\d+)?", value.name)]
        for kind in ("velocity", "position")
    )
    return render_files(
        FILES,
        name,
        PREFIX=name.upper(),
        node=name.replace("_", "-").strip("-").lower(),
        registers=registers,
        spec=spec.tachometer,
        values=values,
        speeds=speeds,
        positions=positions,
        size=max(_PAGE, 1 << registers.address_width),
    )
