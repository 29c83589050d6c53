"""`tachometry generate`."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from support.command import run
from support.nightly import only_rows

from tachometry.hdl.export import export
from tachometry.spec import Encoder, Speed, STachometer, Timing, of_texts
from tachometry.spec.registers.manifest import manifest


def test_options_reach_the_core(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = (
        "--method s --ppr 360 --decoding 2 --clock 10MHz --tick 50us --max-time 5ms --frac-bits 12 --no-cancel "
        "--max-speed 3000rpm --name spindle"
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
    assert written == export(spec, "spindle")
    assert capsys.readouterr().out.split("\n\n")[0].split() == [
        str(tmp_path / "new" / "rtl" / f"spindle{suffix}")
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
