"""`tachometry generate`: the core as Verilog."""

from pathlib import Path

import click

from tachometry.cli.core_options import core_options
from tachometry.cli.files import Outputs
from tachometry.cli.options import GroupedCommand, option
from tachometry.spec import TachometerSpec
from tachometry.spec.manifest import check_module_name


@click.command(
    cls=GroupedCommand,
    short_help="Write a core as Verilog, with its manifest and FuseSoC file.",
    epilog="""\b
Examples:
  tachometry generate --ppr 500 -o build
  tachometry generate --ppr 2048 --clock 100MHz --tick 50us \\
      --max-speed 6000rpm --name spindle -o rtl""",
)
@core_options
@option("Files", "--name", default="tachometer", metavar="NAME", help="Name of the Verilog module and of the files.")
@option(
    "Files",
    "--output",
    "-o",
    "directory",
    type=click.Path(path_type=Path),
    required=True,
    metavar="DIR",
    help="Directory to write to; made if it does not exist, files in it are overwritten.",
)
def generate(spec: TachometerSpec, name: str, directory: Path) -> int:
    """Write a core as Verilog, with its manifest and FuseSoC file.

    \b
    DIR/NAME.v     Verilog-2001 for any tool
    DIR/NAME.json  manifest: ports, widths, units, latencies, every option
    DIR/NAME.core  FuseSoC core file (CAPI2)

    Equal options give equal files, byte for byte, on every machine.
    """
    check_module_name(name)
    files = [f"{name}.{suffix}" for suffix in ("v", "json", "core")]
    with Outputs({file: directory / file for file in files}) as outputs:
        from tachometry.hdl import export

        for file, text in export(spec, name).items():
            outputs[file].write_text(text, encoding="utf-8", newline="\n")
    for file in files:
        click.echo(click.format_filename(directory / file))
    return 0
