"""Tooth wheels and step/dir, through a core: every pulse and every step in its tick."""

from pathlib import Path

import numpy as np
import pytest
from support.command import run

from tachometry.sim import golden
from tachometry.sim.captures import other_sensors
from tachometry.sim.signals.recording import PinTrace, Recording
from tachometry.spec import of_texts

CLOCK_HZ, TICK = 100_000, 100


def edges(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return times with at least 20 clocks between them, in seconds, the first not at 0."""
    return np.cumsum(rng.integers(20, 400, n)) / CLOCK_HZ


def counts(recording: Recording, sensor: str, decoding: int) -> tuple[np.ndarray, np.ndarray]:
    """Return counts of each tick, and the clocks at which the tick ended."""
    spec = of_texts(
        "s", {"ppr": "36", "clock": "100kHz", "tick": f"{TICK}clk", "max-time": "5000clk", "decoding": str(decoding)}
    )
    ticks = golden.run(spec, PinTrace.of(other_sensors.converted(recording, sensor, spec), spec)).ticks
    return ticks.pulse_count, ticks.clock - spec.latency.tick - spec.latency.pin_to_count


def in_ticks(times: np.ndarray, steps: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return sums of steps up to each end, from the times alone."""
    seen = np.ceil(times * CLOCK_HZ - 1e-6)
    return np.diff([steps[seen <= end].sum() for end in ends], prepend=0)


@pytest.mark.parametrize("late", [1, 4, 19])
@pytest.mark.parametrize("decoding", [1, 2])
def test_a_line_and_itself_some_clocks_later_count_the_same(decoding: int, late: int) -> None:
    times = edges(np.random.default_rng(3), 400)
    every = np.concatenate([[0.0], np.sort(np.concatenate([times, times + late / CLOCK_HZ]))])
    a, b = (
        np.searchsorted(of, every + 0.1 / CLOCK_HZ).astype(np.uint8) & np.uint8(1)
        for of in (times, times + late / CLOCK_HZ)
    )
    recording = Recording(every, a, b, float(every[-1]) + 0.1)
    found, ends = counts(recording, "quadrature", decoding)
    counted = times if decoding == 2 else times[::2]
    assert found.tolist() == in_ticks(counted, np.ones(len(counted), int), ends).tolist()
    tied, _ = counts(Recording(every, a, 0 * b, recording.duration), "quadrature", decoding)
    assert set(np.cumsum(tied).tolist()) == {0, 1}


@pytest.mark.parametrize("start", [0, 1])
@pytest.mark.parametrize("decoding", [1, 2])
def test_every_pulse_is_a_count_forward(decoding: int, start: int) -> None:
    times = edges(np.random.default_rng(1 + start), 400)
    level = ((np.arange(401) + start) & 1).astype(np.uint8)
    recording = Recording(np.append(0, times), level, level, times[-1] + 0.01)
    got, ends = counts(recording, "pulses", decoding)
    counted = np.ones(400) if decoding == 2 else level[1:].astype(float)
    assert got.tolist() == in_ticks(times, counted, ends).tolist()
    assert got.sum() == counted.sum()


def steps() -> tuple[Recording, np.ndarray, np.ndarray]:
    """Return pulses on the step line, with a direction that changes between them; the times and signs of the steps."""
    rng = np.random.default_rng(3)
    times = edges(rng, 900).reshape(300, 3)  # the direction, the rise, the fall
    forward = rng.integers(0, 2, 300)
    level_a = np.tile([0, 1, 0], 300)
    level_b = np.repeat(forward, 3)
    time = np.append(0, times.ravel())
    a, b = (np.append(0, line).astype(np.uint8) for line in (level_a, level_b))
    return Recording(time, a, b, time[-1] + 0.01), times[:, 1], 2 * forward - 1


def test_every_step_is_a_count_in_its_direction() -> None:
    recording, times, signs = steps()
    got, ends = counts(recording, "step-dir", 4)
    assert got.tolist() == in_ticks(times, signs, ends).tolist()


def test_other_lines_stay_where_they_are() -> None:
    time = np.array([0, 0.001, 0.002, 0.003, 0.004])
    a, z = np.array([[0, 1, 1, 0, 1], [0, 0, 1, 1, 0]], dtype=np.uint8)
    found = other_sensors.of_pulses(Recording(time, a, a, 0.005, z=z), 2)
    assert found.z is not None
    changes = np.flatnonzero(np.diff(found.z)) + 1
    assert found.time[changes].tolist() == [0.002, 0.004]


def test_a_text_with_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [f"{k / 1000},{k & 1}" for k in range(101)]
    (tmp_path / "wheel.csv").write_text("\n".join(["Time [s],crank", *rows, ""]))
    core = "--method s --ppr 18 --clock 100kHz --tick 1ms --max-time 100ms --sensor pulses".split()
    assert run("replay", tmp_path / "wheel.csv", *core, "--decoding", "2") == 0
    assert "counts out 100" in [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]


def test_teeth_that_are_two_rows_at_one_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As loggers of engines write them: 240 teeth, in slots of which two are empty twice."""
    slots = [slot for slot in range(244) if slot not in (100, 101, 200, 201)]
    rows = [f"{level},{100 + 0.97 * slot:.3f}\n" for slot in slots for level in (1, 0)]
    (tmp_path / "teeth.csv").write_text("PriLevel,Time [ms]\n" + "".join(rows))
    core = "--method s --ppr 44 --clock 1MHz --tick 100us --max-time 20ms --sensor pulses --a PriLevel".split()
    assert run("replay", tmp_path / "teeth.csv", *core, "--decoding", "1") == 0
    out = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert {"counts out 240", "errors flagged 0"} <= {*out}
    assert run("replay", tmp_path / "teeth.csv", *core, "--decoding", "2") == 2
    assert "--decoding must be 1, which counts rises alone, for pulses of no width (" in capsys.readouterr().err


def test_short_pulses_raise_no_errors(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [f"{k + width},{level}\n" for k in range(100) for width, level in ((0, 0), (0.4, 1), (0.4002, 0))]
    (tmp_path / "c.csv").write_text("Time [ms],A\n" + "".join(rows))
    core = "--method s --ppr 18 --clock 100kHz --tick 1ms --max-time 100ms --sensor pulses --decoding 1".split()
    assert run("replay", tmp_path / "c.csv", *core) == 0
    out = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert {"counts out 100", "errors flagged 0"} <= {*out}


@pytest.mark.parametrize(
    ("rows", "options"),
    [
        ("0,0,0\n1,1,0\n1,0,0\n1,1,0\n2,0,0\n", "--sensor pulses --decoding 1"),
        ("0,0,1\n1,1,1\n1,0,1\n1,1,1\n2,0,1\n", "--sensor step-dir"),
    ],
)
def test_two_pulses_at_one_time(rows: str, options: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "c.csv").write_text("time,A,B\n" + rows)
    assert run("replay", tmp_path / "c.csv", "--ppr", "18", *options.split()) == 2
    message = "two pulses of a capture must not come at one time, as 1 do here, the first at 1 s"
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--sensor pulses", "--decoding must be 1 or 2 for pulses, not 4"),
        ("--sensor step-dir --decoding 1", "--decoding must be 4 for step-dir, not 1"),
        ("--sensor pulses --decoding 2 --b B", "--b must not be given together with --sensor pulses"),
        ("--sensor pulses --decoding 2 --a C", "must be one of A (0), B (1), not 'C'"),
    ],
)
def test_what_cannot_be(options: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "c.csv").write_text("time,A,B\n0,0,0\n1,1,0\n")
    assert run("replay", tmp_path / "c.csv", "--ppr", "18", *options.split()) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
