"""Which survivors cannot be told from the core, proven by one step of induction with Yosys' `sat`.

The lemmas of a case are about the core's registers alone. They are proven first: they hold after power-up, and where
they hold they hold a clock later. A mutant is then compared with the core in a single clock, in any state in which the
lemmas hold. Both have the same registers, but for those that the mutant was seen to set differently: of these it has
any values. If all outputs are equal, and all that goes into shared registers and memories, no clock shows the mutant.
"""

import re
import tempfile
from concurrent.futures import Executor
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from proofs.mutation.cases import Pins
from proofs.mutation.netlist import SELECTOR, WIDTH, yosys
from proofs.mutation.opened import Opened, written

_MAKE = """\
read_rtlil cut.il
read_verilog step.v
hierarchy -top step
proc
memory_collect
memory_map
flatten
setundef -zero
opt -full
cd step
delete -input w:mutsel w:differs_*
write_rtlil step.il
"""
_SECONDS = 60  # for a mutant
_LEMMAS_SECONDS = 1800  # without them there is nothing
_TOGETHER = 8  # mutants for one run of Yosys
_EQUAL = "-set now 1'1 -prove equal 1'1"
_VERDICT = re.compile(r"SAT proof finished - (no )?model found|(Interrupted SAT solver)")


class Known(NamedTuple):
    """Holds the lemmas about a core, in Verilog, with its registers.

    Members
    -------
    definitions : list of str
        Lines of Verilog for what the others use.
    lemmas : list of str
        What always holds.
    """

    definitions: list[str]
    lemmas: list[str]


def _ports(name: str, cut: Opened) -> str:
    return ", ".join(f"input [{one.width - 1}:0] {name}_{k}" for k, one in enumerate(cut.registers))


def _lemmas(cut: Opened, known: Known) -> str:
    """Return a module that says whether the lemmas hold."""
    right = " && ".join(f"({lemma})" for lemma in known.lemmas)
    head = f"module lemmas({_ports('core_q', cut)}, output hold);"
    return "\n".join([head, *known.definitions, f"assign hold = {right};", "endmodule", ""])


def _step(ports: Pins, cut: Opened) -> str:
    """Return core and mutant in a clock."""
    pins = [port.name for port in ports.inputs]
    head = [f"input [{port.width - 1}:0] {port.name}" for port in ports.inputs]
    head += [
        f"input [{WIDTH - 1}:0] {SELECTOR}",
        *(_ports(name, cut) for name in ("q", "own", "differs")),
    ]
    lines, equal = [], []
    links: dict[str, list[str]] = {"core": [], "mutant": []}
    for k, register in enumerate(cut.registers):
        lines.append(f"wire [{register.width - 1}:0] core_d_{k}, mutant_d_{k};")
        links["core"].append(f".q_{k}(q_{k})")
        links["mutant"].append(f".q_{k}((q_{k} & ~differs_{k}) | (own_{k} & differs_{k}))")
        for side, link in links.items():
            link.append(f".d_{k}({side}_d_{k})")
        equal.append(f"((core_d_{k} ^ mutant_d_{k}) & ~differs_{k}) == 0")
    for k, memory in enumerate(cut.memories):
        head.append(f"input [{memory.width - 1}:0] any_{k}, other_{k}")
        lines += written(k, memory, links, equal)
    for port in ports.outputs:
        lines.append(f"wire [{port.width - 1}:0] core_{port.name}, mutant_{port.name};")
        equal.append(f"core_{port.name} == mutant_{port.name}")
    for side, link in links.items():
        link += [f".{name}({name})" for name in pins]
        link += [f".{port.name}({side}_{port.name})" for port in ports.outputs]
        link.append(f".{SELECTOR}({SELECTOR if side == 'mutant' else 0})")
        lines.append(f"top {side} ({', '.join(link)});")
    first = []
    for k, register in enumerate(cut.registers):
        bits = [
            f"1'b{bit}" if bit != "x" else f"q_{k}[{register.width - 1 - place}]"
            for place, bit in enumerate(register.init)
        ]
        first.append(f".core_q_{k}({{{', '.join(bits)}}})")
    lines.append(f"lemmas at_first({', '.join(first)}, .hold(first));")
    for name, stage in (("now", "q"), ("then", "core_d")):
        values = ", ".join(f".core_q_{k}({stage}_{k})" for k in range(len(cut.registers)))
        lines.append(f"lemmas {name}_(.hold({name}), {values});")
    lines.append(f"assign equal = {' && '.join(f'({term})' for term in equal)};")
    return "\n".join([f"module step({', '.join(head)}, output first, now, then, equal);", *lines, "endmodule", ""])


def proven(
    ports: Pins,
    cut: Opened,
    differ: NDArray[np.bool_],
    known: Known,
    folder: Path,
    pool: Executor,
) -> list[bool]:
    """Tell whether each mutant is proven to show what the core shows.

    Raises
    ------
    AssertionError
        If the lemmas are not proven.
    """
    (folder / "cut.il").write_text(cut.text)
    (folder / "step.v").write_text(_lemmas(cut, known) + _step(ports, cut))
    yosys(_MAKE, folder)

    def asked(part: list[tuple[str, str]], seconds: int = _SECONDS) -> list[bool]:
        """Tell whether each of some proofs succeeds."""
        own = Path(tempfile.mkdtemp(dir=folder))
        (own / "step.il").write_text((folder / "step.il").read_text())
        script = ["read_rtlil step.il", "design -save all"]
        for fixed, question in part:
            script += ["design -load all", "cd step", fixed, "opt -full", f"sat -timeout {seconds} {question}"]
        said = yosys("\n".join(script), own)
        verdicts = [found[1] is not None for found in _VERDICT.finditer(said)]
        assert len(verdicts) == len(part), said
        return verdicts

    def fixed(number: int, row: NDArray[np.bool_]) -> str:
        lines = [f"connect -set {SELECTOR} {WIDTH}'b{number:0{WIDTH}b}"]
        lines += [
            f"connect -set differs_{k} {last - first}'b{''.join(str(int(bit)) for bit in row[first:last][::-1])}"
            for k, (first, last) in enumerate(pairwise(place))
        ]
        return "\n".join(lines)

    def answered(questions: list[tuple[str, str]]) -> list[bool]:
        parts = [questions[first : first + _TOGETHER] for first in range(0, len(questions), _TOGETHER)]
        return [verdict for part in pool.map(asked, parts) for verdict in part]

    place = np.cumsum([0, *(register.width for register in cut.registers)])
    nothing = np.zeros(place[-1], dtype=bool)
    core = fixed(0, nothing)
    right = asked([(core, "-prove first 1'1"), (core, "-set now 1'1 -prove then 1'1")], _LEMMAS_SECONDS)
    assert all(right), f"lemmas: {right}"
    return answered([(fixed(number, row), _EQUAL) for number, row in enumerate(differ, 1)])
