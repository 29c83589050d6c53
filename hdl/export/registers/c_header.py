"""The registers as macros of C99: offsets, masks, resets, and the numbers that turn what they show into quantities."""

import math
import textwrap
from collections.abc import Iterable, Iterator

from tachometry.hdl.export.registers.values import is_whole, sentences
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.language.provenance import notice
from tachometry.spec.registers.map import WORD, Register, RegisterMap

Macro = tuple[str, str, str]  # name, value, and what it means


def c_header(registers: RegisterMap, name: str) -> str:
    """The text of `NAME_regs.h`.

    Parameters
    ----------
    registers : RegisterMap
    name : str
        Of the Verilog module; the macros begin with it, in capitals.
    """
    guard = f"{name.upper()}_REGS_H"
    lines = [
        f"// Registers of {name}, for C99 and C++11. Offsets are in bytes; a register has {WORD} bits.",
        *notice("//").splitlines(),
        "",
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        "#include <stdint.h>",
        "",
        *_defined(numbers(registers), name),
    ]
    for register in registers:
        lines += ["", *comment(sentences(register)), *_defined(of_register(register), name)]
    return "\n".join([*lines, "", "#endif"]) + "\n"


def numbers(registers: RegisterMap) -> tuple[Macro, ...]:
    """Macros that are about the core, not about a register."""
    spec = registers.spec
    radians = spec.rad_per_s_per_lsb
    return (
        ("REGISTERS", str(len(registers.registers)), "Registers; their offsets follow each other without a gap."),
        ("CLOCK_HZ", f"UINT64_C({spec.timing.clock_hz})", "Clocks in a second."),
        ("TICK_CYCLES", f"UINT32_C({spec.timing.tick_cycles})", "Clocks in a sampling period."),
        ("MAX_TICKS", f"UINT32_C({spec.timing.max_ticks})", "Sampling periods in the longest measurement."),
        ("COUNTS_PER_REV", f"UINT32_C({spec.encoder.counts_per_rev})", "Counts in a revolution."),
        ("INTERVAL_UNIT_CYCLES", f"UINT32_C({spec.interval_unit_cycles})", "Clocks in one LSB of interval."),
        ("UNIT", f'"{spec.unit}"', "Unit of velocity."),
        ("UNIT_PER_LSB", repr(2.0**-spec.frac_bits), f"One LSB of velocity in {spec.unit}."),
        ("RAD_PER_S_PER_LSB", repr(radians), "One LSB of velocity in rad/s."),
        ("RAD_PER_COUNT", repr(2 * math.pi / spec.encoder.counts_per_rev), "One count of position in rad."),
        *_of_method(spec),
        *((name, repr(value), told) for name, value, told in registers.quantities),
    )


def _of_method(spec: TachometerSpec) -> Iterator[Macro]:
    """How outputs are read that only this method has."""
    for name, entry in spec.method_entries.items():
        unit = entry.get("unit", "counts")
        yield f"{name.upper()}_PER_LSB", repr(2.0 ** -entry["frac_bits"]), f"One LSB of {name} in {unit}."
        if "rad_per_s2_per_lsb" in entry:
            yield "RAD_PER_S2_PER_LSB", repr(entry["rad_per_s2_per_lsb"]), f"One LSB of {name} in rad/s²."


def of_register(register: Register) -> Iterator[Macro]:
    """Macros of a register and of its fields."""
    yield f"{register.name}_OFFSET", f"UINT32_C(0x{register.offset:02X})", ""
    yield f"{register.name}_RESET", _word(register.reset), ""
    for field in register.fields:
        prefix = f"{register.name}_{field.name.upper()}"
        yield f"{prefix}_MASK", _word(field.mask), "" if is_whole(register) else field.help
        yield f"{prefix}_SHIFT", str(field.low), ""
        yield f"{prefix}_RESET", _word(field.reset), ""


def comment(text: str, indent: str = "") -> list[str]:
    """Lines of a comment."""
    return [f"{indent}// {line}" for line in textwrap.wrap(text, 110, break_on_hyphens=False)]


def _defined(macros: Iterable[Macro], name: str) -> Iterator[str]:
    for macro, value, told in macros:
        yield from comment(told)
        yield f"#define {name.upper()}_{macro} {value}"


def _word(value: int) -> str:
    return f"UINT32_C(0x{value:08X})"
