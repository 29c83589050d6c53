"""Captures of tooth wheels, step/dir and halls, through a core: every pulse and every step in its tick."""

from pathlib import Path

import numpy as np
import pytest
from support.command import run

from tachometry.sim import golden
from tachometry.sim.captures.other_sensors import fitted
from tachometry.sim.signals.recording import PinTrace, Recording
from tachometry.spec import of_texts

CLOCK_HZ, TICK = 100_000, 100


def edges(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return times with at least 20 clocks between them, in seconds, the first not at 0."""
    return np.cumsum(rng.integers(20, 400, n)) / CLOCK_HZ


def counts(recording: Recording, **texts: str) -> tuple[np.ndarray, np.ndarray]:
    """Return counts of each tick, and the clocks at which the tick ended."""
    core = {"ppr": "36", "clock": "100kHz", "tick": f"{TICK}clk", "max-time": "5000clk"}
    spec = of_texts("s", core | texts)
    ticks = golden.run(spec, PinTrace.of(fitted(recording, spec.encoder), spec)).ticks
    return ticks.pulse_count, ticks.clock - spec.latency.tick - spec.latency.pin_to_count


def in_ticks(times: np.ndarray, steps: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return sums of steps up to each end, from the times alone."""
    seen = np.ceil(times * CLOCK_HZ - 1e-6)
    return np.diff([steps[seen <= end].sum() for end in ends], prepend=0)


@pytest.mark.parametrize("start", [0, 1])
@pytest.mark.parametrize("decoding", [1, 2])
@pytest.mark.parametrize("sign", [1, -1])
def test_every_pulse_is_a_count_forward(decoding: int, start: int, sign: int) -> None:
    times = edges(np.random.default_rng(1 + start), 400)
    level = ((np.arange(401) + start) & 1).astype(np.uint8)
    recording = Recording(np.append(0, times), level, level, times[-1] + 0.01)
    reverse = ("no", "yes")[sign < 0]
    got, ends = counts(recording, sensor="pulses", decoding=str(decoding), reverse=reverse)
    counted = sign * (np.ones(400) if decoding == 2 else level[1:].astype(float))
    assert got.tolist() == in_ticks(times, counted, ends).tolist()
    assert got.sum() == counted.sum()


def test_every_step_is_a_count_in_its_direction() -> None:
    """Pulses on the step line, with a direction that changes between them."""
    rng = np.random.default_rng(3)
    times = edges(rng, 900).reshape(300, 3)  # the direction, the rise, the fall
    forward = rng.integers(0, 2, 300)
    a, b = (np.append(0, line).astype(np.uint8) for line in (np.tile([0, 1, 0], 300), np.repeat(forward, 3)))
    time = np.append(0, times.ravel())
    got, ends = counts(Recording(time, a, b, time[-1] + 0.01), sensor="step-dir")
    assert got.tolist() == in_ticks(times[:, 1], 2 * forward - 1, ends).tolist()


def test_a_pulse_of_no_width_lasts_until_halfway_to_the_next_row() -> None:
    time = np.array([0, 0.001, 0.001, 0.002, 0.003, 0.003])
    a, z = np.array([[0, 1, 0, 0, 1, 0], [0, 0, 0, 1, 1, 1]], dtype=np.uint8)
    spec = of_texts("s", {"ppr": "4", "sensor": "pulses", "decoding": "1"})
    found = fitted(Recording(time, a, a, 0.005, z=z), spec.encoder)
    assert found.z is not None
    assert found.time.tolist() == [0, 0.001, 0.0015, 0.002, 0.003]
    assert found.a.tolist() == [0, 1, 0, 0, 1]  # the last one stays
    assert found.z.tolist() == [0, 0, 0, 1, 1]
    assert not found.b.any()


def said(capsys: pytest.CaptureFixture[str]) -> set[str]:
    return {" ".join(line.split()) for line in capsys.readouterr().out.splitlines()}


def test_a_text_with_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [f"{k / 1000},{k & 1}" for k in range(101)]
    (tmp_path / "wheel.csv").write_text("\n".join(["Time [s],crank", *rows, ""]))
    core = "--method s --ppr 18 --clock 100kHz --tick 1ms --max-time 100ms --sensor pulses --engine pysim".split()
    assert run("replay", tmp_path / "wheel.csv", *core) == 0
    assert "counts out 100" in said(capsys)


def test_teeth_that_are_two_rows_at_one_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As loggers of engines write them: 240 teeth, in slots of which two are empty twice."""
    slots = [slot for slot in range(244) if slot not in (100, 101, 200, 201)]
    rows = [f"{level},{100 + 0.97 * slot:.3f}\n" for slot in slots for level in (1, 0)]
    (tmp_path / "teeth.csv").write_text("PriLevel,Time [ms]\n" + "".join(rows))
    core = "--method s --ppr 44 --clock 1MHz --tick 100us --max-time 20ms --sensor pulses --a PriLevel".split()
    assert run("replay", tmp_path / "teeth.csv", *core, "--decoding", "1") == 0
    assert {"counts out 240", "errors flagged 0"} <= said(capsys)
    assert run("replay", tmp_path / "teeth.csv", *core, "--decoding", "2") == 2
    assert "--decoding must be 1, which counts rises alone, for pulses of no width (" in capsys.readouterr().err


def test_halls_of_a_capture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Ten periods, a connector that is pulled for a state, and the same state again."""
    cycle = ["1,0,1", "1,0,0", "1,1,0", "0,1,0", "0,1,1", "0,0,1"] * 10
    states = [*cycle, "1,0,1", "1,1,1", "1,0,1"]
    rows = [f"{k},{state}\n" for k, state in enumerate(states)]
    (tmp_path / "halls.csv").write_text("Time [ms],A,B,C\n" + "".join(rows))
    core = "--method s --pole-pairs 4 --clock 100kHz --tick 1ms --max-time 100ms --sensor hall --engine pysim".split()
    assert run("replay", tmp_path / "halls.csv", *core) == 0
    assert {"counts out 60", "errors flagged 1"} <= {line.partition(" (")[0] for line in said(capsys)}


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
        ("--sensor pulses --decoding 4", "--decoding must be 1 or 2 for pulses, not 4"),
        ("--sensor step-dir --decoding 4", "--decoding must be 1 or 2 for step-dir, not 4"),
        ("--sensor pulses --b B", "--b must not be given together with --sensor pulses"),
        ("--sensor pulses --a C", "must be one of A (0), B (1), not 'C'"),
        ("--sensor hall", "channel c of"),
        ("--c A", "--c must not be given together with --sensor quadrature"),
        ("--sensor hall --axes 2 --method s", "--sensor must be left out with --axes"),
    ],
)
def test_what_cannot_be(options: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "c.csv").write_text("time,A,B\n0,0,0\n1,1,0\n")
    assert run("replay", tmp_path / "c.csv", "--ppr", "18", *options.split()) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
