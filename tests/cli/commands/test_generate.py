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
        assert rows.split("registers")[-1].strip() == said


def test_defaults(tmp_path: Path) -> None:
    assert run("generate", "--method", "s", "--ppr", "500", "-o", tmp_path) == 0
    assert json.loads((tmp_path / "tachometer.json").read_text())["parameters"] == {
        "method": "s",
        "pulses_per_rev": 500,
        "decoding": 4,
        "clock_hz": 48_000_000,
        "tick_cycles": 960,
        "max_ticks": 500,
        "unit": "count/tick",
        "frac_bits": 16,
        "velocity_width": 27,
        "max_speed": None,
        "position_width": 32,
        "filter_clocks": 0,
        "index": False,
        "index_reset": False,
        "max_tick_cycles": None,
        "age": False,
        "bounds": False,
        "edge_error": 0.0,
        "lowpass": None,
        "cancel": True,
        "reciprocal_source": "serial",
    }


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
    options_of_output = ["velocity_overflow", "index_valid", "index_position", "tick_error", "swallowed_edges"]
    assert [port["name"] for port in manifest["ports"]][-5:] == options_of_output


def test_lsb_and_fraction_bits_are_two_words_for_one_thing(tmp_path: Path) -> None:
    for name, words in (("lsb", "--lsb 2^-8"), ("bits", "--frac-bits 8")):
        assert run("generate", "--ppr", "500", *words.split(), "-o", tmp_path / name) == 0
    verilog = [(tmp_path / name / "tachometer.v").read_text() for name in ("lsb", "bits")]
    assert verilog[0] == verilog[1]


BAUDS = [("", 1_000_000, 48), ("--baud 115200", 115_200, 417)]


@pytest.mark.parametrize(("words", "baud", "cycles"), only_rows(BAUDS[1:], BAUDS))
def test_baud_reaches_the_bus(words: str, baud: int, cycles: int, tmp_path: Path) -> None:
    assert run("generate", "--ppr", "500", "--bus", "uart", *words.split(), "-o", tmp_path) == 0
    manifest = json.loads((tmp_path / "tachometer.json").read_text())
    assert [manifest[key] for key in ("bus", "baud", "bit_cycles")] == ["uart", baud, cycles]
    assert {"uart_rx", "uart_tx"} < {port["name"] for port in manifest["ports"]}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--ppr 0", "--ppr must be from 1 to 4194304 with x4 decoding, not 0"),
        ("--ppr many", "--ppr must be a whole number, not 'many'"),
        ("", "--ppr must be given, or --lines, or --cpr"),
        ("--ppr 9 --decoding 3", "--decoding must be 1, 2 or 4, or x1, x2 or x4, not '3'"),
        ("--ppr 9 --method x", "--method must be one of auto, s, m, t, mt, rairan, track, not 'x'"),
        ("--ppr 9 --clock 48Hz", "--tick must be a whole number of clocks, not 20us"),
        ("--ppr 9 --clock 48mxz", "--clock must be a number with one of the units Hz, kHz, MHz, GHz, not '48mxz'"),
        ("--ppr 9 --clock 0Hz", "--clock must be a positive whole number of Hz, not '0Hz'"),
        ("--ppr 9 --tick 20clk --max-time 1s", "--max-time, in ticks, must be from 2 to 1048576, not 2400000"),
        ("--ppr 9 --tick 1s --max-time 2s", "--tick, in clocks, must be from 1 to 1048576, not 48000000"),
        ("--ppr 9 --tick -1us", "--tick must be longer than 0, not -1us"),
        ("--ppr 9 --max-time 11us", "--max-time must be a whole number of ticks, not 11us (0.55); nearest: 2 ticks"),
        ("--ppr 9 --clock 1e999GHz", "error: "),
        ("--ppr 9 --frac-bits 30", "--frac-bits must be from 4 to 24, not 30"),
        (
            "--ppr 9 --max-speed 5",
            "--max-speed must be a number with one of the units rad/s, rev/s, rpm: type 5rad/s, 5rev/s or 5rpm, "
            "not '5'",
        ),
        ("--ppr 9 --max-speed 0rpm", "--max-speed must be greater than 0, not 0rpm"),
        ("--ppr 9 --clock 1e29GHz", "--clock must be from 1 Hz to 100 GHz, not 1e+38 Hz"),
        ("--ppr 9 --name tick", "--name must not be that of a port, which 'tick' is"),
        ("--ppr 9 --name module", "--name must not be a Verilog keyword, which 'module' is"),
        ("--ppr 9 --name 9lives", "--name must be a letter or _ and up to 63 letters, digits or _, not '9lives'"),
        ("--ppr 9 --name ../x", "--name must be a letter or _"),
        ("--ppr 9 --unit m/s", "--unit must be one of count/tick, rad/s, rev/s, rpm, not 'm/s'"),
        ("--ppr 9 --lsb 0.3", "--lsb must be a power of two such as 2^-10 or 0.0625, not '0.3'"),
        ("--ppr 9 --lsb 2^-10 --frac-bits 10", "--lsb must not be given together with --frac-bits"),
        (
            "--ppr 500 --unit rpm --lsb 2^-30",
            "--lsb must be from 2^-11 to 2^20 rpm with this encoder and tick, not 2^-30",
        ),
        ("--ppr 500 --unit rad/s --frac-bits 40", "--lsb must be from 2^-14 to 2^17 rad/s with this encoder and tick"),
        ("--ppr 9 --velocity-width 65", "--velocity-width must be from 8 to 64, not 65"),
        ("--ppr 9 --position-width 7", "--position-width must be from 8 to 48, not 7"),
        ("--ppr 9 --filter 11ms", "--filter must be from 0 to 480000 clocks, 10ms, not 528000"),
        ("--ppr 9 --index-reset", "--index-reset must be given together with --index"),
        ("--ppr 9 --max-tick-period 30us", "--max-tick-period must be given together with --external-tick"),
        (
            "--ppr 9 --external-tick --max-tick-period 1us",
            "--max-tick-period, in clocks, must be from 960, one tick, to",
        ),
        ("--ppr 9 --external-tick --max-tick-period 1s", "to 1048576, not 48000000"),
        (
            "--ppr 9 --external-tick --max-tick-period 33ns",
            "--max-tick-period must be a whole number of clocks, not 33ns",
        ),
        ("--ppr 9 --external-tick --tick 1clk", "--tick, in clocks, must be at least 2 with an external tick, not 1"),
        (
            "--ppr 9 --clock 5MHz --bus uart",
            "--baud must be within 2 % of 5000000 Hz over a whole number of at least 8",
        ),
        ("--ppr 9 --bus uart --baud 0", "Invalid value for '--baud': 0 is not in the range x>=1."),
        ("--ppr 9 --bus spi --baud 9600", "--baud must be given together with a bus that has it, uart, not spi"),
        ("--ppr 9 --baud 9600", "--baud must be given together with a bus that has it, uart, not none"),
        ("--ppr 9 --bus uart --name uart_rx", "--name must not be that of a port, which 'uart_rx' is"),
        ("--ppr 9 --qqq", "No such option '--qqq'. (see tachometry generate --help)"),
        ("--ppr 9 more", "Got unexpected extra argument (more)"),
    ],
)
def test_impossible_options(options: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("generate", *options.split(), "-o", tmp_path / "new") == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("tachometry: error: ")
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["generate", "--ppr", "9"], "Missing option '--output' / '-o'. (see tachometry generate --help)"),
        (["generate", "--ppr"], "Option '--ppr' requires an argument. (see tachometry generate --help)"),
        (["make"], "No such command 'make'. (see tachometry --help)"),
    ],
)
def test_incomplete_commands(args: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*args) == 2
    assert capsys.readouterr().err == f"tachometry: error: {message}\n"


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
