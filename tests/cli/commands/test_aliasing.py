"""Edges that come faster than the clock, or the capture, can tell; and times and speeds that a core cannot have."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.command import run

from tachometry.sim.signals.recording import Recording, quadrature

SLOW = "--ppr 500 --clock 20kHz --tick 1ms --engine pysim".split()


def last_lines(text: str) -> str:
    """Return what stands below the table, in one line."""
    return " ".join(text[text.index("WARNING") :].split())


def test_edges_within_a_clock_are_counted_and_told(capsys: pytest.CaptureFixture[str]) -> None:
    # 2000 counts a turn: 60,000 edges a second, three in each clock.
    assert run("simulate", *SLOW, "--motion", "constant:30rev/s:50ms") == 0
    told = last_lines(capsys.readouterr().out)
    assert told.startswith("WARNING: 1999 edges came within one clock of another") or " edges came within" in told
    n_edges = int(told.split()[1])
    assert abs(n_edges - 2000) <= 3
    assert "WARNING: counts out differ from counts in by -" in told
    assert told.endswith("neither was compared with the shaft: see the warning")
    assert run("simulate", *SLOW, "--motion", "constant:1rev/s:50ms") == 0
    assert "WARNING" not in capsys.readouterr().out


def test_a_capture_that_was_sampled_too_slowly_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    level = [quadrature(np.array([2 * k]))[0] for k in range(60)]  # every other edge is missing
    rows = [f"{1e-3 * k},{one & 1},{one >> 1}" for k, one in enumerate(level)]
    (tmp_path / "c.csv").write_text("time,a,b\n" + "\n".join(rows) + "\n")
    assert run("replay", tmp_path / "c.csv", *SLOW) == 0
    assert "at 59 instants of the capture both lines change" in last_lines(capsys.readouterr().out)


def test_merged_edges_are_those_beyond_the_first_of_a_clock() -> None:
    time = np.array([0, 0.1, 0.15, 0.2, 1.0, 1.5, 2.5, 2.6])
    level = quadrature(np.arange(8))
    recording = Recording.of_level(time, level, 3.0)
    assert recording.n_merged(1, 4) == 4  # clocks 1, 1, 1, 1, 2, 3, 3
    assert recording.n_merged(1, 3) == 3
    assert recording.n_merged(100, 300) == 0
    assert recording.n_together == 0
    assert Recording.of_level(time, quadrature(2 * np.arange(8)), 3.0).n_together == 7


def test_a_speed_that_is_cut_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("plan", "--ppr=500", "--clock=1MHz", "--tick=20us", "--max-speed", "100000rpm") == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "note greatest speed cut from 100000rpm to 30000rpm: 20 counts per tick is the most" in told


@pytest.mark.parametrize("command", ["generate", "plan"])
def test_times_that_are_stretched_are_told(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = "--ppr 500 --method mt --tick 10clk --max-time 20clk --min-time 5clk".split()
    assert run(command, *options, *(["-o", tmp_path] if command == "generate" else [])) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "note minimum time raised from 5 clocks to 21: a division takes 22" in told
    assert "note maximum time raised from 20 clocks to 22: a division takes 22" in told
    if command == "generate":
        described = json.loads((tmp_path / "tachometer.json").read_text())
        assert (described["min_time_cycles"], described["max_time_cycles"]) == (21, 22)
        assert described["parameters"]["min_time"] == 21
