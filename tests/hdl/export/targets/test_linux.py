"""Programs for Linux, in C and Python, on a file that holds the words of the registers; dtc reads the overlay."""

import importlib.util
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from support.axes import small
from support.nightly import nightly, only

from tachometry.hdl.export import export
from tachometry.sim import build
from tachometry.spec import AxesSpec, ParameterError, of_options, of_texts
from tachometry.spec.control import AnySpec
from tachometry.spec.core.index import Index
from tachometry.spec.registers.buses import bus_of, registers_on
from tachometry.spec.registers.map import RegisterMap

BASE = {"ppr": "8", "clock": "1MHz", "tick": "80us", "max-time": "800us", "max-speed": "400rad/s"}
LOOP = {"method": "m", "tick": "200us", "max-time": "2ms", "loop": "yes", "gains": "inputs"}
CORES: dict[str, tuple[AnySpec, str, bool]] = {
    "irq": (of_texts("s", BASE | {"index": "yes", "position-width": "40"}), "axi-lite", True),
    "apb": (of_texts("mt", BASE), "apb", False),
    "axes": (small(2, parallel=True, index=Index()), "axi-lite", True),
    "loop": (of_options(BASE | LOOP), "axi-lite", False),
    "wishbone": (of_texts("track", BASE | {"tick": "1ms", "max-time": "10ms"}), "wishbone", False),
}
SIZE = 4096


@cache
def made(core: str, name: str = "spindle") -> dict[str, str]:
    spec, bus, irq = CORES[core]
    return export(spec, name, bus, target="linux", irq=irq)


def registers_of(core: str) -> RegisterMap:
    spec, bus, irq = CORES[core]
    on = bus_of(bus, irq=irq)
    assert on is not None
    return registers_on(spec, on)


def device(core: str, folder: Path) -> tuple[Path, dict[str, int]]:
    """Write a file as a UIO device would show it, and return what its captured values and flags are."""
    rng = np.random.default_rng(7)
    registers, shown = registers_of(core), dict[str, int]()
    words = np.zeros(SIZE // 4, dtype="<u4")
    for register in registers:
        word = register.reset if register.constant else int(rng.integers(1 << 32))
        words[register.offset // 4] = word
        for field in register.fields if register.captured else ():
            value = word >> field.low & (1 << field.width) - 1
            name = field.port if field.width == 32 else field.name
            shown[name] = shown.get(name, 0) | value << field.shift
    for register in registers:
        for field in register.fields if register.captured else ():
            bits = field.shift + 32
            last = not any(
                other.port == field.port and other.shift > field.shift
                for one in registers
                if one.captured
                for other in one.fields
            )
            if field.signed and last and shown[field.port] >> (bits - 1):
                shown[field.port] -= 1 << bits
    place = folder / "uio"
    place.write_bytes(words.tobytes())
    return place, shown


def client(text: str, folder: Path) -> ModuleType:
    (folder / "spindle_uio.py").write_text(text, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("spindle_uio", folder / "spindle_uio.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("core", only(["irq", "apb"], CORES))
def test_the_client_in_python_reads_all(core: str, tmp_path: Path) -> None:
    place, shown = device(core, tmp_path)
    module = client(made(core)["spindle_uio.py"], tmp_path)
    with module.Tachometer(str(place)) as device_:
        found = device_.read()
        assert found == shown
        velocity = next(name for name in found if name.startswith("velocity"))
        per_lsb = CORES[core][0].tachometer.velocity.rad_per_s_per_lsb
        assert device_.rad_per_s(found[velocity]) == found[velocity] * per_lsb
        if "INTERRUPTS" in module.REGISTERS:
            device_.enable_interrupts("stall", "error")
            device_["INTERRUPTS"] = 1 << module.EVENTS["stall"]
            assert device_.take_interrupts() == ["stall"]
    words = np.frombuffer(place.read_bytes(), dtype="<u4")
    if "INTERRUPTS" in module.REGISTERS:
        bits = {name: 1 << bit for name, bit in module.EVENTS.items()}
        assert words[module.REGISTERS["INTERRUPT_ENABLE"] // 4] == bits["stall"] | bits["error"]
        assert words[module.REGISTERS["INTERRUPT_CLEAR"] // 4] == bits["stall"]


def test_the_client_refuses_another_core(tmp_path: Path) -> None:
    place, _ = device("apb", tmp_path)
    module = client(made("irq")["spindle_uio.py"], tmp_path)
    with pytest.raises(ValueError, match="must map spindle of this version, 0x"):
        module.Tachometer(str(place))
    done = subprocess.run([sys.executable, tmp_path / "spindle_uio.py", place], capture_output=True, text=True)
    assert done.returncode == 1


def compiled(core: str, name: str, folder: Path) -> Path:
    for file, text in made(core, name).items():
        (folder / file).write_text(text, encoding="utf-8")
    strict = ("-x", "c", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion")
    compiler = build.compiler()
    build.run([*compiler, *strict, f"{name}_uio.c", "-o", "main"], "compiler", folder)
    return folder / "main"


# `x_OK` is also a macro of unistd.h.
@pytest.mark.skipif(sys.platform == "win32", reason="there is no mmap")
@pytest.mark.parametrize(
    ("core", "name"), [("irq", "x")] + [pytest.param(core, "spindle", marks=nightly) for core in CORES]
)
def test_the_program_in_c_shows_the_registers(core: str, name: str, tmp_path: Path) -> None:
    program = compiled(core, name, tmp_path)
    place, shown = device(core, tmp_path)
    done = subprocess.run([program, place], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    found = dict(line.split()[:2] for line in done.stdout.splitlines())
    spec = CORES[core][0]
    names = [f"{kind}_{axis}" for kind in ("velocity", "position") for axis in range(spec.axes or 0)]
    assert found.keys() == ({*names} if isinstance(spec, AxesSpec) else {"velocity", "position"})
    for value, text in found.items():
        scale = spec.tachometer.velocity.rad_per_s_per_lsb if value.startswith("velocity") else 1
        assert float(text) == pytest.approx(shown[value] * scale, rel=1e-5)
    (tmp_path / "other").write_bytes(bytes(SIZE))
    done = subprocess.run([program, tmp_path / "other"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (1, f"this is not {name}, or another version of it\n")


@pytest.mark.parametrize(("core", "interrupts"), [("irq", ["0 29 4"]), ("apb", [])])
def test_the_interrupt_is_shared_61_and_its_level_is_high(core: str, interrupts: list[str]) -> None:
    """0 is a shared one, whose numbers begin at 32, and 4 a high level, which `irq` has while an event waits."""
    assert re.findall(r"interrupts = <(.*)>;", made(core)["spindle.dtso"]) == interrupts


# It needs dtc, which `make dtc` installs.
@nightly
@pytest.mark.parametrize("core", CORES)
def test_dtc_takes_the_overlay(core: str, tmp_path: Path) -> None:
    text = made(core)["spindle.dtso"]
    (command,) = re.findall(r"(dtc .*)", text)
    (tmp_path / "spindle.dtso").write_text(text)
    done = subprocess.run(command.split(), cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")
    back = subprocess.run(
        ["dtc", "-I", "dtb", "-O", "dts", "spindle.dtbo"], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout
    assert 'compatible = "generic-uio"' in back
    assert ("interrupts = <0x00 0x1d 0x04>" in back) == CORES[core][2]


def test_other_buses_are_refused() -> None:
    with pytest.raises(ParameterError, match="bus must be axi-lite or apb or wishbone for linux, not spi"):
        export(CORES["irq"][0], "spindle", "spi", target="linux")
