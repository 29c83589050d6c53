"""Files that describe the registers, and the programs in C that read them."""

from tachometry.hdl.export.registers.c_driver import c_driver
from tachometry.hdl.export.registers.c_header import c_header
from tachometry.hdl.export.registers.page import page
from tachometry.hdl.export.registers.rdl import rdl
from tachometry.spec.registers.map import RegisterMap

# What makes them, by what stands behind NAME in the names of the files.
_MAKERS = {".rdl": rdl, "_regs.h": c_header, "_driver.h": c_driver, "_registers.md": page}
REGISTER_FILES = tuple(_MAKERS)


def register_files(registers: RegisterMap, name: str) -> dict[str, str]:
    """Texts by file name: `NAME.rdl`, `NAME_regs.h`, `NAME_driver.h`, `NAME_registers.md`.

    Parameters
    ----------
    registers : RegisterMap
    name : str
        Of the Verilog module.
    """
    return {f"{name}{suffix}": make(registers, name) for suffix, make in _MAKERS.items()}
