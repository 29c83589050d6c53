"""The registers as a page of Markdown."""

from collections.abc import Iterable, Sequence

from tachometry.hdl.export.registers.values import is_whole, sentences
from tachometry.spec.language.provenance import notice
from tachometry.spec.registers.map import Register, RegisterMap


def page(registers: RegisterMap, name: str) -> str:
    """The text of `NAME_registers.md`.

    Parameters
    ----------
    registers : RegisterMap
    name : str
        Of the Verilog module.
    """
    remark = notice("<!--").replace("\n", " -->\n")
    spec = registers.spec
    return (
        f"# Registers of {name}\n\n{remark}\n"
        f"A tachometer, method {spec.method}: {spec.encoder.counts_per_rev} counts per revolution, a clock of "
        f"{spec.timing.clock_hz} Hz. One LSB of velocity is {spec.rad_per_s_per_lsb!r} rad/s.\n\n"
        "Offsets are in bytes, and all registers have 32 bits. Bits that are not listed read 0. Reading "
        f"{next(register.name for register in registers if register.captures)} captures all captured registers in one "
        "clock, unless CONTROL.hold is set; so does the input `capture`. The others keep what was captured until the "
        f"next capture. Writing a register without a field that can be written is an error.\n\n{tables(registers)}"
    )


def tables(registers: Iterable[Register]) -> str:
    """The tables of registers and of their fields."""
    registers = list(registers)
    rows = [
        [f"`0x{one.offset:02x}`", f"`{one.name}`", _kind(one), f"`0x{one.reset:08x}`", sentences(one)]
        for one in registers
    ]
    fields = [
        [
            f"`{register.name}.{field.name}`",
            str(field.low) if field.width == 1 else f"{field.low + field.width - 1}:{field.low}",
            field.access,
            field.help,
        ]
        for register in registers
        if not is_whole(register)
        for field in register.fields
    ]
    return (
        f"## Registers\n\n{_table(['offset', 'register', 'kind', 'reset', 'meaning'], rows)}\n"
        "## Fields\n\nOf registers that have several. `ro` is read only, `rw` can be written, and `wo` acts when 1 is "
        f"written and reads 0.\n\n{_table(['field', 'bits', 'access', 'meaning'], fields)}"
    )


def _kind(register: Register) -> str:
    if register.constant:
        return "constant"
    if register.captures:
        return "captures"
    return "captured" if register.captured else "live"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines)
