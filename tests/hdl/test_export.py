import importlib.metadata
import json
import os
import re
import subprocess
import sys

import pytest

from tachometry.hdl import export
from tachometry.spec import Encoder, Speed, STachometer, Timing

VERSION = importlib.metadata.version("tachometry")


def make_spec(tick: str = "20us", **options: object) -> STachometer:
    return STachometer(encoder=Encoder(500), timing=Timing.parse("48MHz", tick, "10ms"), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("spec", [make_spec(), make_spec("5us", max_speed=Speed.parse("400rad/s"), cancel=False)])
def test_files(spec: STachometer) -> None:
    files = export(spec, "speed_meter")
    assert list(files) == ["speed_meter.v", "speed_meter.json", "speed_meter.core"]
    described = json.loads(files["speed_meter.json"])
    assert described["module"] == "speed_meter"
    # The ports of the module are those of the manifest, in width and direction.
    top = re.search(r"\nmodule speed_meter\(.*?\nendmodule", files["speed_meter.v"], re.DOTALL)
    assert top is not None
    found = re.findall(r"^  (input|output) (?:\[(\d+):0\] )?(\w+);", top[0], re.MULTILINE)
    assert {(name, direction, int(high or 0) + 1) for direction, high, name in found} == {
        (port["name"], port["direction"], port["width"]) for port in described["ports"]
    }
    assert files["speed_meter.core"].startswith(f"CAPI=2:\nname: ::speed_meter:{VERSION}\n")
    assert described["generator"] == f"tachometry {VERSION}"
    assert f"// Made by tachometry {VERSION}.\n" in files["speed_meter.v"]
    assert "toplevel: speed_meter" in files["speed_meter.core"]


@pytest.mark.parametrize("tick_cycles", [2, 16, 960])
def test_no_divider(tick_cycles: int) -> None:
    spec = STachometer(encoder=Encoder(500), timing=Timing(48_000_000, tick_cycles, 500))
    text = export(spec)["tachometer.v"]
    code = re.sub(r"//.*|/\*.*?\*/|\(\*.*?\*\)", "", text)
    assert " / " not in code
    assert " % " not in code
    assert " * " not in code
    assert "$div" not in code
    assert "$mod" not in code


def test_no_absolute_path_and_no_warning_switched_off_but_five() -> None:
    text = export(make_spec())["tachometer.v"]
    assert os.sep + "work" not in text
    assert "(* src" not in text
    assert re.findall(r"lint_off (\w+)", text) == [
        "DECLFILENAME",
        "PROCASSINIT",
        "UNUSEDSIGNAL",
        "WIDTHEXPAND",
        "WIDTHTRUNC",
    ]


_PROGRAM = """
from tachometry.hdl import export
from tachometry.spec import Encoder, STachometer, Timing
files = export(STachometer(encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms")))
import hashlib
print(hashlib.sha256("".join(files.values()).encode()).hexdigest())
"""


def test_equal_specs_give_equal_files_whatever_the_environment() -> None:
    seen = set()
    for number, yosys in (("1", "builtin"), ("2", "system")):
        environment = os.environ | {"PYTHONHASHSEED": number, "AMARANTH_USE_YOSYS": yosys}
        result = subprocess.run(
            [sys.executable, "-c", _PROGRAM], env=environment, check=True, capture_output=True, text=True
        )
        seen.add(result.stdout)
    assert len(seen) == 1
    assert len(seen.pop().strip()) == 64


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("module", "name must not be a Verilog keyword, which 'module' is"),
        ("wire", "name must not be a Verilog keyword, which 'wire' is"),
        ("2fast", "name must be a letter or _ and up to 63 letters, digits or _, not '2fast'"),
        ("a/b", "name must be a letter or _ and up to 63 letters, digits or _, not 'a/b'"),
        ("", "name must be a letter or _ and up to 63 letters, digits or _, not ''"),
    ],
)
def test_bad_names(name: str, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        export(make_spec(), name)
