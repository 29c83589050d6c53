"""Waveforms as captures."""

import re
from pathlib import Path

import numpy as np
import pytest

from tachometry.sim.captures.file import CaptureError
from tachometry.sim.captures.read import read_capture
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.spec import Encoder, STachometer, Timing

HEAD = """$timescale 10 ns $end
$scope module top $end
$var wire 1 ! a $end
$var wire 1 " b $end
$var wire 8 # bus $end
$scope module deep $end
$var reg 1 % a $end
$upscope $end
$upscope $end
$enddefinitions $end
"""
BODY = '#0\n$dumpvars\nx!\nx"\n1%\n$end\n#5\n0!\n0"\n#7\n1!\n#9\nb1010 #\n1"\n#9\n#20\n0!\n1!\n#30\n'


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_two_variables_by_name_from_where_both_are_known(tmp_path: Path) -> None:
    recording = read_capture(write(tmp_path / "w.vcd", HEAD + BODY), "top.a", "top.b")
    assert recording.time.tolist() == [0, 20e-9, 40e-9]
    assert recording.a.tolist() == [0, 1, 1]
    assert recording.b.tolist() == [0, 0, 1]
    assert recording.duration == pytest.approx(250e-9)


def test_changes_in_the_form_of_vectors(tmp_path: Path) -> None:
    text = HEAD + BODY.replace("1!\n#9", "b1 !\n#9")
    assert text != HEAD + BODY
    vectors, scalars = (read_capture(write(tmp_path / "w.vcd", t), "top.a", "top.b") for t in (text, HEAD + BODY))
    assert np.array_equal(vectors.a, scalars.a)


def test_by_number(tmp_path: Path) -> None:
    swapped = read_capture(write(tmp_path / "w.vcd", HEAD + BODY), "1", "0")
    assert swapped.b.tolist() == [0, 1, 1]


@pytest.mark.parametrize("clock_hz", [48_000_000, 100_000, 33_333_333])
def test_the_waveform_of_a_simulation_replays_as_the_same_pins(tmp_path: Path, clock_hz: int) -> None:
    spec = STachometer(encoder=Encoder(500), timing=Timing(clock_hz, 8, 4))
    duration = 3000 / clock_hz
    speed = 0.1 * clock_hz / 2000
    encoder = VirtualEncoder(500, jitter=0.2, start_angle_rad=0.001)
    trace = encoder.record(parse_motion(f"constant:{speed}rev/s:{duration}s")).recording.place(clock_hz)
    PySim().run(spec, trace, vcd=tmp_path / "w.vcd")
    again = read_capture(tmp_path / "w.vcd").place(clock_hz)
    assert len(trace.clock) > 200
    for name in ("clock", "a", "b"):
        assert np.array_equal(getattr(again, name), getattr(trace, name)), name


@pytest.mark.parametrize(
    ("text", "channels", "message"),
    [
        (HEAD + BODY, ("top.c", "top.b"), "channel a of {path} must be one of top.a (0), top.b (1), top.deep.a (2), "),
        (HEAD + BODY, ("top.a", "top.a"), "channels a and b of {path} must be two of "),
        (HEAD + BODY, ("top.bus", "top.a"), "channel a of {path} must be one of "),
        (HEAD.replace("$timescale 10 ns $end", ""), ("0", "1"), "{path} must have a $timescale"),
        (HEAD[:60], ("0", "1"), "{path} must be a complete VCD file: "),
        ("", ("0", "1"), "{path} must be a complete VCD file: its declarations do not end"),
        (HEAD + BODY + "#40\nz!\n", ("0", "1"), "levels of {path} must be 0 or 1, not z1 at time 40"),
        (HEAD + "#0\n1!\n", ("0", "1"), "{path} must contain the levels of all lines, 0 or 1, at least once"),
        ("no waveform", ("0", "1"), "{path} must be a complete VCD file: "),
        (HEAD + BODY + "#40", ("0", "1"), "{path} must be a complete VCD file: its last line does not end"),
        (HEAD + BODY + "#40\n1", ("0", "1"), "{path} must be a complete VCD file: its last line does not end"),
        (HEAD + BODY + "#40\nb !\n", ("0", "1"), "{path} must be a complete VCD file: invalid literal"),
        (HEAD + BODY + "#40\nb10 !\n", ("0", "1"), "levels of {path} must be 0 or 1, not 21 at time 40"),
        (HEAD + BODY + "#40\nr0.5 !\n", ("0", "1"), "levels of {path} must be 0 or 1, not 0.51 at time 40"),
        (HEAD + BODY + f"#{'9' * 5000}\n", ("0", "1"), "{path} must be a complete VCD file: "),
    ],
)
def test_what_is_wrong_is_said_in_a_line(tmp_path: Path, text: str, channels: tuple[str, str], message: str) -> None:
    path = write(tmp_path / "w.vcd", text)
    with pytest.raises(CaptureError, match=f"^{re.escape(message.format(path=path))}.*$"):
        read_capture(path, *channels)


def test_no_samplerate(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="samplerate must not be given"):
        read_capture(write(tmp_path / "w.vcd", HEAD + BODY), samplerate_hz=1e6)


def test_time_that_runs_backwards(tmp_path: Path) -> None:
    path = write(tmp_path / "w.vcd", HEAD + BODY + "#1\n")
    with pytest.raises(CaptureError, match=r"w.vcd line \d+: time must be at least \d+, not 1$"):
        read_capture(path)
