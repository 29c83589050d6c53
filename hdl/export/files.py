"""All files of a core: Verilog, manifest, kit, and those for its registers and for a framework."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from amaranth.lib import wiring

from tachometry.hdl.core.bus_tachometer import BusTachometer
from tachometry.hdl.core.core import core_of
from tachometry.hdl.export.ci import ci_files
from tachometry.hdl.export.kit import KIT, kit
from tachometry.hdl.export.modules import Written, write
from tachometry.hdl.export.registers.files import REGISTER_FILES, register_files
from tachometry.hdl.export.targets.target import TARGETS, bus_for, check_core, target_files
from tachometry.hdl.export.verilog import WRITERS, verilog_of, yosys_text
from tachometry.spec.control import AnySpec
from tachometry.spec.language.port import arranged
from tachometry.spec.language.provenance import entries
from tachometry.spec.registers.buses import Bus, bus_of, manifest_on, ports_on, registers_on
from tachometry.spec.registers.manifest import manifest

# The files of every core, and what --help says of them.
CORE_FILES = {
    "NAME.v": "Verilog-2001 for any tool",
    "NAME.json": "manifest: ports, widths, units, latencies, every option",
    **KIT,
}


def export(
    spec: AnySpec,
    name: str = "tachometer",
    bus: str | None = None,
    baud: int | None = None,
    target: str = "none",
    irq: bool = False,
) -> dict[str, str]:
    """Return all files of a core as texts by file name: those of `CORE_FILES`, of `REGISTER_FILES`, and of the target.

    Equal specs and names give equal texts on every machine with the same version of Amaranth, which the manifest names.
    All texts name the version of tachometry that made them, and their licence.

    Parameters
    ----------
    bus : str or None
        The bus for its registers, one of `spec.registers.buses.BUSES`, or `none`; None: that of the target, or `none`.
    baud : int or None
        Bits a second of a bus that has them; None: its default.
    target : str
        The framework into which it goes, one of `hdl.export.targets.target.TARGETS`, or `none`.
    irq : bool
        The registers have an interrupt, and the core an output for it.

    Raises
    ------
    ValueError
        If `name` cannot be the name of a Verilog module; if there is no such bus, or the clock cannot make its bits; if
        the target needs another bus or core; if the bus cannot reach all registers; if an interrupt has none.
    """
    return core_files(spec, name, bus_of(bus_for(target, bus), baud, irq=irq), target)


def core_files(
    spec: AnySpec, name: str, on: Bus | None, target: str = "none", writer: str = WRITERS[0]
) -> dict[str, str]:
    """Return the files of `export` for a bus; `writer` is one of `verilog.WRITERS`."""
    described = _described(spec, name, on, target)
    files = {} if on is None else register_files(registers_on(spec, on), name)
    core = {
        f"{name}.v": verilog_of(top_of(spec, on), described, arranged(ports_on(spec, on)), writer),
        f"{name}.json": json.dumps(described, indent=2) + "\n",
    }
    core |= kit(spec, name, on) | files
    return recorded(core | target_files(target, spec, name, on, core), name, target, writer=writer)


def top_of(spec: AnySpec, bus: Bus | None) -> wiring.Component:
    """Return the core, with its registers if it is on a bus."""
    return core_of(spec) if bus is None else BusTachometer(registers_on(spec, bus), bus)


def both_texts(spec: AnySpec, name: str, on: Bus | None) -> tuple[str, Written]:
    """Return the text of a core by Yosys, and by tachometry, which are proven to be the same circuit."""
    return yosys_text(top_of(spec, on), name), write(top_of(spec, on), name, arranged(ports_on(spec, on)))


def file_names(name: str) -> list[str]:
    """Return the names of all files that can be made for a core of this name, whatever its options, but of a bench."""
    of_targets = (file for target in TARGETS.values() for file in target.names)
    return [file.replace("NAME", name) for file in (*CORE_FILES, *REGISTER_FILES, *of_targets)] + [*ci_files(name)]


def recorded(
    files: Mapping[str, str],
    name: str,
    target: str = "none",
    testbench: str = "none",
    ci: str = "none",
    writer: str = WRITERS[0],
) -> dict[str, str]:
    """Return the files with a manifest that records what was asked for, and the SHA-256 of each other file.

    `target`, `testbench`, `ci` and `writer` are the values of `--for`, `--testbench`, `--ci` and `--writer`.
    """
    manifest = f"{name}.json"
    hashes = {file: digest(text) for file, text in files.items() if file != manifest}
    asked = {"for": target, "testbench": testbench, "ci": ci} | ({} if writer == WRITERS[0] else {"writer": writer})
    record = {"asked": asked, "files": hashes}
    return {**files, manifest: json.dumps(json.loads(files[manifest]) | record, indent=2) + "\n"}


def digest(text: str) -> str:
    """Return the SHA-256 of a text in UTF-8, by which the manifest knows a file."""
    return hashlib.sha256(text.encode()).hexdigest()


def manifest_of(
    spec: AnySpec, name: str, bus: str | None, baud: int | None, target: str, irq: bool = False
) -> dict[str, Any]:
    """Return what the manifest of a core says; arguments and errors are those of `export`."""
    return _described(spec, name, bus_of(bus_for(target, bus), baud, irq=irq), target)


def _described(spec: AnySpec, name: str, on: Bus | None, target: str) -> dict[str, Any]:
    check_core(target, spec)
    return entries() | (manifest(spec, name) if on is None else manifest_on(registers_on(spec, on), on, name))
