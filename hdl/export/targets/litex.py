"""A module for LiteX: the core with its registers on the Wishbone bus of a SoC."""

from collections.abc import Mapping

from tachometry.hdl.export.render import render_files
from tachometry.spec.control import AnySpec
from tachometry.spec.registers.buses import Bus, registers_on

FILES = ("NAME_litex.py",)


def litex(spec: AnySpec, name: str, bus: Bus, made: Mapping[str, str]) -> dict[str, str]:
    """Return the text of `NAME_litex.py`, which reads the core from the file beside it, as `Target.files` says."""
    return render_files(FILES, name, spec=spec.tachometer, registers=registers_on(spec, bus))
