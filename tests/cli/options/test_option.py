"""Options of the core through simulate and replay: what is reported, and that a capture keeps all lines."""

from pathlib import Path

import pytest
from support.command import run

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
