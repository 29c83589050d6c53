"""`tachometry simulate`."""

import csv
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import run, without
from support.nightly import only_rows

from tachometry.sim import golden
from tachometry.sim.captures.read import read_capture
from tachometry.sim.encoder.imperfections import Bounce
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.run import Run
from tachometry.spec import Encoder, STachometer, Timing

CORE = "--ppr 100 --clock 20kHz --tick 1ms --max-time 10ms".split()
FEW_CLOCKS = ("--engine", "pysim")  # fewer than a core is worth compiling for
MOTION = ["--motion", "ramp:0:20rad/s:200ms+stop:50ms+constant:-15rad/s:100ms"]
OUTPUTS = {"--vcd": "v.vcd", "--plot": "p.png", "--trace": "t.csv", "--counts": "c.csv", "--save-capture": "s.sr"}
COMMAND = [sys.executable, "-c", "from tachometry.cli.main import main; main()"]
SPEC = STachometer(encoder=Encoder(100), timing=Timing(20_000, 20, 10))


def all_outputs(folder: Path) -> list[str]:
    return [word for option, name in OUTPUTS.items() for word in (option, str(folder / name))]


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def summary(text: str) -> dict[str, str]:
    """Return value of each row of the table."""
    rows = (line.strip().split("  ", 1) for line in text.splitlines() if "  " in line.strip())
    return {name: value.strip() for name, value in rows}


@pytest.fixture(scope="module")
def golden_run() -> Run:
    trace = VirtualEncoder(100).record(parse_motion(MOTION[1])).recording.place(20_000)
    return golden.run(SPEC, trace)


def test_all_outputs_and_the_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str], golden_run: Run) -> None:
    assert run("simulate", *CORE, *MOTION, *all_outputs(tmp_path / "new")) == 0
    assert set(contents(tmp_path / "new")) == {*OUTPUTS.values(), "v.gtkw"}
    captured = capsys.readouterr()
    assert captured.err == ""  # no terminal, no bar
    table = summary(captured.out)
    n_updates, n_forced = len(golden_run.updates.clock), int(np.count_nonzero(golden_run.updates.forced))
    assert table["simulated"] == "7000 clocks (350ms), 349 ticks"
    assert table["updates"] == f"{n_updates} ({n_forced} of them forced)"
    assert table["mismatches"] == "0"
    # 2 rad forwards, 1.5 rad backwards but for the last tick and latency, 400 counts a turn
    assert table["counts in"] == table["counts out"] == str(golden_run.ticks.position[-1])
    assert 30 <= int(table["counts in"]) <= 34
    assert table["errors flagged"] == "0 (the encoder made 0 illegal transitions)"
    assert captured.out.splitlines()[-1].startswith("PASS: ")


def test_trace_has_a_row_per_update(tmp_path: Path, golden_run: Run) -> None:
    assert run("simulate", *CORE, *MOTION, "--trace", tmp_path / "t.csv") == 0
    with (tmp_path / "t.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["clock", "tick", "interval", "forced", "velocity_raw", "velocity_rad_s"]
    updates = golden_run.updates
    assert [list(map(int, row[:5])) for row in rows[1:]] == [
        [clock, (clock - SPEC.latency.tick_to_velocity - SPEC.latency.tick + 1) // 20 - 1, m_s, forced, raw]
        for clock, m_s, forced, raw in zip(
            updates.clock.tolist(),
            updates.interval.tolist(),
            updates.forced.tolist(),
            updates.velocity.tolist(),
            strict=True,
        )
    ]
    assert [row[5] for row in rows[1:]] == [
        repr(raw * SPEC.velocity.rad_per_s_per_lsb) for raw in updates.velocity.tolist()
    ]


def test_counts_have_a_row_per_tick(tmp_path: Path, golden_run: Run) -> None:
    assert run("simulate", *CORE, *MOTION, "--counts", tmp_path / "c.csv") == 0
    text = (tmp_path / "c.csv").read_bytes().decode()
    ticks = golden_run.ticks
    rows = zip(ticks.pulse_count.tolist(), ticks.position.tolist(), ticks.standstill.astype(int).tolist(), strict=True)
    wanted = "".join(f"{i},{m_e},{x},0,{rests}\n" for i, (m_e, x, rests) in enumerate(rows))
    assert text == f"tick,pulse_count,position,overflow,standstill\n{wanted}"


def test_events_have_a_row_each(tmp_path: Path) -> None:
    options = "--motion constant:40rad/s:400ms --illegal 0.05 --seed 3 --index".split()
    assert run("simulate", *CORE, *options, "--events", tmp_path / "e.csv") == 0
    with (tmp_path / "e.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["clock", "event", "index_position"]
    assert {row[1] for row in rows[1:]} == {"decode_error", "index_valid"}
    assert all((row[2] == "") == (row[1] == "decode_error") for row in rows[1:])
    assert [int(row[0]) for row in rows[1:]] == sorted(int(row[0]) for row in rows[1:])


def test_error_statistics(capsys: pytest.CaptureFixture[str]) -> None:
    # 0.5 counts a tick for ever: after the first update, of which one tick was at rest, every estimate is exact.
    assert run("simulate", *CORE, "--motion", "constant:1.25rev/s:100ms") == 0
    table = summary(capsys.readouterr().out)
    assert table["counts in"] == table["counts out"]
    unit = SPEC.scale.unit_velocity
    assert float(table["velocity error, max"].split()[0]) <= unit
    assert abs(float(table["velocity error, mean"].split()[0])) < 0.1 * unit
    assert float(table["velocity error, RMS"].split()[0]) < 0.2 * unit


def test_no_update_no_error_statistics(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("simulate", *CORE, "--motion", "stop:3ms") == 0
    assert summary(capsys.readouterr().out)["velocity error"] == "unknown: there was no update"


def test_counts_that_are_lost_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    options = "--motion constant:20rad/s:200ms --illegal 0.05 --seed 3".split()
    assert run("simulate", *CORE, *options) == 0
    table = summary(capsys.readouterr().out)
    out, lost = table["counts out"].split()
    assert int(out) - int(table["counts in"]) == int(lost.strip("()")) < 0
    flagged = int(table["errors flagged"].split()[0])
    assert flagged > 0
    assert int(lost.strip("()")) == -2 * flagged
    assert table["errors flagged"] == f"{flagged} (the encoder made {flagged} illegal transitions)"


def test_pulses_that_are_missed_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    options = "--motion constant:20rad/s:200ms --lost 0.05 --seed 3".split()
    assert run("simulate", *CORE, *options) == 0
    table = summary(capsys.readouterr().out)
    edges, missed = table["edges lost"].split(" ", 1)
    out, lost = table["counts out"].split()
    assert int(out) - int(table["counts in"]) == int(lost.strip("()")) == -2 * int(edges) < 0  # 4 counts a pulse
    assert missed == f"(pulses that the encoder missed: {int(edges) // 2})"
    assert table["errors flagged"] == "0 (the encoder made 0 illegal transitions)"


def test_every_imperfection_reaches_the_pins_and_so_does_the_index(tmp_path: Path) -> None:
    options = (
        "--phase-error 20 --duty-error -30 --nonuniformity 0.1 --jitter 0.05 --bounce 2:100us --lost 0.05 "
        "--illegal 0.02 --seed 5 --index"
    )
    assert run("simulate", *CORE, *MOTION, *options.split(), "--save-capture", tmp_path / "s.sr") == 0
    encoder = VirtualEncoder(
        100,
        phase_error_deg=20,
        duty_error_deg=-30,
        nonuniformity=0.1,
        jitter=0.05,
        bounce=Bounce(2, 100e-6),
        lost=0.05,
        illegal=0.02,
        seed=5,
        index=True,
    )
    wanted = encoder.record(parse_motion(MOTION[1])).recording.place(20_000)
    seen = read_capture(tmp_path / "s.sr", z="Z").place(20_000)
    assert np.array_equal(seen.clock, wanted.clock)
    assert np.array_equal(seen.level, wanted.level)
    assert np.any(wanted.level == 7)


def test_overflow_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("simulate", *CORE, "--motion", "constant:100rad/s:20ms", "--max-speed", "50rad/s", *FEW_CLOCKS) == 0
    assert "faster than --max-speed" in summary(capsys.readouterr().out)["overflow"]


def test_equal_options_give_equal_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["simulate", *CORE, "--motion", "ramp:0:20rad/s:100ms", "--jitter", "0.1", "--vibration", "1mrad:50Hz"]
    for name in ("one", "two"):
        assert run(*options, *all_outputs(tmp_path / name)) == 0
    out = capsys.readouterr().out
    assert out[: len(out) // 2] == out[len(out) // 2 :]
    done = subprocess.run(
        [*COMMAND, *options, *all_outputs(tmp_path / "three")],
        env={**os.environ, "PYTHONHASHSEED": "7", "TZ": "Asia/Tokyo", "LC_ALL": "C"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == out[: len(out) // 2]
    assert contents(tmp_path / "one") == contents(tmp_path / "two") == contents(tmp_path / "three")


def test_a_mismatch_fails_but_leaves_the_outputs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    honest = golden.run

    def wrong(spec: Any, trace: Any) -> Run:
        right = honest(spec, trace)
        velocity = right.updates.velocity.copy()
        velocity[3] += 1
        return replace(right, tables=right.tables | {"velocity_valid": right.updates.having(velocity=velocity)})

    monkeypatch.setattr(golden, "run", wrong)
    assert run("simulate", *CORE, *MOTION, *all_outputs(tmp_path)) == 1
    captured = capsys.readouterr()
    assert summary(captured.out)["mismatches"] == "1"
    assert "first mismatch in velocity_valid.velocity[3]: expected" in captured.out
    assert captured.out.splitlines()[-1] == "FAIL: hardware and golden model differ in 1 values"
    assert len(contents(tmp_path)) == 6


def test_ctrl_c_in_the_simulation(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    honest = PySim.run

    def interrupted(*args: Any, **options: Any) -> Run:
        honest(*args, **options)  # the waveform is written
        raise KeyboardInterrupt

    (tmp_path / "t.csv").write_text("before")
    monkeypatch.setattr(PySim, "run", interrupted)
    others = without(all_outputs(tmp_path / "new"), ["--trace"])
    options = [*others, "--trace", str(tmp_path / "t.csv"), "--engine", "pysim"]
    assert run("simulate", *CORE, *MOTION, *options) == 130
    assert capsys.readouterr() == ("", "tachometry: interrupted\n")
    assert contents(tmp_path) == {"t.csv": b"before"}


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
@pytest.mark.parametrize(
    ("engine", "end"),
    # One engine and one signal show what is kept; how each engine ends is in tests/sim/engines.
    only_rows(
        [("cxxrtl", signal.SIGHUP)],
        [(e, s) for e in ("pysim", "cxxrtl") for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)],
    ),
)
def test_ctrl_c_from_a_terminal_keeps_what_was_simulated(engine: str, end: signal.Signals, tmp_path: Path) -> None:
    options = [*CORE, "--motion", "constant:20rad/s:1000s", "--engine", engine, *all_outputs(tmp_path / "new")]
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / "t.csv").write_text("whole")
    process = subprocess.Popen(
        [*COMMAND, "simulate", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    while process.poll() is None and not any(
        file.stat().st_size > 200_000 for file in tmp_path.glob("new/.tachometry-*/new/v.vcd")
    ):
        time.sleep(0.01)
    process.send_signal(end)
    out, err = process.communicate(timeout=600)
    assert process.returncode == 130, err
    # A loaded machine tells what it does after ten seconds, too.
    told = re.search(r"^tachometry: interrupted after (\d+) of 20000000 clocks, kept in (.*)\n\Z", err, re.MULTILINE)
    assert told is not None, err
    assert summary(out)["simulated"].startswith(f"{told[1]} clocks")
    assert "PASS" not in out
    assert "INTERRUPTED: hardware and golden model agree in every bit of" in out
    kept = {name.replace(".", ".part.") for name in OUTPUTS.values()}
    assert {*told[2].split(", ")} == {f"{tmp_path}/new/{name}" for name in kept}
    assert set(contents(tmp_path / "new")) == {*kept, "t.csv"}
    assert (tmp_path / "new" / "t.csv").read_text() == "whole"


def test_the_glitch_filter_tells_what_it_swallowed(capsys: pytest.CaptureFixture[str]) -> None:
    # Each line changes every 21 clocks or so; some levels hold for less than 18.
    assert run("simulate", *CORE, *"--motion constant:30rad/s:200ms --jitter 0.3 --filter 18".split(), *FEW_CLOCKS) == 0
    rows = summary(capsys.readouterr().out)
    assert int(rows["edges filtered"].split()[0]) > 0
    assert rows["mismatches"] == "0"


def test_what_probes_have_latched_is_told_and_where_records_are(capsys: pytest.CaptureFixture[str]) -> None:
    probes = ["--method", "s", "--stream", "axi", "--probe", "2", "--pulse", "probe_1:200ms"]
    motion = ["--motion", "constant:15rpm:300ms"]
    assert run("simulate", *CORE, *motion, *FEW_CLOCKS, *probes) == 0
    rows = summary(capsys.readouterr().out)
    assert rows["probes"] == "latched 1 time, the last that of probe 1 at position 20"
    assert rows["stream"].endswith("with stream.dtype of the manifest")
    assert run("simulate", *CORE, *motion, *FEW_CLOCKS, *probes[:-2]) == 0
    assert summary(capsys.readouterr().out)["probes"].startswith("latched 0 times: --pulse probe_0:20ms ")


def test_waveform_has_the_clock_and_curves_of_both_speeds(tmp_path: Path) -> None:
    core = "--method s --ppr 500 --clock 1MHz --tick 100us --max-speed 400rad/s --engine pysim".split()
    motion = f"--motion ramp:0:100rad/s:8ms --vcd {tmp_path / 'w.vcd'} --vcd-from 5ms --vcd-to 6ms".split()
    assert run("simulate", *core, *motion, "--trace", tmp_path / "t.csv") == 0
    text = (tmp_path / "w.vcd").read_text()
    times = [int(time) for time in re.findall(r"^#(\d+)$", text, re.MULTILINE)]
    assert times == sorted(set(times))
    assert text.count("\n1clk\n") == text.count("\n0clk\n") == 1000
    measured, true = (
        [(int(time), float(value)) for time, value in changes(text, f"{name}_rad_s")] for name in ("measured", "true")
    )
    assert [time for time, _ in measured] == [time for time, _ in true]
    assert len(measured) == 11  # what held before, and ten ticks
    assert all(value == pytest.approx(100 * time / 8e9, abs=1.3) for time, value in true)
    with (tmp_path / "t.csv").open() as file:
        shown = {float(row["velocity_rad_s"]) for row in csv.DictReader(file)}
    assert all(any(value == pytest.approx(one, rel=1e-6) for one in shown) for _, value in measured)
    assert "tachometer.true_rad_s" in (tmp_path / "w.gtkw").read_text()


def changes(text: str, name: str) -> Iterator[tuple[str, str]]:
    """Yield times and values of a real signal of a waveform."""
    for part in text.split("\n#")[1:]:
        for value in re.findall(rf"^r(\S+) {name}$", part, re.MULTILINE):
            yield part.split("\n")[0], value
