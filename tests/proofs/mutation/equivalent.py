"""Which survivors cannot be told from the core at all, proven by ABC in Yosys.

The netlist is cut at its flip-flops. Core and mutant run side by side from their initial values, whatever the pins and
`rst` do, and ABC (`dprove`: correspondence of signals, then property directed reachability) proves that all outputs are
equal in every clock. A large memory that is written is cut out as well: core and mutant must write the same to it,
and what either reads is any word, but the same one if the addresses are the same.

In what ABC is asked first, a mutant has the core's flip-flops, but for those that it was seen to set differently: of
these it has its own. Proven with the outputs is then that what goes into the shared ones is equal, wherefore they may
be shared, and the lemmas of the case, which are about the core's registers. What is left is tried once more with
nothing shared, and without lemmas, if the core is small.
"""

import ctypes
import re
import shutil
import tempfile
from concurrent.futures import Executor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from proofs.mutation.cases import Case, Pins
from proofs.mutation.lemmas import lemmas
from proofs.mutation.netlist import SELECTOR, Mutant, yosys
from proofs.mutation.opened import Opened, Register, opened, written
from proofs.mutation.simulate import compiled, key

from tachometry.sim import build

_WATCH = """
struct State {{ {registers} }};
template <size_t N> static inline value<N> merged(const value<N> &old, const value<N> &mask, const value<N> &word) {{
  return old.bit_and(mask.bit_not()).bit_or(word.bit_and(mask));
}}
template <size_t N> static inline void note(const value<N> &one, const value<N> &other, uint8_t *row) {{
  for (size_t k = 0; k < N; k++) row[k] |= (one.data[k / 32] ^ other.data[k / 32]) >> (k % 32) & 1;
}}
ENTRY void mutation_watch(
  const uint64_t *levels, int64_t n_clocks, int64_t n_mutants, uint8_t *differ
) {{
  Top top;
  std::vector<State> states(1 + n_mutants);
  for (auto &state : states) {{ {init} }}
  for (int64_t clock = 0; clock < n_clocks; clock++) {{
    pins(top, levels + clock * N_WORDS);
    for (int64_t k = 0; k <= n_mutants; k++) {{
      State &state = states[k], &core = states[0];
      select(top, k);
      {set}
      settle(top);
      {read}
      {get}
      uint8_t *row = differ + (k - 1) * {width};
      if (k) {{ {compare} }}
    }}
  }}
}}
"""
# What ABC says is lost, so it writes its verdict to a file. Undefined bits are 0, as in CXXRTL.
_SOLVE = """\
design -load all
read_verilog miter_{number}.v
hierarchy -top miter
proc
flatten
setundef -zero
opt -full
techmap
opt -full
dffunmap
simplemap
opt_clean
write_rtlil left_{number}.il
abc -dff -script +strash;dprove,-j,-V,0,-T,{seconds};write_status,verdict_{number}
"""
_PROVEN = "snl_UNSAT"
_SECONDS = 20  # for a mutant
_WATCHED = 20_000  # clocks in which mutants are watched
_SHARED = 1000  # bits of registers above which nothing is proven unless they are shared
_TOGETHER = 8  # mutants for one run of Yosys


def _chunks(word: int, width: int) -> str:
    """Return a number as CXXRTL has it."""
    return f"value<{width}>{{{', '.join(f'{word >> low & 0xFFFFFFFF:#x}u' for low in range(0, width, 32))}}}"


def watched(ports: Pins, cut: Opened, n_mutants: int, pins: NDArray[np.uint64]) -> NDArray[np.bool_]:
    """Tell which bits of the registers each mutant was seen to set differently, shape (n_mutants, bits)."""
    registers, memories = list(enumerate(cut.registers)), list(enumerate(cut.memories))
    place = np.cumsum([0, *(register.width for _, register in registers)])
    more = _WATCH.format(
        registers=" ".join(
            [
                *(f"value<{register.width}> r_{k};" for k, register in registers),
                *(f"std::vector<value<{memory.width}>> m_{k};" for k, memory in memories),
            ]
        ),
        init=" ".join(
            f"state.r_{k}.data[{chunk // 32}] = {int(register.init.replace('x', '0'), 2) >> chunk & 0xFFFFFFFF}u;"
            for k, register in registers
            for chunk in range(0, register.width, 32)
        )
        + "".join(
            f"state.m_{k} = {{{', '.join(_chunks(word, memory.width) for word in memory.words)}}};"
            for k, memory in memories
        ),
        set=" ".join(f"top.p_q__{k} = state.r_{k};" for k, _ in registers),
        read=" ".join(
            f"top.p_word__{k} = state.m_{k}[now(top.p_address__{k}).template get<size_t>()]; settle(top);"
            for k, _ in memories
        ),
        get=" ".join(
            [
                *(f"state.r_{k} = now(top.p_d__{k});" for k, _ in registers),
                *(
                    f"{{ auto &word = state.m_{k}[now(top.p_place__{k}).template get<size_t>()];"
                    f" word = merged(word, now(top.p_mask__{k}), now(top.p_data__{k})); }}"
                    for k, _ in memories
                ),
            ]
        ),
        compare=" ".join(f"note(core.r_{k}, state.r_{k}, row + {place[k]});" for k, _ in registers),
        width=place[-1],
    )

    def make(folder: Path) -> Path:
        (folder / "cut.il").write_text(cut.text)
        yosys("read_rtlil cut.il\nsplitnets -driver\nopt_clean\nwrite_rtlil split.il\n", folder)
        return compiled((folder / "split.il").read_text(), ports, folder, more)

    made = build.cached(key(cut.text, more, ports), ".so", make)
    differ = np.zeros((n_mutants, place[-1]), dtype=np.uint8)
    pointer, long = ctypes.c_void_p, ctypes.c_int64
    watch = ctypes.CDLL(str(made)).mutation_watch
    watch(pointer(pins.ctypes.data), long(len(pins)), long(n_mutants), pointer(differ.ctypes.data))
    return differ.astype(bool)


def _named(texts: list[str], cut: Opened) -> list[str]:
    """Return lines of Verilog with the registers that they name, less those that name one which is not there."""

    def register(found: re.Match[str]) -> str:
        name = f".{found[2]}"
        numbers = [k for k, one in enumerate(cut.registers) if any(f".{own}".endswith(name) for own in one.names)]
        return f"{'core' if found[1] == '{' else 'mutant'}_q_{numbers[0] if len(numbers) == 1 else '?'}"

    named = [re.sub(r"([{\[])([a-z][\w.]*)[}\]]", register, text) for text in texts]
    return [text for text in named if "_q_?" not in text]


def _miter(ports: Pins, cut: Opened, number: int, differ: NDArray[np.bool_], more: list[str]) -> str:
    """Return core and mutant, with the registers that they share and those that they do not, and whether anything is
    wrong.
    """
    pins = [port.name for port in ports.inputs]
    inputs = ["input clk", *(f"input [{port.width - 1}:0] {port.name}" for port in ports.inputs)]
    lines = ["reg begun = 0;"]
    lines += ["always @(posedge clk) begun <= 1;"]
    links: dict[str, list[str]] = {"core": [], "mutant": []}
    equal = []
    place = 0

    def held(name: str, d: str, k: int, register: Register) -> None:
        """A register, which begins with any value if that is not known."""
        bits = f"[{register.width - 1}:0]"
        known = register.init.replace("x", "0")
        lines.extend([f"reg {bits} {name}_held = {register.width}'b{known};", f"wire {bits} {name};"])
        lines.append(f"always @(posedge clk) {name}_held <= {d};")
        lines.append(
            f"assign {name} = {f'begun ? {name}_held : first_{k}' if 'x' in register.init else f'{name}_held'};"
        )

    for k, register in enumerate(cut.registers):
        own = differ[place : place + register.width]
        place += register.width
        last = register.width - 1
        if "x" in register.init:
            inputs.append(f"input [{last}:0] first_{k}")
        lines += [f"wire [{last}:0] core_d_{k}, mutant_d_{k};"]
        held(f"core_q_{k}", f"core_d_{k}", k, register)
        if own.any():
            held(f"own_{k}", f"mutant_d_{k}", k, register)
        bits = ", ".join(f"{'own' if own[bit] else 'core_q'}_{k}[{bit}]" for bit in range(last, -1, -1))
        lines += [f"wire [{last}:0] mutant_q_{k} = {{{bits}}};"]
        shared = [bit for bit in range(last, -1, -1) if not own[bit]]
        if shared:
            sides = (", ".join(f"{side}_d_{k}[{bit}]" for bit in shared) for side in links)
            equal.append(" == ".join(f"{{{side}}}" for side in sides))
        for side, link in links.items():
            link += [f".q_{k}({side}_q_{k})", f".d_{k}({side}_d_{k})"]
    for port in ports.outputs:
        lines += [f"wire [{port.width - 1}:0] core_{port.name}, mutant_{port.name};"]
        equal.append(f"core_{port.name} == mutant_{port.name}")
    for k, memory in enumerate(cut.memories):
        inputs.append(f"input [{memory.width - 1}:0] any_{k}, other_{k}")
        lines += written(k, memory, links, equal)
    for (side, link), selector in zip(links.items(), (0, number), strict=True):
        link += [f".{name}({name})" for name in pins] + [f".{SELECTOR}({selector})"]
        link += [f".{port.name}({side}_{port.name})" for port in ports.outputs]
        lines += [f"top {side} ({', '.join(link)});"]
    right = " && ".join(f"({term})" for term in [*equal, *more])
    head = f"module miter({', '.join(inputs)}, output wrong);"
    return "\n".join([head, *lines, f"assign wrong = !({right});", "endmodule", ""])


def _holds(verdict: Path, left: Path) -> bool:
    """Return what ABC says, which is not asked if nothing is left of what differs."""
    if verdict.exists():
        return verdict.read_text().startswith(_PROVEN)
    return "connect \\wrong 1'0" in left.read_text()


def equivalent(
    case: Case, flat: str, group: list[Mutant], pins: NDArray[np.uint64], folder: Path, pool: Executor
) -> list[bool]:
    """Tell whether each mutant is proven to show at every output in every clock what the core shows, whatever the
    inputs.
    """
    cut = opened(flat, group, folder)
    many = bool(cut.memories) or sum(register.width for register in cut.registers) > _SHARED
    differ = watched(case.pins, cut, len(group), pins[: 10 * _WATCHED if many else _WATCHED])
    text = folder / "cut.il"
    text.write_text(cut.text)

    more = _named(lemmas(case.spec), cut)

    def solved(numbers: list[int]) -> set[int]:
        own = Path(tempfile.mkdtemp(dir=folder))
        shutil.copy(text, own)
        script = ["read_rtlil cut.il", "design -save all"]
        for number in numbers:
            (own / f"miter_{number}.v").write_text(_miter(case.pins, cut, number, differ[number - 1], more))
            script.append(_SOLVE.format(number=number, seconds=_SECONDS))
        try:
            yosys("\n".join(script), own)
        except OSError:  # the solver had not enough memory for one of them
            return set[int]().union(*(solved([number]) for number in numbers)) if len(numbers) > 1 else set()
        return {number for number in numbers if _holds(own / f"verdict_{number}", own / f"left_{number}.il")}

    alike: set[int] = set()
    for together in (_TOGETHER,) if many else (_TOGETHER, 1):
        left = [number for number in range(1, len(group) + 1) if number not in alike]
        parts = [left[first : first + together] for first in range(0, len(left), together)]
        alike = alike.union(*pool.map(solved, parts))
        # Some set a register that they share only later.
        differ[:] = True
        more.clear()
    return [number in alike for number in range(1, len(group) + 1)]
