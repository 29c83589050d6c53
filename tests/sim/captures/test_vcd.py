"""Waveforms as captures."""

import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from support.captures import assert_same

from tachometry.sim.captures import vcd, waveform
from tachometry.sim.captures.file import CaptureError, Channels
from tachometry.sim.captures.read import read_capture
from tachometry.sim.captures.waveform import Changes, Variable
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.engine import Watch
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.flow import Part
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
VECTOR = """$timescale 1 ns $end
$scope module tb $end
$var wire 2 ! enc [1:0] $end
$upscope $end
$enddefinitions $end
"""


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
    PySim().run(spec, trace, Watch(tmp_path / "w.vcd"))
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
        (HEAD[:60], ("0", "1"), "{path} must be a complete VCD file: "),
        ("no waveform", ("0", "1"), "{path} must be a complete VCD file: 'no' must be a declaration, such as $var"),
        (HEAD + BODY + "#40\nb10", ("0", "1"), "{path} must be a complete VCD file: 'b10' at time 40 must be a "),
        (HEAD + BODY + "#40\nb10 ", ("0", "1"), "{path} must be a complete VCD file: 'b10' at time 40 must be a "),
        (HEAD + BODY + "#40\n1?\n", ("0", "1"), "{path} must be a complete VCD file: '1?' at time 40 must be a "),
        (HEAD + BODY + "#40\n2!\n", ("0", "1"), "{path} must be a complete VCD file: '2!' at time 40 must be a "),
        (HEAD + BODY + "#", ("0", "1"), "{path} must be a complete VCD file: '#' must be # and a time"),
        (HEAD + BODY + "#4O\n", ("0", "1"), "{path} must be a complete VCD file: '#4O' must be # and a time"),
        (HEAD + BODY + "$dump", ("0", "1"), "{path} must be a complete VCD file: '$dump' does not end"),
        (HEAD + BODY + "#40\nb !\n", ("0", "1"), "top.a of {path} must be 1 bit of 0, 1, x or z, not '' at time 40"),
        (HEAD + BODY + "#40\nr0.5 !\n", ("0", "1"), "top.a of {path} must be 1 bit of 0, 1, x or z, not '0.5' at "),
        (HEAD + BODY, ("top.bus[8]", "top.a"), "bits of top.bus of {path} must be from 7 to 0, not 8"),
        (HEAD + BODY, ("bus[1]", "bus[1]"), "channels a and b of {path} must be two of top.a (0), top.b (1), "),
        (VECTOR, ("enc", "enc"), "{path} must have at least two logic channels, not tb.enc[bit]; lines in one number "),
        (HEAD.replace("10 ns", "20 ns"), ("0", "1"), "$timescale of {path} must be 1, 10 or 100 s, ms, us, ns, ps or "),
        (HEAD.replace("8 # bus", "8 # bus [3:0]"), ("0", "1"), "bus[3:0] of {path} must have as many bits as its "),
        (HEAD.replace("wire 8 # bus", "wire 8"), ("0", "1"), "{path} must be a complete VCD file: $var must have a "),
    ],
)
def test_what_is_wrong_is_said_in_a_line(tmp_path: Path, text: str, channels: tuple[str, str], message: str) -> None:
    path = write(tmp_path / "w.vcd", text)
    with pytest.raises(CaptureError, match=f"^{re.escape(message.format(path=path))}.*$"):
        read_capture(path, *channels)


def test_no_samplerate(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="samplerate must not be given"):
        read_capture(write(tmp_path / "w.vcd", HEAD + BODY), samplerate_hz=1e6)


@pytest.mark.parametrize(
    ("declared", "channel", "bit"),
    [
        ("[3:0]", "enc[0]", 0),
        ("[3:0]", "tb.enc[3]", 3),
        ("[0:3]", "enc[0]", 3),
        ("[7:4]", "enc[5]", 1),
        ("", "enc[2]", 2),
    ],
)
def test_a_bit_of_a_vector_is_that_of_its_declaration(declared: str, channel: str, bit: int, tmp_path: Path) -> None:
    values = ["0", "1", "101", "1000", "0110", "x", "1", "1x1", "zz10", "00001111", "0"]
    text = VECTOR.replace("wire 2 ! enc [1:0]", f'wire 1 " tick $end\n$var wire 4 ! enc {declared}')
    text += "".join(f'#{k}\nb{value} !\n{k % 2}"\n' for k, value in enumerate(values))
    recording = read_capture(write(tmp_path / "w.vcd", text), channel, "tb.tick")
    extended = [value[-4:].rjust(4, value[0] if value[0] in "xz" else "0") for value in values]
    levels: list[int] = []
    for value in extended:
        levels.append(int(value[3 - bit]) if value[3 - bit] in "01" else levels[-1])
    assert recording.b.tolist() == [k % 2 for k in range(len(values))]
    assert recording.a.tolist() == levels
    assert recording.source is not None
    assert recording.source.lines == {"a": f"tb.enc[{channel[-2]}]", "b": "tb.tick"}
    unknown = sum(value[3 - bit] not in "01" for value in extended)
    assert sum(int(note.split()[0]) for note in recording.source.notes if "to x or z" in note) in (unknown, unknown - 1)


def test_simulators_declare_more_than_the_standard(tmp_path: Path) -> None:
    text = HEAD.replace("$scope module deep", "$attrbegin misc 07 $end $scope interface deep")
    text = text.replace("$var reg 1 %", "$var real 1 R r $end $var string 1 S s $end $var bit 1 %")
    body = "$comment by 1 hand $end\n" + BODY.replace("#7", "r0.5 R\nshigh S\n#7").replace("0!", "L!").replace(
        "1!", "H!"
    )
    recording = read_capture(write(tmp_path / "w.vcd", text + body), "top.a", "top.b")
    assert (recording.a.tolist(), recording.b.tolist()) == ([0, 1, 1], [0, 0, 1])
    assert recording.source is not None
    assert [*recording.source.unused.values()] == ["top.deep.a", "top.bus"]


def test_pieces_of_any_length_make_the_same_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = read_capture(write(tmp_path / "w.vcd", HEAD + BODY), "top.a", "top.b")
    for piece in (1, 2, 7):
        monkeypatch.setattr(vcd, "_PIECE", piece)
        assert_same(read_capture(tmp_path / "w.vcd", "top.a", "top.b"), whole)


def test_of_many_variables_those_are_shown_that_are_near(tmp_path: Path) -> None:
    many = "".join(f"$var wire 1 v{k} signal_{k} $end\n" for k in range(200))
    path = write(tmp_path / "w.vcd", HEAD.replace("$scope module deep", many + "$scope module deep") + BODY)
    with pytest.raises(CaptureError, match=r"signal_37 \(39\) and \d+ more, not 'signal_19O'; near it are .*signal_19"):
        read_capture(path, "signal_19O")


@pytest.mark.parametrize("late", [10**4, 10**19, Fraction(3, 2)], ids=str)
def test_changes_come_in_parts(late: Fraction | int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their times are exact, also beyond 64 bits and with a fraction."""
    n, step, unit = 20, 10_000, Fraction(1, 10**9)
    monkeypatch.setattr(waveform, "ROWS", 6)
    variables = [Variable(name, 1, name.encode(), 0, 0) for name in "ab"]
    changes, parts = Changes(Path("c.vcd"), variables, Channels(), unit), list[Part]()
    for k in range(n):
        parts += changes.at(step * k)
        changes.change(b"a", "01"[k % 2])
        changes.change(b"b", "0")
    parts += changes.at(step * n + late)
    changes.change(b"b", "1")
    parts += changes.end()
    assert [len(part.time) for part in parts] == [6, 6, 6, 3]
    times = [*(step * k / 1e9 for k in range(n)), float((step * n + late) / Fraction(10**9))]
    assert np.concatenate([part.time for part in parts]).tolist() == times
    assert [part.until for part in parts] == [times[6], times[12], times[18], times[-1]]
