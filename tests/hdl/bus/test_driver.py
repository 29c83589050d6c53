"""The driver in C, compiled as strict C99, on the simulated core: what it says is what the golden bank says."""

import math
import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from support import docs
from support.random_case import random_case
from support.script import load

from tachometry.boards.host.client import Client
from tachometry.hdl.export import export
from tachometry.hdl.export.registers.files import register_files, tables
from tachometry.sim import build, golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines import verilator
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.registers.manifest import manifest
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


STRICT = ("-x", "c", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion")
STEPS = 6
_PROGRAM = """
#include <inttypes.h>
#include <stdio.h>
#include "spindle_driver.h"
#include "other_driver.h"
#include "core.h"
static void show(const struct spindle_bus *bus) {
  struct spindle_snapshot now;
  struct spindle_counters counters;
  spindle_read(bus, &now);
SHOWN
  printf("rad_per_s %.17g\\n", spindle_rad_per_s(now.velocity));
  printf("in_unit %.17g\\n", spindle_in_unit(now.velocity));
  printf("rad %.17g\\n", spindle_rad(now.position));
  spindle_read_counters(bus, &counters);
COUNTED
  printf("end 0\\n");
}
static uint32_t nothing(void *context, uint32_t offset) {
  (void)context;
  return offset;
}
int main(int count, char **words) {
  struct spindle_bus bus = {core_read, core_write, 0};
  struct other_bus other = {core_read, core_write, 0};
  const struct spindle_bus none = {nothing, core_write, 0};
  void *core = core_open(words[1], words[count - 1]);
  bus.context = core;
  other.context = core;
  printf("none %d\\n", spindle_init(&none) == SPINDLE_NOT_A_TACHOMETER);
  printf("other %d\\n", other_init(&other) == OTHER_OTHER_CONFIGURATION);
  printf("ok %d\\n", spindle_init(&bus) == SPINDLE_OK);
  for (int step = 0; step < STEPS; step++) {
    core_run(core, 600);
    show(&bus);
    spindle_hold(&bus, true);
    core_run(core, 150);
    if (step % 2) core_capture(core);
    core_run(core, 40);
    show(&bus);
    if (step == 2) {
      spindle_clear(&bus);
      show(&bus);
    }
    spindle_hold(&bus, false);
  }
  return 0;
}
"""


@cache
def case() -> tuple[TachometerSpec, PinTrace]:
    """Return a core with every option that adds a register, on a shaft that turns either way, with noise."""
    spec, _, trace = random_case(16, "m")
    assert spec.index
    assert spec.bounds
    assert spec.age
    assert spec.filter_clocks
    assert spec.position_width > 32
    return spec, trace


def program(spec: TachometerSpec) -> str:
    registers = RegisterMap(spec)
    names = [port.name for port in spec.ports.outputs if not port.is_strobe] + [*registers.events]
    shown = [f'  printf("{name} %" PRId64 "\\n", (int64_t)now.{name});' for name in names]
    counted = [f'  printf("{name} %d\\n", counters.{name});' for name in registers.counted]
    return (
        _PROGRAM.replace("SHOWN", "\n".join(shown))
        .replace("COUNTED", "\n".join(counted))
        .replace("STEPS", str(STEPS))
        .replace("spindle", NAME)
    )


def run(folder: Path) -> list[tuple[str, float]]:
    """Return what the program prints."""
    spec, trace = case()
    other = RegisterMap(random_case(0, "s")[0])
    files = {**register_files(RegisterMap(spec), NAME), **register_files(other, "other"), "core.h": HEADER}
    files["main.c"] = program(spec)
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")
    write_trace(spec, trace, folder / "trace")
    made = library(spec)
    command: list[str | Path] = [
        *build.compiler(),
        *STRICT,
        "main.c",
        "-x",
        "none",
        made,
        f"-Wl,-rpath,{made.parent}",
        "-o",
        "main",
    ]
    build.run(command, "compiler", folder)
    done = subprocess.run([folder / "main", "trace", "log"], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [(name, float(value)) for name, value in (line.split() for line in done.stdout.splitlines())]


def check(folder: Path) -> list[dict[str, float]]:
    """Hold what the program prints against the answers, and the answers against the golden bank."""
    spec, trace = case()
    registers = RegisterMap(spec)
    printed = run(folder)
    assert printed[:3] == [("none", 1), ("other", 1), ("ok", 1)]
    check_golden(registers, trace, folder / "log")
    found, captures = logged(folder / "log")
    shown: list[dict[str, float]] = [{}]
    for name, value in printed[3:]:
        if name == "end":
            shown.append({})
        else:
            shown[-1][name] = value
    shown.pop()
    counted = [one.answer for one in found if registers.registers[one.access.address].name == "COUNTERS"]
    expected = snapshots(registers, found)
    assert len(shown) == len(expected) == len(counted) == 2 * STEPS + 1
    for one, values, word in zip(shown, expected, counted, strict=True):
        velocity, position = values["velocity"], values["position"]
        counters = {field.name: word >> field.low & 0xFF for field in registers["COUNTERS"].fields}
        quantities = {
            "rad_per_s": velocity * spec.velocity.rad_per_s_per_lsb,
            "in_unit": velocity * 2.0**-spec.velocity.frac_bits,
            "rad": pytest.approx(position * 2 * math.pi / spec.encoder.counts_per_rev, rel=1e-14),
        }
        assert one == {**values, **counters, **quantities}
    held = [one["position"] for one in shown]
    # While it is held, only the input captures; clear leaves it held.
    assert held[0] == held[1]
    assert held[2] != held[3]
    assert held[4] == held[5] == held[6] != held[7]
    assert shown[6]["lost_updates"] < shown[5]["lost_updates"]
    assert len(captures) == STEPS // 2
    return shown


def test_what_the_driver_says_is_what_the_golden_bank_says(tmp_path: Path) -> None:
    shown = check(tmp_path)
    assert min(one["velocity"] for one in shown) < 0 < max(one["velocity"] for one in shown)
    assert min(one["position"] for one in shown) < 0
    for name in ("interval", "age", "velocity_lower", "velocity_upper", "updated"):
        assert any(one[name] for one in shown), name


_WRITES = """
#include <inttypes.h>
#include <stdio.h>
#include "spindle_driver.h"
static uint32_t reads(void *context, uint32_t offset) {
  (void)context;
  (void)offset;
  return SPINDLE_CONTROL_HOLD_MASK;
}
static void writes(void *context, uint32_t offset, uint32_t value) {
  (void)context;
  printf("%" PRIu32 " %" PRIu32 "\\n", offset, value);
}
int main(void) {
  const struct spindle_bus bus = {reads, writes, 0};
CALLS
  return 0;
}
"""
WRITTEN = [
    ("preset", -5 - (1 << 33)),
    ("modulo_offset", 1999),
    ("probe_arm", 2),
    ("probe_edges", 9),
    ("position_compare_next", 7),
]


def test_what_is_written_in_c_is_what_the_client_in_python_writes(tmp_path: Path) -> None:
    texts = {"ppr": "500", "preset": "5", "position-width": "40", "index": "yes", "index-once": "yes", "probe": "2"}
    spec = of_texts("s", texts | {"position-modulo": "rev", "health": "yes", "position-compare": "list:3:2clk"})
    registers = RegisterMap(spec)
    places = {one.name: one.offset for one in registers}
    calls = [f"  spindle_write_{name}(&bus, {value});" for name, value in WRITTEN]
    calls += [f"  spindle_{name}(&bus);" for name in ("preset", "home", "clear")]
    files = {**register_files(registers, NAME), "main.c": _WRITES.replace("CALLS", "\n".join(calls))}
    for file, text in files.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    build.run([*build.compiler(), *STRICT, "main.c", "-o", "main"], "compiler", tmp_path)
    lines = build.run([tmp_path / "main"], "main").splitlines()
    words = {places["IDENTIFICATION"]: registers["IDENTIFICATION"].reset, places["CONTROL"]: 2}
    words |= {places["CONFIGURATION"]: registers.configuration}
    done: list[tuple[int, int]] = []
    described = manifest(spec, "spindle") | {"registers": registers.described()}
    client = Client(words.__getitem__, lambda offset, value: done.append((offset, value)), described)
    for name, value in WRITTEN:
        client.write(name.upper(), value)
    for name in ("preset", "home"):
        client.control(name)
    client.clear()
    assert [tuple(map(int, line.split())) for line in lines] == done
    assert done[:3] == [
        (places["PRESET_LOW"], 0xFFFFFFFB),
        (places["PRESET_HIGH"], 0xFFFFFFFD),
        (places["MODULO_OFFSET"], 1999),
    ]
    assert done[-3:] == [(places["CONTROL"], bit | 2) for bit in (4, 8, 1)]
    most = (1 << 39) - 1
    for name, value, error in (
        ("PRESET", most + 1, f"PRESET must be from {-most - 1} to {most}, not {most + 1}"),
        ("MODULO_OFFSET", 2000, "MODULO_OFFSET must be from 0 to 1999, not 2000"),
        ("PROBE_EDGES", 16, "PROBE_EDGES must be from 0 to 15, not 16"),
        ("VELOCITY", 0, "there is no register 'VELOCITY' that is written"),
    ):
        with pytest.raises((ValueError, KeyError), match=re.escape(error)):
            client.write(name, value)


@pytest.mark.parametrize(("form", "entries", "bits"), [("edges", 100, 8), ("sectors:100", 36, 16)])
def test_a_map_of_the_disc_is_written_and_read_back(form: str, entries: int, bits: int, tmp_path: Path) -> None:
    """The table is in memory here; one entry is read back wrong."""
    texts = {"ppr": "25", "clock": "1MHz", "tick": "20clk", "max-time": "60clk", "index": "yes", "disc-table": form}
    registers = RegisterMap(of_texts("mt", texts))
    table = [((7 * edge) % 41 - 20) * (bits // 8) ** 8 for edge in range(entries)]
    places = {one.name: one.offset for one in registers}
    (first,) = (one.offset for one in registers if one.captures)
    address, data, shown = (places[f"DISC_{name}"] for name in ("ADDRESS", "DATA", "ENTRY"))
    main = f"""
#include <stdio.h>
#include "spindle_driver.h"
static uint32_t edge, taken;
static uint{bits}_t table[{entries}];
static uint32_t reads(void *wrong, uint32_t offset) {{
  if (offset == {first}) taken = (uint32_t)(int{bits}_t)(table[edge] ^ (wrong && edge == 13));
  return offset == {shown} ? taken : 0;
}}
static void writes(void *wrong, uint32_t offset, uint32_t value) {{
  (void)wrong;
  if (offset == {address}) edge = value;
  if (offset == {data} && value >> {bits} == 1) table[edge] = (uint{bits}_t)value;
}}
int main(void) {{
  static const int{bits}_t entries[] = {{{", ".join(map(str, table))}}};
  const struct spindle_bus right = {{reads, writes, 0}}, wrong = {{reads, writes, &edge}};
  printf("%d %d\\n", spindle_write_disc(&right, entries), spindle_write_disc(&wrong, entries));
  return 0;
}}
"""
    for file, text in {**register_files(registers, NAME), "main.c": main}.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    build.run([*build.compiler(), *STRICT, "main.c", "-o", "main"], "compiler", tmp_path)
    assert build.run([tmp_path / "main"], "main") == "1 0\n"


# A word of a driver's unit in rad/s, from school.
UNITS = {"rad/s": 1.0, "rev/s": 2 * math.pi, "rpm": 2 * math.pi / 60, "count/tick": 2 * math.pi / 2000 / 100e-6}
_CONVERSIONS = """
static uint32_t words_UNIT[] = {WORDS};
static void show_UNIT(void) {
  const struct UNIT_bus bus = {of_words, 0, words_UNIT};
  struct UNIT_snapshot now;
  UNIT_read(&bus, &now);
  printf("%.17g %.17g ", UNIT_rad_per_s(now.velocity), UNIT_in_unit(now.velocity));
  printf("%.17g %.17g ", UNIT_rad_per_s2(now.acceleration), (double)now.acceleration * UNIT_ACCELERATION_PER_LSB);
  printf("%.17g %.17g\\n", UNIT_rad(now.position), UNIT_fine_rad(now.position_fine));
}
"""


def test_the_driver_converts_to_what_the_shaft_did(tmp_path: Path) -> None:
    """Speed, acceleration and angle of a braking shaft, from registers of golden models, in every unit of the speed."""
    motion = parse_motion("ramp:-100rad/s:-20rad/s:100ms")
    recording = VirtualEncoder(500, seed=1).record(motion).recording
    parts, calls = [], []
    for number, unit in enumerate(UNITS):
        spec = of_texts("track", {"ppr": "500", "clock": "20MHz", "tick": "100us", "unit": unit})
        registers = RegisterMap(spec)
        run = golden.run(spec, recording.place(spec.timing.clock_hz))
        shown = {port: int(run.updates.get(port)[-1]) for port in ("velocity", "acceleration", "position_fine")}
        shown["position"] = int(run.ticks.position[-1])
        words = [
            sum(shown.get(field.port, 0) >> field.shift << field.low & field.mask for field in register.fields)
            for register in registers
        ]
        name = f"core{number}"
        for file, text in register_files(registers, name).items():
            (tmp_path / file).write_text(text, encoding="utf-8")
        parts.append(_CONVERSIONS.replace("WORDS", ", ".join(f"UINT32_C({word})" for word in words)))
        parts[-1] = parts[-1].replace("UNIT_ACC", f"{name.upper()}_ACC").replace("UNIT", name)
        calls.append(f"  show_{name}();\n")
    lines = ["#include <stdio.h>", *(f'#include "core{number}_driver.h"' for number in range(len(UNITS)))]
    lines.append("static uint32_t of_words(void *words, uint32_t offset) { return ((uint32_t *)words)[offset / 4]; }")
    program = "\n".join([*lines, *parts, f"int main(void) {{\n{''.join(calls)}  return 0;\n}}\n"])
    (tmp_path / "main.c").write_text(program)
    build.run([*build.compiler(), *STRICT, "main.c", "-o", "main"], "compiler", tmp_path)
    said = [[float(word) for word in line.split()] for line in build.run([tmp_path / "main"], "main").splitlines()]
    speed, acceleration, angle = float(motion.speed(0.1)), float(motion.acceleration(0.05)), float(motion.angle(0.1))
    assert (speed, acceleration, angle) == pytest.approx((-20, 800, -6))
    for (unit, rad_per_s), found in zip(UNITS.items(), said, strict=True):
        per_time = 100e-6 if unit == "count/tick" else 1.0  # count/tick², or the unit per second
        expected = (speed, speed / rad_per_s, acceleration, acceleration / rad_per_s * per_time, angle, angle)
        assert found == pytest.approx(expected, rel=0.02), unit


def test_the_driver_has_electrical_degrees(tmp_path: Path) -> None:
    spec = of_texts("track", {"ppr": "500", "clock": "20MHz", "tick": "100us", "electrical": "7"})
    for file, text in register_files(RegisterMap(spec), "core").items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    calls = "core_degrees(0x4000), core_angle_of(-90), core_angle_of(359.999), 1u * CORE_ANGLE_SET_SET_MASK"
    shown = 'printf("%g %u %u %u", CALLS)'.replace("CALLS", calls)
    main = f'#include <stdio.h>\n#include "core_driver.h"\nint main(void) {{\n  {shown};\n  return 0;\n}}\n'
    (tmp_path / "main.c").write_text(main)
    build.run([*build.compiler(), *STRICT, "main.c", "-o", "main"], "compiler", tmp_path)
    assert build.run([tmp_path / "main"], "main") == f"90 {0xC000} 0 {1 << 16}"


def test_drivers_of_all_methods_are_strict_c(tmp_path: Path) -> None:
    """All in one program: no name of one meets that of another."""
    lines = []
    specs = {f"{m}_{seed}": random_case(seed, m)[0] for m in ("s", "m", "t", "mt", "rairan") for seed in range(3)}
    specs |= {
        f"list_{n}": of_texts("s", {"ppr": "9", "position-width": str(n), "position-compare": "list:4:1us"})
        for n in (32, 33)
    }
    for name, spec in specs.items():
        for file, text in register_files(RegisterMap(spec), name).items():
            (tmp_path / file).write_text(text, encoding="utf-8")
        lines.append(f'#include "{name}_driver.h"')
    (tmp_path / "main.c").write_text("\n".join([*lines, "int main(void) { return 0; }\n"]))
    build.run([*build.compiler(), *STRICT, "-c", "main.c", "-o", "main.o"], "compiler", tmp_path)
    plus = [*build.compiler(), "-x", "c++", "-std=c++11", *STRICT[3:]]
    build.run([*plus, "-c", "main.c", "-o", "main.o"], "compiler", tmp_path)


def test_the_example_of_the_page_is_strict_c(tmp_path: Path) -> None:
    """Compiled for the core of the page, whose registers the page shows."""
    page = docs.page("reference/registers.md")
    (example,) = re.findall(r"```c\n(.*?)```", page, re.DOTALL)
    files = register_files(RegisterMap(of_texts("s", load("reference_pages").SPEED)), "speed")
    for file, text in {**files, "main.c": example}.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    build.run([*build.compiler(), *STRICT, "-c", "main.c", "-o", "main.o"], "compiler", tmp_path)
    assert tables(RegisterMap(of_texts("s", load("reference_pages").SPEED))).replace("## ", "### ") in page


def test_the_compiler_reads_the_numbers_of_the_map(tmp_path: Path) -> None:
    """Every macro of the header, as C takes it."""
    spec, _ = case()
    registers = RegisterMap(spec)
    expected: dict[str, float] = {
        "REGISTERS": len(registers.registers),
        "CLOCK_HZ": spec.timing.clock_hz,
        "TICK_CYCLES": spec.timing.tick_cycles,
        "MAX_TICKS": spec.timing.max_ticks,
        "COUNTS_PER_REV": spec.encoder.encoder_counts,
        "INTERVAL_UNIT_CYCLES": spec.times.interval_unit,
        "UNIT_PER_LSB": 2.0**-spec.velocity.frac_bits,
        "RAD_PER_S_PER_LSB": spec.velocity.rad_per_s_per_lsb,
        "RAD_PER_COUNT": 2 * math.pi / spec.encoder.counts_per_rev,
    }
    for one in registers:
        expected |= {f"{one.name}_OFFSET": one.offset, f"{one.name}_RESET": one.reset}
        for field in one.fields:
            numbers = {"MASK": field.mask, "SHIFT": field.low, "RESET": field.reset}
            expected |= {f"{one.name}_{field.name.upper()}_{kind}": value for kind, value in numbers.items()}
    header = register_files(registers, NAME)[f"{NAME}_regs.h"]
    names = re.findall(rf"^#define {NAME.upper()}_(\w+) ", header, re.MULTILINE)
    shown = "\n".join(
        f'  printf("{name} %.17g\\n", (double){NAME.upper()}_{name});' for name in names if name != "UNIT"
    )
    (tmp_path / f"{NAME}_regs.h").write_text(header, encoding="utf-8")
    (tmp_path / "main.c").write_text(
        f'#include <stdio.h>\n#include "{NAME}_regs.h"\nint main(void) {{\n{shown}\n'
        f'  printf("UNIT_LENGTH %d\\n", (int)sizeof {NAME.upper()}_UNIT - 1);\n  return 0;\n}}\n'
    )
    build.run([*build.compiler(), *STRICT, "main.c", "-o", "main"], "compiler", tmp_path)
    said = [line.split() for line in build.run([tmp_path / "main"], "program").splitlines()]
    assert {name: float(value) for name, value in said} == expected | {"UNIT_LENGTH": len(spec.unit)}
