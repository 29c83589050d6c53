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


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ACCEPTED, ids=" ".join)
def test_accepted(command: str, option: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # An option is accepted before the Verilog is written, which takes most of the time.
    monkeypatch.setattr("tachometry.hdl.export.files.verilog_of", lambda top, described: "")
    output = ["-o", tmp_path] if command == "generate" else []
    assert run(*COMMANDS[command], *option, *output) == 0


def test_no_option_of_the_loop_is_one_of_a_method() -> None:
    """One of the two could not be given."""
    loop = {about.name for about in options_of(LoopSpec)}
    assert not loop & {about.name for spec in METHODS.values() for about in options_of(spec)}
