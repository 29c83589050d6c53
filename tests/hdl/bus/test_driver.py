"""The driver in C, compiled as strict C99, on the simulated core: what it says is what the golden bank says."""

import math
import re
import subprocess
from functools import cache
from pathlib import Path

import pytest
from support import docs
from support.lockstep import random_case
from support.native import HEADER, NAME, check_golden, library, logged, snapshots, write_trace
from support.script import load

from tachometry.boards.host.client import Client
from tachometry.hdl.export.registers.files import register_files, tables
from tachometry.sim import build, golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.registers.manifest import manifest
from tachometry.spec.registers.map import RegisterMap

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
    ("compare_next", 7),
]


def test_what_is_written_in_c_is_what_the_client_in_python_writes(tmp_path: Path) -> None:
    texts = {"ppr": "500", "preset": "5", "position-width": "40", "index": "yes", "index-once": "yes", "probe": "2"}
    spec = of_texts("s", texts | {"position-modulo": "rev", "health": "yes", "compare": "list:3:2clk"})
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


def test_drivers_of_all_methods_are_strict_c(tmp_path: Path) -> None:
    """All in one program: no name of one meets that of another."""
    lines = []
    specs = {f"{m}_{seed}": random_case(seed, m)[0] for m in ("s", "m", "t", "mt", "rairan") for seed in range(3)}
    specs |= {
        f"list_{n}": of_texts("s", {"ppr": "9", "position-width": str(n), "compare": "list:4:1us"}) for n in (32, 33)
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
        "COUNTS_PER_REV": spec.encoder.counts_per_rev,
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
