"""Which survivors cannot be told from the core at all, proven by Yosys' SAT solver.

The netlist is cut at its flip-flops. A mutant has the core's flip-flops, but for those that it was seen to set
differently: of these it has its own. Proven by induction over k clocks, from reset values and from any state: all
outputs are equal, and so is what goes into the flip-flops that the two share, wherefore they may share them; and the
lemmas of the case hold, which are about the core's registers.
"""

import ctypes
import json
import re
import shutil
from collections import defaultdict
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mutation.cases import Case
from mutation.lemmas import lemmas
from mutation.netlist import SELECTOR, Mutant, selected, yosys
from mutation.simulate import compiled, key
from numpy.typing import NDArray

from tachometry.sim import build
from tachometry.spec import TachometerSpec

_MAP = """\
read_rtlil flat.il
{mutants}
memory -nomap
memory_map
dffunmap
opt_clean
write_rtlil mapped.il
write_json mapped.json
"""
_WATCH = """
struct State {{ {registers} }};
template <size_t N> static inline void note(const value<N> &one, const value<N> &other, uint8_t *row) {{
  for (size_t k = 0; k < N; k++) row[k] |= (one.data[k / 32] ^ other.data[k / 32]) >> (k % 32) & 1;
}}
ENTRY void mutation_watch(
  const uint8_t *levels, int64_t n_clocks, int64_t n_mutants, uint8_t *differ
) {{
  Top top;
  std::vector<State> states(1 + n_mutants);
  for (auto &state : states) {{ {init} }}
  for (int64_t clock = 0; clock < n_clocks; clock++) {{
    pins(top, levels[clock]);
    for (int64_t k = 0; k <= n_mutants; k++) {{
      State &state = states[k], &core = states[0];
      select(top, k);
      {set}
      settle(top);
      {get}
      uint8_t *row = differ + (k - 1) * {width};
      if (k) {{ {compare} }}
    }}
  }}
}}
"""
_SOLVE = """\
log mutant {number}
design -load all
read_verilog -formal miter_{number}.v
hierarchy -top miter
proc
flatten
opt
chformal -lower
opt
sat -tempinduct -prove-asserts -set-assumes -maxsteps {steps} -timeout {seconds} miter
"""
_STEPS = 20  # clocks of the induction
_SECONDS = 10  # for each of its steps
_WATCHED = 20_000  # clocks in which mutants are watched
_TOGETHER = 8  # mutants for one run of Yosys


@dataclass(frozen=True)
class Register:
    """A flip-flop; `init` has a character for each bit, the highest first, x where it is not known."""

    width: int
    init: str
    names: frozenset[str]


@dataclass(frozen=True)
class Opened:
    """A netlist in RTLIL, cut at its flip-flops: register k comes in as `q_k` and goes out as `d_k`."""

    text: str
    registers: list[Register]


def _known(mapped: dict[str, Any]) -> dict[str, tuple[str, frozenset[str]]]:
    """Initial value and names of each register, by its cell."""
    (module,) = mapped["modules"].values()
    bits: dict[Any, str] = {}
    names: dict[tuple[Any, ...], set[str]] = defaultdict(set)
    for name, net in module["netnames"].items():
        names[tuple(net["bits"])].add(re.sub(r"\$\d+", "", name))
        if "init" in net["attributes"]:
            bits.update(zip(net["bits"], reversed(net["attributes"]["init"]), strict=True))
    known = {}
    for name, cell in module["cells"].items():
        if cell["type"] == "$dff":
            q = cell["connections"]["Q"]
            known[name] = "".join(bits.get(bit, "x") for bit in reversed(q)), frozenset(names[tuple(q)])
    return known


def opened(flat: str, group: list[Mutant], folder: Path) -> Opened:
    """The netlist of a group of mutants without its flip-flops, memories taken apart."""
    (folder / "flat.il").write_text(flat)
    # What drives a register's net instead of it has lost the initial value.
    yosys(_MAP.format(mutants=""), folder)
    known = _known(json.loads((folder / "mapped.json").read_text()))
    yosys(_MAP.format(mutants="\n".join([*selected(group), "setattr -unset init w:*"])), folder)
    text = (folder / "mapped.il").read_text()
    registers, wires, connections = [], [], []

    def cut(cell: re.Match[str]) -> str:
        d, q, width = (re.search(pattern, cell[2])[1] for pattern in (r"\\D (.*)", r"\\Q (.*)", r"\\WIDTH (\d+)"))
        k = len(registers)
        registers.append(Register(int(width), *known.get(cell[1].removeprefix("\\"), ("x" * int(width), frozenset()))))
        wires.append(
            f"  wire width {width} input {1000 + 2 * k} \\q_{k}\n  wire width {width} output {1001 + 2 * k} \\d_{k}\n"
        )
        connections.append(f"  connect {q} \\q_{k}\n  connect \\d_{k} {d}\n")
        return ""

    text = re.sub(r"^  cell \$dff (\S+)\n(.*?)^  end\n", cut, text, flags=re.DOTALL | re.MULTILINE)
    head, body = re.split(r"(?<=^module \\top\n)", text, maxsplit=1, flags=re.MULTILINE)
    body, tail = body.rsplit("end\n", 1)
    return Opened(head + "".join(wires) + body + "".join(connections) + "end\n" + tail, registers)


def watched(spec: TachometerSpec, cut: Opened, n_mutants: int, pins: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Which bits of the registers each mutant was seen to set differently, shape (n_mutants, bits)."""
    registers = list(enumerate(cut.registers))
    place = np.cumsum([0, *(register.width for _, register in registers)])
    more = _WATCH.format(
        registers=" ".join(f"value<{register.width}> r_{k};" for k, register in registers),
        init=" ".join(
            f"state.r_{k}.data[{chunk // 32}] = {int(register.init.replace('x', '0'), 2) >> chunk & 0xFFFFFFFF}u;"
            for k, register in registers
            for chunk in range(0, register.width, 32)
        ),
        set=" ".join(f"top.p_q__{k} = state.r_{k};" for k, _ in registers),
        get=" ".join(f"state.r_{k} = now(top.p_d__{k});" for k, _ in registers),
        compare=" ".join(f"note(core.r_{k}, state.r_{k}, row + {place[k]});" for k, _ in registers),
        width=place[-1],
    )

    def make(folder: Path) -> Path:
        (folder / "cut.il").write_text(cut.text)
        yosys("read_rtlil cut.il\nsplitnets -driver\nopt_clean\nwrite_rtlil split.il\n", folder)
        return compiled((folder / "split.il").read_text(), spec, folder, more)

    made = build.cached(key(cut.text, more, spec.ports), ".so", make)
    differ = np.zeros((n_mutants, place[-1]), dtype=np.uint8)
    pointer, long = ctypes.c_void_p, ctypes.c_int64
    watch = ctypes.CDLL(str(made)).mutation_watch
    watch(pointer(pins.ctypes.data), long(len(pins)), long(n_mutants), pointer(differ.ctypes.data))
    return differ.astype(bool)


def _lemmas(case: Case, cut: Opened) -> list[str]:
    """The lemmas of the case with the registers that they name, less those of a register that is not there."""

    def register(found: re.Match[str]) -> str:
        name = f".{found[2]}"
        numbers = [k for k, one in enumerate(cut.registers) if any(f".{own}".endswith(name) for own in one.names)]
        return f"{'core' if found[1] == '{' else 'mutant'}_q_{numbers[0] if len(numbers) == 1 else '?'}"

    named = [re.sub(r"([{\[])([a-z][\w.]*)[}\]]", register, lemma) for lemma in lemmas(case.spec)]
    return [lemma for lemma in named if "_q_?" not in lemma]


def _miter(case: Case, cut: Opened, number: int, differ: NDArray[np.bool_]) -> str:
    """Core and mutant, with the registers that they share and those that they do not."""
    inputs = [port.name for port in case.spec.ports if port.direction == "input" and port.name != "clk"]
    outputs = [port for port in case.spec.ports if port.direction == "output"]
    lines = [f"module miter(input clk, {', '.join(f'input {name}' for name in inputs)});", "reg begun = 0;"]
    lines += ["always @(posedge clk) begun <= 1;"]
    links: dict[str, list[str]] = {"core": [], "mutant": []}
    equal, assumed = [], []
    place = 0
    for k, register in enumerate(cut.registers):
        own = differ[place : place + register.width]
        place += register.width
        last = register.width - 1
        known = f" = {register.width}'b{register.init}" if "x" not in register.init else ""
        lines += [f"wire [{last}:0] core_d_{k}, mutant_d_{k};", f"reg [{last}:0] core_q_{k}{known};"]
        lines += [f"always @(posedge clk) core_q_{k} <= core_d_{k};"]
        if own.any():
            lines += [f"reg [{last}:0] own_{k}{known};", f"always @(posedge clk) own_{k} <= mutant_d_{k};"]
            if not known:
                assumed.append(f"own_{k} == core_q_{k}")
        bits = ", ".join(f"{'own' if own[bit] else 'core_q'}_{k}[{bit}]" for bit in range(last, -1, -1))
        lines += [f"wire [{last}:0] mutant_q_{k} = {{{bits}}};"]
        shared = [bit for bit in range(last, -1, -1) if not own[bit]]
        if shared:
            sides = (", ".join(f"{side}_d_{k}[{bit}]" for bit in shared) for side in links)
            equal.append(" == ".join(f"{{{side}}}" for side in sides))
        for side, link in links.items():
            link += [f".q_{k}({side}_q_{k})", f".d_{k}({side}_d_{k})"]
    for port in outputs:
        lines += [f"wire [{port.width - 1}:0] core_{port.name}, mutant_{port.name};"]
        equal.append(f"core_{port.name} == mutant_{port.name}")
    for (side, link), selector in zip(links.items(), (0, number), strict=True):
        link += [f".{name}({name})" for name in inputs if name != "rst"] + [".rst(rst)", f".{SELECTOR}({selector})"]
        link += [f".{port.name}({side}_{port.name})" for port in outputs]
        lines += [f"top {side} ({', '.join(link)});"]
    equal += _lemmas(case, cut)
    lines += ["always @* begin", *(f"  if (!begun) assume({term});" for term in assumed)]
    return "\n".join([*lines, *(f"  assert({term});" for term in equal), "end", "endmodule", ""])


def equivalent(
    case: Case, flat: str, group: list[Mutant], pins: NDArray[np.uint8], folder: Path, pool: Executor
) -> list[bool]:
    """Whether each mutant is proven to show at every output in every clock what the core shows, whatever the inputs."""
    cut = opened(flat, group, folder)
    differ = watched(case.spec, cut, len(group), pins[:_WATCHED])
    text = folder / "cut.il"
    text.write_text(cut.text)

    def proven(first: int) -> list[bool]:
        own = folder / f"from_{first}"
        own.mkdir()
        shutil.copy(text, own)
        script = ["read_rtlil cut.il", "design -save all"]
        for number in range(first, min(first + _TOGETHER, len(group) + 1)):
            (own / f"miter_{number}.v").write_text(_miter(case, cut, number, differ[number - 1]))
            script.append(_SOLVE.format(number=number, steps=_STEPS, seconds=_SECONDS))
        said = yosys("\n".join(script), own)
        parts = re.split(r"^mutant \d+$", said, flags=re.MULTILINE)[1:]
        return ["Induction step proven: SUCCESS!" in part for part in parts]

    return [verdict for part in pool.map(proven, range(1, len(group) + 1, _TOGETHER)) for verdict in part]
