"""The index line Z: in recordings and traces, and in captures of every kind."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.lines import PITCH, PPR, decode, record

from tachometry.cli.main import main
from tachometry.sim.captures.file import CaptureError
from tachometry.sim.captures.read import read_capture
from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.captures.text import write_csv
from tachometry.sim.encoder.imperfections import Bounce
from tachometry.sim.signals.recording import PinTrace, Recording


def line(*levels: int) -> np.ndarray:
    return np.array(levels, np.uint8)


def rows(of: Recording | PinTrace) -> list[tuple[int, ...]]:
    assert of.z is not None
    return list(zip(of.a.tolist(), of.b.tolist(), of.z.tolist(), strict=True))


RECORDING = Recording(
    np.array([0, 1.2e-6, 2.1e-6, 2.7e-6, 4e-6, 5e-6, 5.5e-6]),
    line(0, 0, 0, 1, 1, 1, 1),
    line(1, 0, 0, 0, 0, 0, 1),
    10e-6,
    line(0, 1, 1, 1, 0, 1, 1),
)
TRACE = RECORDING.place(1_000_000)


def test_a_row_of_a_trace_changes_any_line() -> None:
    assert TRACE.clock.tolist() == [0, 2, 3, 4, 5, 6]
    assert rows(TRACE) == [(0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0), (1, 0, 1), (1, 1, 1)]
    assert RECORDING.level.tolist() == [2, 4, 4, 5, 1, 5, 7]
    assert TRACE.level.tolist() == [2, 4, 5, 1, 5, 7]


def test_without_an_index_there_is_none() -> None:
    bare = Recording(RECORDING.time, RECORDING.a, RECORDING.b, 10e-6)
    trace = bare.place(1_000_000)
    assert bare.z is None
    assert trace.z is None
    assert trace.clock.tolist() == [0, 2, 3, 6]


def test_lines_are_of_one_length() -> None:
    with pytest.raises(ValueError, match=r"^a recording must have as many times as levels, and at least one row$"):
        Recording(np.zeros(1), line(0), line(0), 1.0, line(0, 1))
    with pytest.raises(ValueError, match=r"^a pin trace must have as many clocks as levels, and at least one row$"):
        PinTrace(np.zeros(1, np.int64), line(0), line(0), 1, line())


def write_vcd(path: Path) -> None:
    head = "$timescale 1 us $end\n" + "".join(f"$var wire 1 {name} {name} $end\n" for name in "abz")
    changes = zip(TRACE.clock.tolist(), rows(TRACE), strict=True)
    body = "".join(f"#{clock}\n{a}a\n{b}b\n{z}z\n" for clock, (a, b, z) in changes)
    path.write_text(f"{head}$enddefinitions $end\n{body}#10\n")


WRITERS: dict[str, Callable[[Path], None]] = {
    "x.sr": lambda path: write_sr(path, TRACE, 1_000_000),
    "x.csv": lambda path: write_csv(path, RECORDING),
    "x.vcd": write_vcd,
}


@pytest.mark.parametrize("name", WRITERS)
def test_captures_keep_the_index(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    WRITERS[name](path)
    for channel in ("z", 2, "2"):
        trace = read_capture(path, z=channel).place(1_000_000)
        assert trace.clock.tolist() == TRACE.clock.tolist()
        assert rows(trace) == rows(TRACE)
        assert trace.n_clocks == 10
    assert read_capture(path).z is None
    swapped = read_capture(path, a="z", b="b", z="a")
    assert swapped.z is not None
    assert swapped.z[-2:].tolist() == [1, 1]
    for wrong, message in (("a", "channels a and z of .* must be two of .*, not both a"), ("q", "channel z of .*'q'")):
        with pytest.raises(CaptureError, match=f"(?i)^{message}$"):
            read_capture(path, z=wrong)


def test_levels_of_the_index_are_checked(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("time,a,b,z\n0,0,0,2\n")
    with pytest.raises(CaptureError, match=r"line 2: level of z must be 0 or 1, not '2' "):
        read_capture(tmp_path / "x.csv", z="z")


def test_replay_takes_the_index_along(tmp_path: Path) -> None:
    recording = Recording(RECORDING.time, RECORDING.a, RECORDING.b, 100e-6, RECORDING.z)
    write_csv(tmp_path / "x.csv", recording)
    core = "--ppr 100 --clock 1MHz --tick 8us --max-time 80us --z z --save-capture".split()
    with pytest.raises(SystemExit) as stop:
        main(["replay", str(tmp_path / "x.csv"), *core, str(tmp_path / "y.sr")])
    assert stop.value.code == 0
    assert rows(read_capture(tmp_path / "y.sr", z="Z").place(1_000_000)) == rows(TRACE)


@pytest.mark.parametrize("direction", [1, -1])
def test_the_index_is_the_third_quarter_of_a_turn(direction: int) -> None:
    recording = record(f"constant:{direction}rev/s:3s", start_angle_rad=-10.5 * PITCH, index=True).recording
    assert recording.z is not None
    time, change = recording.time[1:], np.diff(recording.z.astype(int))
    ends = -10.5 + direction * np.stack([time[change > 0], time[change < 0]]) * 4 * PPR  # in pitches
    np.testing.assert_allclose(ends[0] % (4 * PPR), 2 if direction > 0 else 3, atol=1e-6)
    np.testing.assert_allclose(ends[1] - ends[0], direction, atol=1e-6)
    assert ends.shape == (2, 3)
    assert set(np.unique(recording.level)) == {0, 1, 2, 3, 7}
    assert decode(recording, 4)[1] == 0


def test_a_shaft_at_rest_on_the_index_shows_it() -> None:
    assert rows(record("stop:1s", index=True, start_angle_rad=2.5 * PITCH).recording) == [(1, 1, 1)]
    assert rows(record("stop:1s", index=True, start_angle_rad=4.5 * PITCH).recording) == [(0, 0, 0)]


@pytest.mark.parametrize("seed", range(12))
def test_the_index_is_gated_and_leaves_the_lines_alone(seed: int) -> None:
    faults: dict[str, object] = {
        "jitter": 0.3,
        "phase_error_deg": 20.0,
        "duty_error_deg": -40.0,
        "bounce": Bounce(2, 1e-4) if seed % 2 else None,
        "illegal": (0, 0.2, 0.9)[seed % 3],
        "lost": (0, 0.3)[seed % 4 // 2],
        "pulses_per_rev": 2,
        "seed": seed,
    }
    bare, indexed = (
        record("ramp:-200rad/s:300rad/s:300ms", index=index, **faults).recording for index in (False, True)
    )
    lines = indexed.level & 3
    kept = np.append(True, lines[1:] != lines[:-1])
    assert np.array_equal(indexed.time[kept], bare.time)
    assert np.array_equal(lines[kept], bare.level)
    assert indexed.z is not None
    assert np.all(lines[indexed.z == 1] == 3)
    assert np.count_nonzero(np.diff(indexed.z)) >= (10, 2, 0)[seed % 3]
