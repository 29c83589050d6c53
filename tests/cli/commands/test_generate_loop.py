"""`tachometry generate --loop`."""

import json
import re
import subprocess
from pathlib import Path

import pytest
from support import docs
from support.command import run
from support.compiled import lint

from tachometry.sim import build
from tachometry.spec import of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.ports import loop_entries
from tachometry.spec.language.option import options_of

CORE = "--ppr 25 --clock 1MHz --tick 250us --max-time 2ms --max-speed 500rad/s --loop".split()
PAGE = docs.page("guides/integration.md")


def test_files_of_a_loop(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They are read without a warning, the bench beside them passes, and the manifest has the options."""
    words = "--kp 400 --kv 40 --observer 80rad/s --velocity-filter none --no-synchronised --current-limit 5A".split()
    assert run("generate", *CORE, *words, "--name", "servo", "-o", tmp_path) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "gains kp 400 1/s², kv 40 1/s observer 80 rad/s, velocity filter none, at every control tick" in told
    lint(["servo.v"], "servo", tmp_path)
    subprocess.run(["iverilog", "-g2012", "-Wall", "-o", "bench", "servo.v", "servo_tb.sv"], cwd=tmp_path, check=True)
    done = subprocess.run(["./bench"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("PASS: position 24")
    # Commands are synchronous, lines are not.
    constrained = set(re.findall(r"^# (\w+)$", (tmp_path / "servo.xdc").read_text(), re.MULTILINE))
    assert constrained == {"a", "b"}
    described = json.loads((tmp_path / "servo.json").read_text())
    assert described["parameters"]["loop"].keys() == {about.parameter for about in options_of(LoopSpec)}
    assert described["parameters"]["loop"]["velocity_filter"] is None
    assert described["loop"]["current"] == {"width": 16, "amperes_per_lsb": 2.0**-12, "limit": 5 << 12}
    found = {f"loop.{key}" for key, value in described["loop"].items() if not isinstance(value, dict)}
    found |= {
        f"loop.{key}.{inner}" for key, value in described["loop"].items() if isinstance(value, dict) for inner in value
    }
    more = loop_entries(LoopSpec(tachometer=of_texts("s", {"ppr": "500"}), command="generator", gains="inputs"))
    found |= {f"loop.generator.{key}.{inner}" for key, value in more["generator"].items() for inner in value}
    found |= {f"loop.gains.NAME.{inner}" for value in more["gains"].values() for inner in value}
    assert found <= set(re.findall(r"^\| `([\w.]+)` \|", PAGE, re.MULTILINE))


def test_registers_of_a_loop(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They are read without a warning, the bench passes, and driver and manifest say what a gain is."""
    words = "--kp 400 --kv 40 --gains inputs --command generator --bus axi-lite --name servo -o".split()
    assert run("generate", *CORE, *words, tmp_path) == 0
    assert re.search(r"registers +\d+ of 32 bits on axi-lite, configuration 0x", capsys.readouterr().out)
    lint(["servo.v"], "servo", tmp_path)
    subprocess.run(["iverilog", "-g2012", "-Wall", "-o", "bench", "servo.v", "servo_tb.sv"], cwd=tmp_path, check=True)
    done = subprocess.run(["./bench"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("PASS: position 24")
    (tmp_path / "main.c").write_text(
        '#include "servo_driver.h"\n'
        "int main(void) { return SERVO_GAIN_POSITION_PER_LSB * SERVO_GAIN_POSITION_RESET < 399.9 || "
        "SERVO_GENERATOR_AMPLITUDE_COUNTS_PER_LSB != 1.0 / 256 || SERVO_GENERATOR_RATE_PER_LSB >= 1e-6; }\n"
    )
    strict = ("-x", "c", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion")
    build.run([*build.compiler(), *strict, "main.c", "-o", "main"], "compiler", tmp_path)
    subprocess.run(["./main"], cwd=tmp_path, check=True)
    described = json.loads((tmp_path / "servo.json").read_text())
    gain = described["loop"]["gains"]["gain_position"]
    assert round(400 / gain["per_lsb"]) == gain["option"] <= gain["most"] // 16
    registers = {one["name"]: one for one in described["registers"]["map"]}
    (field,) = registers["GAIN_POSITION"]["fields"]
    assert (field["reset"], field["least"], field["most"]) == (gain["option"], 0, gain["most"])
    inputs = {port["name"] for port in described["ports"] if port["direction"] == "input"}
    assert "enable" in inputs
    assert not {"gain_position", "freeze", "generator_mode"} & inputs
