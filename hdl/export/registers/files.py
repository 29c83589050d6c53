"""Files that describe the registers, and the programs in C that read them."""

import math
from collections.abc import Iterable

from tachometry.hdl.export.registers import rdl
from tachometry.hdl.export.registers.values import captured_values, in_unit, is_whole, sentences, written_values
from tachometry.hdl.export.render import render, render_files
from tachometry.spec.language.field import Field, Register
from tachometry.spec.registers.map import RegisterMap

# The files, and what --help says of them.
REGISTER_FILES = {
    "NAME.rdl": "registers in SystemRDL 2.0",
    "NAME_regs.h": "registers as macros of C99",
    "NAME_driver.h": "driver in C99",
    "NAME_registers.md": "registers as a page of Markdown",
}


def register_files(registers: RegisterMap, name: str) -> dict[str, str]:
    """Return texts by file name, those of `REGISTER_FILES`.

    - `name`: Of the Verilog module; functions and types in C begin with it, macros with its capitals.
    """
    return render_files(
        REGISTER_FILES,
        name,
        PREFIX=name.upper(),
        registers=registers,
        spec=registers.spec,
        values=captured_values(registers),
        written=written_values(registers),
        in_unit=in_unit,
        word=lambda value: f"UINT32_C(0x{value:08X})",
        pi=math.pi,
        identifier=rdl.identifier,
        described=rdl.described,
        access=rdl.ACCESS,
        **_MEANING,
    )


def tables(registers: Iterable[Register]) -> str:
    """Return the tables of registers and of their fields in Markdown."""
    return render("register_tables.md", registers=list(registers), **_MEANING)


def _kind(register: Register) -> str:
    kinds = {"constant": register.constant, "captures": register.captures, "captured": register.captured}
    return next((kind for kind, holds in kinds.items() if holds), "live")


def _bits(field: Field) -> str:
    return f"{field.low}" if field.width == 1 else f"{field.low + field.width - 1}:{field.low}"


_MEANING = {"is_whole": is_whole, "sentences": sentences, "kind": _kind, "bits": _bits}
