"""`tachometry sweep`: what it runs, keeps, tells and draws."""

import random
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from distributed import LocalCluster
from support import command
from support.nightly import nightly

from tachometry.sim.studies.sweeping import results, sweep
from tachometry.sim.studies.sweeping.sweep import COLUMNS

CORE = "--ppr 100 --clock 1MHz --max-time 20ms".split()
MOTION = ["--motion", "constant:{speed}:100ms", "--from", "40ms"]
AXES = ["--vary", "speed=5rad/s,50rad/s", "--vary", "tick=100us,1ms", "--methods", "s,m:average=2"]


def run(*args: object) -> int:
    return command.run("sweep", *args)


def rows(path: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = pq.read_table(path).to_pylist()
    return found


def test_all_cores_of_this_machine(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """As most will use it: no scheduler, options only."""
    files = ["--results", tmp_path / "r.parquet", "--plot", tmp_path / "r.png"]
    assert run(*CORE, *MOTION, *AXES, *files) == 0
    captured = capfd.readouterr()
    assert captured.err == ""
    assert "8 points, 8 of them run in " in captured.out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["r.parquet", "r.png"]
    found = rows(tmp_path / "r.parquet")
    assert list(found[0]) == [*COLUMNS, "speed"]
    at = [(row["method"], row["speed"], row["tick_s"]) for row in found]
    ticks = [(speed, tick) for speed in (5, 50) for tick in (1e-4, 1e-3)]
    assert at == [(method, *where) for method in ("s", "m:average=2") for where in ticks]
    assert {row["average"] for row in found} == {None, 2}
    assert all(row["true_rms_rad_s"] == pytest.approx(row["speed"]) for row in found)


def test_a_file_means_the_same_and_runs_nothing_twice(
    scheduler: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, result = tmp_path / "s.toml", tmp_path / "new" / "r.parquet"
    file.write_text(f"""
ppr = 100
clock = 1_000_000
max-time = "0.02s"
motion = "constant:{{speed}}:0.1s"
from = "40ms"
methods = ["s", "m:average=2"]
results = "{result}"
[vary]
speed = ["5rad/s", "50rad/s"]
tick = ["100us", "1ms"]
""")
    assert run(*CORE, *MOTION, *AXES, *scheduler, "--results", result) == 0
    first = result.read_bytes()
    assert run(file, *scheduler) == 0
    assert capsys.readouterr().out.endswith(f"8 points, none run anew; rows in {result}\n")
    assert result.read_bytes() == first
    # Changed, it shares what has not changed; what is no longer of the sweep stays.
    assert run(file, *scheduler, "--vary", "speed=20rad/s,50rad/s", "--methods", "s") == 0
    assert "4 points, 2 of them run in " in capsys.readouterr().out
    found = rows(result)
    assert [row["speed"] for row in found] == [20, 20, 50, 50, 5, 5, 5, 5, 50, 50]
    assert len({row["point"] for row in found}) == 10


def test_options_are_for_the_methods_that_have_them(
    scheduler: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    motion = ["--motion", "ramp:0:30rad/s:100ms", "--jitter", "0.1"]
    axes = ["--vary=average=1,4", "--vary=dt=1ms,2ms", "--vary=lowpass=none,200rad/s", "--vary=seed=1..3:3"]
    files = ["--results", tmp_path / "r.parquet", "--plot", tmp_path / "r.pdf", "--axes", "dt,average"]
    assert (
        run(*CORE, "--tick", "1ms", "--bounds", *motion, *axes, *files, "--metric=delay", "--methods=all", *scheduler)
        == 0
    )
    found = rows(tmp_path / "r.parquet")
    counts = {method: sum(row["method"] == method for row in found) for method in ("s", "m", "t", "mt", "rairan")}
    assert counts == {"s": 6, "m": 12, "t": 6, "mt": 6, "rairan": 12}
    assert {(row["method"] == "rairan", row["tick_s"]) for row in found} == {(False, 1e-3), (True, 1e-3), (True, 2e-3)}
    assert {row["lowpass_rad_s"] for row in found} == {None, 200}
    assert {row["seed"] for row in found} == {1, 2, 3}
    assert all(row["bounds"] for row in found)
    assert (tmp_path / "r.pdf").read_bytes().startswith(b"%PDF")


def test_what_cannot_be_of_all_methods_is_left_out(scheduler: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        run(*CORE, "--external-tick", "--motion", "stop:50ms", "--vary", "tick=1ms,2ms", "--methods=all", *scheduler)
        == 0
    )
    told = " ".join(capsys.readouterr().out.split())
    assert "rairan: left out: method must not be rairan with an external tick" in told
    assert "(method rairan, tick=1ms)" in told
    assert "10 points" in told


def test_an_option_that_two_methods_have_in_two_ways(scheduler: list[str], tmp_path: Path) -> None:
    """The error of edges belongs to the bounds of s, and is an option of its own of track."""
    line = [*CORE, "--tick", "1ms", "--motion", "constant:20rad/s:50ms", *scheduler]
    assert run(*line, "--methods", "s", "--bounds", "--edge-error", "0.5") == 0
    results = tmp_path / "r.parquet"
    line += ["--vary", "edge-error=0.1,0.5", "--results", str(results)]
    assert run(*line, "--methods", "s,track", "--bounds") == 2  # track has no bounds
    assert run(*line, "--methods", "s", "--bounds") == 0
    assert sorted(pq.read_table(results).column("edge_error").to_pylist()) == [0.125, 0.5]  # in eighths
    assert run(*line, "--methods", "s") == 2


def test_the_hardware_in_lockstep(
    scheduler: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    line = ["--ppr", "20", "--clock", "20kHz", "--tick", "1ms", "--motion", "constant:{speed}:100ms"]
    line += [
        *"--vary speed=5rad/s,50rad/s --methods m --engine pysim".split(),
        "--results",
        str(tmp_path / "r.parquet"),
    ]
    assert run(*line, *scheduler) == 0
    assert capsys.readouterr().out.endswith(
        "PASS: hardware and golden model agree in every bit of 2 points, 4000 clocks\n"
    )
    assert [(row["engine"], row["mismatches"]) for row in rows(tmp_path / "r.parquet")] == [("pysim", 0)] * 2
    assert run(*("speed=5rad/s" if word == "speed=5rad/s,50rad/s" else word for word in line), *scheduler) == 0
    told = capsys.readouterr().out
    assert "\n1 point, none run anew; " in told
    assert "in every bit of 1 point, 2000 clocks" in told
    monkeypatch.setattr("tachometry.sim.studies.lockstep.compare", lambda *_: (3, []))
    assert run(*line, *scheduler, "--seed", "1") == 1
    assert "FAIL: hardware and golden model differ in 6 values" in capsys.readouterr().out


def test_a_scheduler_that_says_nothing(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tachometry.sim.studies.sweeping.cluster._PATIENCE", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        assert run(*CORE, *MOTION, *AXES, "--scheduler", address) == 2
    assert capsys.readouterr().err == (
        f"tachometry: error: --scheduler {address} does not answer: nothing within 0.2 s\n"
    )
    for address in ("tcp://127.0.0.1:1", "here"):  # where nobody is
        assert run(*CORE, *MOTION, *AXES, "--scheduler", address) == 2
        assert f"--scheduler {address} does not answer: " in capsys.readouterr().err


def test_an_interrupt_before_there_is_a_row(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tachometry.sim.studies.sweeping.cluster.cluster", interrupted)
    assert run(*CORE, *MOTION, *AXES, "--results", tmp_path / "r.parquet") == 130
    assert capsys.readouterr().err == "tachometry: interrupted after 0 of 8 points\n"
    assert list(tmp_path.iterdir()) == []


def test_what_fails_on_the_way_is_told_and_the_rest_is_kept(
    scheduler: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = [*CORE, *MOTION, "--methods", "m", *scheduler, "--results", tmp_path / "r.parquet"]
    assert run(*line, "--vary", "speed=1e12rad/s,5rad/s,1e13rad/s") == 2
    err = capsys.readouterr().err
    assert err.startswith("tachometry: error: --motion must be of at most 10000000 encoder edges")
    assert re.search(r" \(method m, motion constant:1e1[23]rad/s:100ms\); 2 of 3 points could not be run\n$", err)
    assert [row["speed"] for row in rows(tmp_path / "r.parquet")] == [5]


def test_workers_of_another_version(
    scheduler: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    here = threading.current_thread()
    monkeypatch.setattr(sweep, "code_digest", lambda **_: str(threading.current_thread() is here))
    assert run(*CORE, *MOTION, *AXES, *scheduler) == 2
    err = capsys.readouterr().err
    assert err.startswith("tachometry: error: workers must have the same version of tachometry as this machine: ")
    assert err.count("\n") == 1


def test_a_scheduler_that_goes_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    local = LocalCluster(n_workers=1, processes=False, protocol="tcp", dashboard_address="127.0.0.1:0")
    add = results.Results.add
    ended = threading.Thread(target=local.close)

    def added(kept: results.Results, row: dict[str, Any]) -> None:
        add(kept, row)
        if ended.ident is None:
            ended.start()

    monkeypatch.setattr(results.Results, "add", added)
    line = [*CORE, *MOTION, "--methods", "s", "--vary", "speed=5rad/s..50rad/s:100", "--vary", "seed=1,2,3,4"]
    file = tmp_path / "r.parquet"
    assert run(*line, "--scheduler", local.scheduler_address, "--results", file) == 2
    ended.join()
    pattern = r"tachometry: error: lost the connection to the scheduler after (\d+) of 400 points, kept in "
    found = re.match(pattern, err := capsys.readouterr().err)
    assert found, err
    assert err.endswith(f"{file}: the same command goes on from there\n")
    assert err.count("\n") == 1
    assert 0 < len(rows(file)) == int(found[1]) < 400


@nightly  # the next file kills a sweep at a known point
def test_a_sweep_that_is_killed_and_goes_on_has_the_same_bytes(tmp_path: Path) -> None:
    """Two workers, killed five times after a random share of the points; a seed that fails is printed."""
    seed = random.randrange(2**32)
    print("seed", seed)
    rng = random.Random(seed)
    axes = ["--methods", "s", "--vary", "speed=5rad/s..50rad/s:500", "--vary", "seed=1,2"]
    line = ["sweep", *CORE, *MOTION, *axes, "--jobs", "2", "--results"]
    whole, parts = tmp_path / "whole.parquet", tmp_path / "parts.parquet"
    assert run(*line[1:], whole) == 0
    for most in range(1, 6):
        with subprocess.Popen([sys.executable, "-m", "tachometry", *line, parts], stdout=subprocess.DEVNULL) as sweep:
            journal, least = tmp_path / ".parts.parquet.new", rng.uniform(0, 80_000)
            while sweep.poll() is None and not (journal.exists() and journal.stat().st_size > least):
                time.sleep(0.01)
            sweep.kill()
        assert sweep.returncode in (0, -signal.SIGKILL), most
    assert run(*line[1:], parts) == 0
    assert parts.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize("name", ["distributed", "pyarrow"])
def test_the_extra_is_needed(name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, name, None)
    assert run(*CORE, *MOTION, *AXES) == 2
    assert capsys.readouterr().err == (
        f"tachometry: error: a sweep needs the extra `sweep`: {name} is not installed: "
        "pip install 'tachometry[sweep]'\n"
    )
