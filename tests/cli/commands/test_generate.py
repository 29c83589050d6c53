"""`tachometry generate`."""

import json
import math
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
from support import docs
from support.command import run
from support.compiled import lint
from support.nightly import only_rows

from tachometry.hdl.export import export
from tachometry.sim import build
from tachometry.spec import Encoder, Speed, STachometer, Timing, of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.ports import loop_entries
from tachometry.spec.language.option import options_of
from tachometry.spec.registers.manifest import manifest


def test_options_reach_the_core(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = (
        "--method s --ppr 360 --decoding 2 --clock 10MHz --tick 50us --max-time 5ms --frac-bits 12 --no-cancel "
        "--max-speed 3000rpm --name spindle_"
    )
    assert run("generate", *options.split(), "-o", tmp_path / "new" / "rtl") == 0
    spec = STachometer(
        encoder=Encoder(360, 2),
        timing=Timing(10_000_000, 500, 100),
        frac_bits=12,
        max_speed=Speed.parse("3000rpm"),
        cancel=False,
    )
    written = {path.name: path.read_bytes().decode() for path in (tmp_path / "new" / "rtl").iterdir()}
    assert written == export(spec, "spindle_")
    assert "\nmodule spindle_ (\n" in written["spindle_.v"]
    assert capsys.readouterr().out.split("\n\n")[0].split() == [
        str(tmp_path / "new" / "rtl" / f"spindle_{suffix}")
        for suffix in (".v", ".json", ".core", "_inst.v", "_pkg.vhd", "_tb.sv", ".xdc", ".sdc")
    ]


@pytest.mark.parametrize(
    ("words", "more"),
    [
        ("--bus uart --baud 115200", {"bus": "uart", "baud": 115_200}),
        ("--for rio", {"target": "rio"}),
        ("--for litex --irq", {"target": "litex", "irq": True}),
    ],
)
def test_it_writes_and_lists_the_files_of_export(
    words: str, more: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("generate", "--method", "s", "--ppr", "500", "--name", "spindle", *words.split(), "-o", tmp_path) == 0
    texts = export(of_texts("s", {"ppr": "500"}), "spindle", **more)
    listed, rows = capsys.readouterr().out.split("\n\n")
    assert listed.splitlines() == [str(tmp_path / file) for file in texts]
    assert {file: (tmp_path / file).read_text() for file in texts} == texts
    assert len([path for path in tmp_path.rglob("*.*") if path.is_file()]) == len(texts)
    described = json.loads(texts["spindle.json"])
    if "registers" in described:
        number, configuration = len(described["registers"]["map"]), described["registers"]["configuration"]
        said = f"{number} of 32 bits on {described['bus']}, configuration 0x{configuration:08x}"
        assert rows.split("registers")[-1].splitlines()[0].strip() == said


def test_defaults(tmp_path: Path) -> None:
    assert run("generate", "--method", "s", "--ppr", "500", "-o", tmp_path) == 0
    described = json.loads((tmp_path / "tachometer.json").read_text())
    assert described["parameters"] == manifest(STachometer(encoder=Encoder(500)))["parameters"]


def test_every_option_is_in_the_manifest(tmp_path: Path) -> None:
    options = "--ppr 500 --unit rpm --lsb 2^-3 --velocity-width 12 --index --index-reset --filter 4 --external-tick"
    assert run("generate", "--method=s", *options.split(), "--max-tick-period", "30us", "-o", tmp_path) == 0
    manifest = json.loads((tmp_path / "tachometer.json").read_text())
    expected = {
        "unit": "rpm",
        "frac_bits": 3,
        "velocity_width": 12,
        "index": True,
        "index_reset": True,
        "filter_clocks": 4,
        "max_tick_cycles": 1440,
    }
    assert manifest["parameters"] | expected == manifest["parameters"]
    assert manifest["velocity"] | {"unit": "rpm", "frac_bits": 3, "width": 12} == manifest["velocity"]
    assert manifest["velocity"]["rad_per_s_per_lsb"] == pytest.approx(math.pi / 30 / 8)
    assert manifest["latency_cycles"]["pin_to_count"] == 6
    assert manifest["latency_cycles"]["tick_in_to_window_end"] == 2
    assert manifest["external_tick_cycles"] == {"min": manifest["external_tick_cycles"]["min"], "max": 1440}
    inputs = [port["name"] for port in manifest["ports"] if port["direction"] == "input"]
    assert inputs == ["clk", "rst", "a", "b", "z", "tick_in"]
    of_index = ["index_valid", "index_wide", "index_missed", "index_position"]
    options_of_output = ["velocity_overflow", *of_index, "tick_error", "filtered_edges"]
    assert [port["name"] for port in manifest["ports"]][-7:] == options_of_output


def test_lsb_and_fraction_bits_are_two_words_for_one_thing(tmp_path: Path) -> None:
    for name, words in (("lsb", "--lsb 2^-8"), ("bits", "--frac-bits 8")):
        assert run("generate", "--method", "m", "--ppr", "500", *words.split(), "-o", tmp_path / name) == 0
    verilog = [(tmp_path / name / "tachometer.v").read_text() for name in ("lsb", "bits")]
    assert verilog[0] == verilog[1]


BAUDS = [("", 1_000_000, 48), ("--baud 115200", 115_200, 417)]


@pytest.mark.parametrize(("words", "baud", "cycles"), only_rows(BAUDS[1:], BAUDS))
def test_baud_reaches_the_bus(words: str, baud: int, cycles: int, tmp_path: Path) -> None:
    assert run("generate", "--method", "m", "--ppr", "500", "--bus", "uart", *words.split(), "-o", tmp_path) == 0
    manifest = json.loads((tmp_path / "tachometer.json").read_text())
    assert [manifest[key] for key in ("bus", "baud", "bit_cycles")] == ["uart", baud, cycles]
    assert {"uart_rx", "uart_tx"} < {port["name"] for port in manifest["ports"]}


def test_output_directory_that_is_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("before")
    assert run("generate", "--ppr", "9", "-o", tmp_path / "file") == 2
    assert "file/tachometer.v: Not a directory" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_ctrl_c(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tachometry.hdl.export.files.verilog_of", interrupted)
    assert run("generate", "--ppr", "9", "-o", tmp_path / "new") == 130
    assert capsys.readouterr() == ("", "tachometry: interrupted\n")
    assert not list(tmp_path.iterdir())


# `tachometry generate --loop`.
CORE = "--ppr 25 --clock 1MHz --tick 250us --max-time 2ms --max-speed 500rad/s --loop".split()
PAGE = docs.page("reference/manifest.md")


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
