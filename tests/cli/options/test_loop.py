"""Every command gives one answer to an option of a control loop."""

from pathlib import Path

import pytest
from support.command import run

from tachometry.spec import METHODS, LoopSpec
from tachometry.spec.language.option import options_of

CORE = ["--ppr", "500", "--clock", "10MHz", "--tick", "100us", "--max-speed", "400rad/s"]
COMMANDS = {
    "generate": ["generate", *CORE, "--loop"],
    "loop": ["loop", *CORE, "--methods", "s", "--motion", "ramp:0:20rad/s:20ms", "--seeds", "1"],
}
ACCEPTED = [["--kp", "0"], ["--velocity-filter", "NONE"], ["--observer", "20Hz"], ["--control-period", "2000clk"]]
REFUSED = {
    ("--kv", "0"): "--kv must be greater than 0, not 0",
    ("--kv", "30/s"): "--kv must be a number, not '30/s'",
    ("--kp", "-1"): "--kp must be at least 0, not -1",
    ("--kp", "1e13"): "--kp must be of a size from 1e-12 to 1e12, not 1e+13",
    ("--observer", "0rad/s"): "--observer must be greater than 0, not 0",
    (
        "--observer",
        "160",
    ): "--observer must be a number with one of the units rad/s, Hz, kHz, MHz, GHz: type 160rad/s, 160Hz, 160kHz, "
    "160MHz or 160GHz, not '160'",
    ("--velocity-filter", "-3Hz"): "--velocity-filter must be greater than 0, not -18.8495559",
    ("--inertia", "1e9"): "--inertia must be of a size from 1e-12 to 1e6, not 1e+09",
    ("--current-limit", "5"): "--current-limit must be a number with one of the units A, mA: type 5A or 5mA, not '5'",
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ACCEPTED, ids=" ".join)
def test_accepted(command: str, option: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # An option is accepted before the Verilog is written, which takes most of the time.
    monkeypatch.setattr("tachometry.hdl.export.files.verilog_of", lambda top, described: "")
    output = ["-o", tmp_path] if command == "generate" else []
    assert run(*COMMANDS[command], *option, *output) == 0


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", REFUSED, ids=" ".join)
def test_refused(command: str, option: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = ["-o", tmp_path] if command == "generate" else []
    assert run(*COMMANDS[command], *option, *output) == 2
    assert capsys.readouterr().err == f"tachometry: error: {REFUSED[option]}\n"


def test_no_option_of_the_loop_is_one_of_a_method() -> None:
    """One of the two could not be given."""
    loop = {about.name for about in options_of(LoopSpec)}
    assert not loop & {about.name for spec in METHODS.values() for about in options_of(spec)}
