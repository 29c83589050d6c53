"""A simulated core on its native port: the exported Verilog in Verilator, as a library that C and Python can call."""

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np

from tachometry.hdl.export import export
from tachometry.sim import build
from tachometry.sim.engines import verilator
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import TachometerSpec
from tachometry.spec.registers.map import RegisterMap

NAME = "spindle"
HEADER = """
#include <stdint.h>
void *core_open(const char *trace, const char *log);
void core_run(void *core, uint32_t clocks);
void core_capture(void *core);
uint32_t core_read(void *core, uint32_t offset);
void core_write(void *core, uint32_t offset, uint32_t value);
"""
# Clock c is what a row of tests/support/simulate is: inputs are applied, outputs read, and then there is an edge.
_SHIM = """
#include <cstdio>
#include <vector>
INCLUDES
extern "C" {
__attribute__((visibility("default"))) void *core_open(const char *trace, const char *log);
__attribute__((visibility("default"))) void core_run(void *core, uint32_t clocks);
__attribute__((visibility("default"))) void core_capture(void *core);
__attribute__((visibility("default"))) uint32_t core_read(void *core, uint32_t offset);
__attribute__((visibility("default"))) void core_write(void *core, uint32_t offset, uint32_t value);
}
struct Core {
  VerilatedContext context;
  Vcore top{&context};
  std::vector<uint32_t> rows;  // clock, levels, and so on
  size_t next = 0;
  uint32_t clock = 0;
  FILE *log;
  void settle() {
    for (; next < rows.size() && rows[next] <= clock; next += 2) { uint32_t level = rows[next + 1]; PINS }
    top.clk = 0;
    top.eval();
  }
  void edge() { top.clk = 1; top.eval(); clock++; }
  void step() { settle(); edge(); }
};
void *core_open(const char *trace, const char *log) {
  Core *core = new Core;
  core->top.rst = 1;
  for (int k = 0; k < 3; k++) { core->top.clk = 0; core->top.eval(); core->top.clk = 1; core->top.eval(); }
  core->top.rst = 0;
  FILE *file = std::fopen(trace, "rb");
  uint32_t word;
  while (std::fread(&word, sizeof word, 1, file)) core->rows.push_back(word);
  std::fclose(file);
  core->log = std::fopen(log, "w");
  return core;
}
void core_run(void *handle, uint32_t clocks) {
  for (uint32_t k = 0; k < clocks; k++) static_cast<Core *>(handle)->step();
}
static uint32_t access(Core *core, uint32_t offset, bool write, uint32_t value) {
  const uint32_t clock = core->clock;
  core->top.reg_address = offset / 4;
  core->top.reg_read = !write;
  core->top.reg_write = write;
  core->top.reg_write_data = value;
  core->step();
  core->top.reg_read = core->top.reg_write = 0;
  core->settle();
  const uint32_t answer = core->top.reg_read_data;
  std::fprintf(core->log, "%u %u %d %u %u %d\\n", clock, offset, write, value, answer, core->top.reg_error);
  std::fflush(core->log);
  core_run(core, 1 + clock % 29);  // the encoder goes on turning
  return answer;
}
void core_capture(void *handle) {
  Core *core = static_cast<Core *>(handle);
  std::fprintf(core->log, "capture %u\\n", core->clock);
  core->top.capture = 1;
  core->step();
  core->top.capture = 0;
}
uint32_t core_read(void *core, uint32_t offset) { return access(static_cast<Core *>(core), offset, false, 0); }
void core_write(void *core, uint32_t offset, uint32_t value) { access(static_cast<Core *>(core), offset, true, value); }
"""


@cache
def library(spec: TachometerSpec) -> Path:
    """Return the library of a core, whose functions `HEADER` declares."""
    text = export(spec, NAME, "native")[f"{NAME}.v"]
    pins = " ".join(f"top.{pin.name} = level >> {bit} & 1;" for bit, pin in enumerate(spec.ports.pins))
    compiler = build.compiler()
    tools = (compiler, build.version(compiler), build.flags(), version("verilator"))

    def make(folder: Path) -> Path:
        (folder / "core.v").write_text(text, encoding="utf-8")
        options = ["-Wno-fatal", "--cc", "--prefix", "Vcore", "--Mdir", "made", "--top-module", NAME]
        verilator.verilate([*options, "core.v"], folder)
        sources = ["Vcore.h", *sorted(path.name for path in (folder / "made").glob("*.cpp"))]
        shim = _SHIM.replace("INCLUDES", "\n".join(f'#include "{name}"' for name in sources)).replace("PINS", pins)
        include = verilator.home() / "include"
        return build.compile_library(
            shim,
            folder,
            *build.precompiled(include, "verilated.h", "-O0"),
            "-O0",
            f"-I{include}",
            f"-I{folder / 'made'}",
            *(verilator._runtime(source, tools) for source in verilator._RUNTIME),
        )

    return build.cached(build.digest("native shim", text, tools, _SHIM, pins), ".so", make)


def write_trace(spec: TachometerSpec, trace: PinTrace, file: Path) -> None:
    """The levels of the pins as the library reads them."""
    level = sum(np.asarray(trace.lines[pin.name], np.uint32) << bit for bit, pin in enumerate(spec.ports.pins))
    np.column_stack([trace.clock, level]).astype(np.uint32).tofile(file)


class NativeCore:
    """The core as Python calls it."""

    def __init__(self, spec: TachometerSpec, trace: PinTrace, folder: Path) -> None:
        write_trace(spec, trace, folder / "trace")
        self.log = folder / "log"
        self._library = ctypes.CDLL(str(library(spec)))
        self._library.core_open.restype = ctypes.c_void_p
        self._library.core_read.restype = ctypes.c_uint32
        self._core = ctypes.c_void_p(self._library.core_open(str(folder / "trace").encode(), str(self.log).encode()))

    def read(self, offset: int) -> int:
        return int(self._library.core_read(self._core, ctypes.c_uint32(offset)))

    def write(self, offset: int, value: int) -> None:
        self._library.core_write(self._core, ctypes.c_uint32(offset), ctypes.c_uint32(value))

    def run(self, clocks: int) -> None:
        """Let the encoder turn."""
        self._library.core_run(self._core, ctypes.c_uint32(clocks))

    def capture(self) -> None:
        """A clock with the input `capture`."""
        self._library.core_capture(self._core)


@dataclass(frozen=True)
class Logged:
    """An access that a library has logged."""

    access: Access
    answer: int
    error: bool


def logged(file: Path) -> tuple[list[Logged], list[int]]:
    """Return accesses, and clocks of captures."""
    found, captures = [], []
    for line in file.read_text().splitlines():
        if line.startswith("capture "):
            captures.append(int(line.split()[1]))
            continue
        clock, offset, write, value, answer, error = map(int, line.split())
        found.append(Logged(Access(clock, offset // 4, value if write else None), answer, bool(error)))
    return found, captures


def check_golden(registers: RegisterMap, trace: PinTrace, file: Path) -> None:
    """Check that all accesses of a log were answered as the golden bank answers them."""
    found, captures = logged(file)
    answers = GoldenBank(registers, trace).answers([one.access for one in found], captures)
    assert found
    for one, (data, error) in zip(found, answers, strict=True):
        assert (one.answer if data is not None else None, one.error) == (data, error), one


def snapshots(registers: RegisterMap, found: Sequence[Logged]) -> list[dict[str, int]]:
    """Return what the answers of all reads of captured registers say of the core's outputs, snapshot by snapshot."""
    outputs = {port.name: port for port in registers.spec.ports.outputs}
    words: list[dict[str, int]] = []
    for one in found:
        register = registers.registers[one.access.address]
        if register.captured and one.access.data is None:
            if register.captures:
                words.append({})
            words[-1][register.name] = one.answer
    shown = []
    for taken in words:
        values: dict[str, int] = {}
        for name, port in outputs.items():
            parts = [
                taken[key] for key in (name.upper(), f"{name}_low".upper(), f"{name}_high".upper()) if key in taken
            ]
            if parts:
                value = sum(part << 32 * place for place, part in enumerate(parts))
                values[name] = value - (value >> 32 * len(parts) - 1 << 32 * len(parts)) * port.signed
        for flag in registers["STATUS"].fields:
            values[flag.name] = taken["STATUS"] >> flag.low & 1
        shown.append(values)
    return shown
