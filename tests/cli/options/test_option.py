"""Options of core and loop: what commands report of them, and that a capture keeps all lines."""

from pathlib import Path

import pytest
from support.command import run

from tachometry.spec import METHODS, LoopSpec
from tachometry.spec.language.option import options_of

CORE = "--method s --ppr 24 --clock 100kHz --tick 1ms --max-time 20ms".split()
LINES = "--index --index-reset --external-tick".split()


def test_a_capture_keeps_index_and_tick(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    captured = tmp_path / "x.sr"
    motion = ["--motion", "constant:600rpm:200ms+constant:-600rpm:100ms"]
    unit = "--unit rpm --lsb 2^-3 --velocity-width 12".split()
    files = ["--save-capture", captured, "--trace", tmp_path / "1.csv", "--vcd", tmp_path / "x.vcd"]
    assert run("simulate", *CORE, *LINES, *unit, *motion, *files) == 0
    told = " ".join(capsys.readouterr().out.split())
    # Upwards at 2 counts and a turn further, which is then 0, and there again on the way back.
    assert " index 3 times, the last at position 0, 0 to 96 counts apart " in told
    assert " counts in 96 counts out 96 " in told
    assert " tick errors 0 (external tick too early or missing) " in told
    assert " velocity overflow " in told  # 600 rpm are 4800 LSB, and twelve bits hold 2047
    named = "--z tachometer.z --tick-in tachometer.tick_in".split()
    for reading, words in ((captured, []), (tmp_path / "x.vcd", []), (tmp_path / "x.vcd", named)):
        assert run("replay", reading, *CORE, *LINES, *unit, *words, "--trace", tmp_path / "2.csv") == 0
        assert (tmp_path / "1.csv").read_text() == (tmp_path / "2.csv").read_text()


def test_a_tick_that_stays_away_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.csv").write_text("time,a,b,sync\n0,0,0,0\n0.001,0,0,1\n0.0015,0,0,0\n0.01,0,0,0\n")
    words = ["--external-tick", "--tick-in", "sync", "--engine", "pysim"]
    assert run("replay", tmp_path / "x.csv", *CORE, *words) == 0
    assert " tick errors 4 (external tick too early or missing)" in " ".join(capsys.readouterr().out.split())


LOOP = ["--ppr", "500", "--clock", "10MHz", "--tick", "100us", "--max-speed", "400rad/s"]
COMMANDS = {
    "generate": ["generate", *LOOP, "--loop"],
    "loop": ["loop", *LOOP, "--methods", "s", "--motion", "ramp:0:20rad/s:20ms", "--seeds", "1"],
}
ACCEPTED = [["--kp", "0"], ["--velocity-filter", "NONE"], ["--observer", "20Hz"], ["--control-period", "2000clk"]]


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ACCEPTED, ids=" ".join)
def test_accepted(command: str, option: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # An option is accepted before the Verilog is written, which takes most of the time.
    monkeypatch.setattr("tachometry.hdl.export.files.verilog_of", lambda *_: "")
    output = ["-o", tmp_path] if command == "generate" else []
    assert run(*COMMANDS[command], *option, *output) == 0


def test_no_option_of_the_loop_is_one_of_a_method() -> None:
    """One of the two could not be given."""
    loop = {about.name for about in options_of(LoopSpec)}
    assert not loop & {about.name for spec in METHODS.values() for about in options_of(spec)}
