"""Every register and every field of every configuration is in each of the texts, as the map and the ports say."""

import math
import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import pytest
from support.options import had_by
from support.random_case import random_case
from support.rdl import read_rdl

from tachometry.boards.host.client import Client
from tachometry.hdl.export import export
from tachometry.hdl.export.registers.files import REGISTER_FILES, register_files
from tachometry.hdl.export.registers.rdl import described
from tachometry.spec import METHODS, TachometerSpec, of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.registers.loop import registers_of
from tachometry.spec.registers.manifest import manifest
from tachometry.spec.registers.map import RegisterMap

SEEDS = range(8)
BASE = {"ppr": "8", "clock": "1MHz", "tick": "80us", "max-time": "800us"}
WIDE = {"velocity-width": "64", "position-width": "48", "bounds": "yes", "electrical": "3", "lead": "0"}


@cache
def maps(method: str) -> list[RegisterMap]:
    specs = [random_case(seed, method)[0] for seed in SEEDS]
    return [RegisterMap(spec) for spec in (*specs, of_texts(method, had_by(method, BASE | WIDE)))]


def check_rdl(registers: RegisterMap, text: str, folder: Path) -> None:
    top = read_rdl(text, folder)
    assert (top.inst_name, top.total_size) == ("spindle", len(registers.registers) * 4)
    found = [
        (
            one.inst_name,
            one.absolute_address,
            one.size * 8,
            one.get_property("accesswidth"),
            [
                (
                    field.inst_name,
                    field.low,
                    field.width,
                    field.get_property("reset"),
                    field.is_sw_readable,
                    field.is_sw_writable,
                    bool(field.get_property("singlepulse")),
                    field.is_hw_writable,
                )
                for field in one.fields()
            ],
        )
        for one in top.registers()
    ]
    assert found == [
        (
            one.name,
            one.offset,
            32,
            32,
            [
                (
                    field.name,
                    field.low,
                    field.width,
                    field.reset,
                    field.access != "wo",
                    field.access != "ro",
                    field.single,
                    field.access == "ro" and not one.constant,
                )
                for field in one.fields
            ],
        )
        for one in registers
    ]
    for one, register in zip(top.registers(), registers, strict=True):
        told = " ".join((one.get_property("desc") or "").split())
        assert register.help in told
        for field, meant in zip(one.fields(), register.fields, strict=True):
            text = f"{told} {' '.join((field.get_property('desc') or '').split())}"
            assert meant.help in text
            assert meant.unit in text


def check_header(registers: RegisterMap, text: str, folder: Path) -> None:
    defined = re.findall(r"^#define SPINDLE_(\w+) (.+)$", text, re.MULTILINE)
    macros = dict(defined)
    assert len(defined) == len(macros)

    def number(name: str) -> int:
        assert name in macros
        return int(macros.pop(name).removeprefix("UINT32_C(").rstrip(")"), 0)

    for register in registers:
        assert (number(f"{register.name}_OFFSET"), number(f"{register.name}_RESET")) == (
            register.offset,
            register.reset,
        )
        for field in register.fields:
            prefix = f"{register.name}_{field.name.upper()}"
            found = [number(f"{prefix}_{kind}") for kind in ("MASK", "SHIFT", "RESET")]
            assert found == [field.mask, field.low, field.reset]
            assert len(register.fields) == 1 or field.help in " ".join(text.replace("//", " ").split())
    assert not {name for name in macros if name.endswith(("_OFFSET", "_MASK", "_SHIFT", "_RESET"))}
    described = manifest(registers.spec)
    assert int(macros["CLOCK_HZ"].removeprefix("UINT64_C(").rstrip(")")) == described["clock_hz"]
    assert macros["UNIT"] == f'"{described["velocity"]["unit"]}"'
    assert float(macros["RAD_PER_S_PER_LSB"]) == described["velocity"]["rad_per_s_per_lsb"]
    assert float(macros["RAD_PER_COUNT"]) == pytest.approx(2 * math.pi / described["counts_per_rev"], rel=1e-15)
    assert float(macros["UNIT_PER_LSB"]) == 0.5 ** described["velocity"]["frac_bits"]
    for name in ("TICK_CYCLES", "MAX_TICKS", "COUNTS_PER_REV", "INTERVAL_UNIT_CYCLES"):
        assert macros[name] == f"UINT32_C({described[name.lower()]})"
    for port in ("acceleration", "position_fine"):
        assert (f"{port.upper()}_PER_LSB" in macros) == (port in described)
        if port in described:
            assert float(macros[f"{port.upper()}_PER_LSB"]) == 0.5 ** described[port]["frac_bits"]
    if "acceleration" in described:
        assert float(macros["RAD_PER_S2_PER_LSB"]) == described["acceleration"]["rad_per_s2_per_lsb"]


def check_page(registers: RegisterMap, text: str, folder: Path) -> None:
    rows = [re.split(r" \| ", line[2:-2]) for line in text.splitlines() if line.startswith("| `")]
    found = {
        row[1].strip("`"): (int(row[0].strip("`"), 16), int(row[3].strip("`"), 16)) for row in rows if len(row) == 5
    }
    assert found == {one.name: (one.offset, one.reset) for one in registers}
    told = " ".join(text.split())
    fields = {row[0].strip("`"): (row[1], row[2]) for row in rows if len(row) == 4}
    for one in registers:
        for field in one.fields:
            if field.width < 32:
                bits = str(field.low) if field.width == 1 else f"{field.low + field.width - 1}:{field.low}"
                assert fields.pop(f"{one.name}.{field.name}") == (bits, field.access)
            assert field.help.replace("|", "\\|") in told
            assert field.unit in told
    assert not fields


def check_client(registers: RegisterMap, text: str, folder: Path) -> None:
    """The snapshot has all outputs of the core but its strobes, which are told by the ports, not by the map."""
    spec = registers.spec
    described = manifest(spec) | {"registers": registers.described()}
    memory = {one.offset: one.reset for one in registers}
    values = {
        port.name: 1 - (1 << port.width - 1) if port.signed else (1 << port.width) - 1
        for port in spec.ports.outputs
        if not port.is_strobe
    }
    for one in registers:
        for field in one.fields if one.captured else ():
            value = values.get(field.port, 1)
            memory[one.offset] |= (value >> field.shift & (1 << field.width) - 1) << field.low
    snapshot = Client(memory.__getitem__, memory.__setitem__, described).snapshot()
    assert dict(snapshot) == values | dict.fromkeys(RegisterMap(spec).events, 1)
    assert snapshot.flags.keys() == flags(spec) | RegisterMap(spec).events.keys()
    assert snapshot.velocity_rad_per_s == values["velocity"] * spec.velocity.rad_per_s_per_lsb


def check_driver(registers: RegisterMap, text: str, folder: Path) -> None:
    """Check its struct; tests/hdl/bus/test_driver.py runs it."""
    struct = text[text.index("struct spindle_snapshot {") :]
    members = dict(reversed(row) for row in re.findall(r"^  (\w+) (\w+);$", struct[: struct.index("};")], re.MULTILINE))
    spec = registers.spec
    expected = dict.fromkeys(RegisterMap(spec).events, "bool")
    for port in spec.ports.outputs:
        if not port.is_strobe:
            bits = 64 if port.width > 32 else 32
            expected[port.name] = "bool" if port.width == 1 else f"{'' if port.signed else 'u'}int{bits}_t"
    assert members == expected
    counters = text[text.index("struct spindle_counters {") :]
    assert re.findall(r"^  uint8_t (\w+);$", counters[: counters.index("};")], re.MULTILINE) == [*registers.counted]


def flags(spec: TachometerSpec) -> set[str]:
    return {port.name for port in spec.ports.outputs if port.width == 1 and not port.is_strobe}


Check = Callable[[RegisterMap, str, Path], None]
TEXTS: dict[str, Check] = {
    "spindle.rdl": check_rdl,
    "spindle_regs.h": check_header,
    "spindle_driver.h": check_driver,
    "spindle_registers.md": check_page,
    "": check_client,
}


@cache
def texts_of(registers: RegisterMap) -> Mapping[str, str]:
    return {"": "", **register_files(registers, "spindle")}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("file", TEXTS)
def test_every_register_and_field_is_there(file: str, method: str, tmp_path: Path) -> None:
    for registers in maps(method):
        TEXTS[file](registers, texts_of(registers)[file], tmp_path)


@pytest.mark.parametrize("command", ["ports", "generator"])
@pytest.mark.parametrize("file", ["spindle.rdl", "spindle_regs.h", "spindle_registers.md"])
def test_every_register_of_a_control_loop_is_there(file: str, command: str, tmp_path: Path) -> None:
    core = of_texts("s", BASE | {"max-speed": "500rad/s"})
    spec = LoopSpec(tachometer=core, gains="inputs", command=command, multiplier="parallel")
    TEXTS[file](registers_of(spec), texts_of(registers_of(spec))[file], tmp_path)


def test_the_configurations_have_all_kinds() -> None:
    """Values of two words, signed and not, and every option that adds a register."""
    names = {one.name for method in METHODS for registers in maps(method) for one in registers}
    assert {"VELOCITY_HIGH", "POSITION_HIGH", "INDEX_POSITION", "AGE", "VELOCITY_LOWER", "FILTERED_EDGES"} <= names
    assert {"N_EP1", "DT_SHIFT", "ACCELERATION", "POSITION_FINE", "POSITION_FINE_HIGH"} <= names
    assert any("tick_errors" in registers.counted for registers in maps("s"))


def test_words_with_hyphens_are_not_parted() -> None:
    """Where a text of RDL goes on in the next line, there is a space."""
    text = " ".join(["of-many-parts"] * 40)
    lines = described(text).splitlines()
    assert max(map(len, lines)) <= 108
    assert " ".join(line.strip() for line in lines) == f'desc = "{text}";'


@pytest.mark.parametrize("name", ["field", "mem", "property", "NAME", "PREFIX", "real", "abstract", "ref"])
def test_names_that_have_a_meaning_elsewhere(name: str, tmp_path: Path) -> None:
    files = register_files(maps("s")[0], name)
    top = read_rdl(files[f"{name}.rdl"], tmp_path)
    assert top.inst_name == name
    driver = files[f"{name}_driver.h"]
    assert f"static inline enum {name}_status {name}_init(const struct {name}_bus *bus)" in driver
    assert f"#ifndef {name.upper()}_DRIVER_H" in driver


def test_they_lie_beside_the_verilog_of_a_core_on_a_bus() -> None:
    spec = of_texts("s", BASE)
    without, with_bus = export(spec, "spindle"), export(spec, "spindle", "wishbone")
    texts = register_files(RegisterMap(spec), "spindle")
    assert [*texts] == [file.replace("NAME", "spindle") for file in REGISTER_FILES]
    assert {file: text for file, text in with_bus.items() if file not in without} == texts
    for file, text in texts.items():
        assert max(map(len, text.splitlines())) <= 120 or file.endswith(".md"), file
