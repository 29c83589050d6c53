"""A module for LiteX: the core with its registers on the Wishbone bus of a SoC."""

from tachometry.hdl.export.render import render_files
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.registers.map import RegisterMap


def litex(spec: TachometerSpec, name: str, verilog: str) -> dict[str, str]:
    """Return the text of `NAME_litex.py` by its name.

    Parameters
    ----------
    spec : TachometerSpec
    name : str
        Of the Verilog module.
    verilog : str
        The core, which the module reads from the file beside it.
    """
    return render_files(["NAME_litex.py"], name, spec=spec, registers=RegisterMap(spec))
