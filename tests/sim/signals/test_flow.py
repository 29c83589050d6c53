"""A recording in parts is the whole, in what the pins see and in what it says of itself."""

from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.captures import assert_same

from tachometry.sim.captures import sigrok, text, waveform
from tachometry.sim.captures.file import Channels
from tachometry.sim.captures.header import PLAIN
from tachometry.sim.captures.read import read_parts, with_last_tick
from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.encoder import crossings
from tachometry.sim.encoder.imperfections import Bounce, LineFault
from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals import flow
from tachometry.sim.signals.flow import Flow
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import of_texts

MOTION = parse_motion("ramp:0:900rad/s:20ms+stop:9ms+sine:-400rad/s:200Hz:20ms+stop:9ms")
ENCODERS: list[dict[str, Any]] = [
    {"jitter": 0.3, "vibration": Vibration(1e-2, 900.0)},
    {"nonuniformity": 0.3, "reverse": True, "complemented": ("a",), "start_angle_rad": 1.0},
    {"sensor": "hall", "invert": "a,c", "jitter": 0.1},
    {"lost": 0.2, "illegal": 1.0, "bounce": Bounce(1, 1.0), "vibration": Vibration(0.1, 900.0)},
    {"lost": 0.3, "illegal": 0.5, "bounce": Bounce(3, 1e-4), "index": True, "broken": LineFault("z", 0.03)},
    {"index": True, "index_width": 3, "index_skew_s": -1e-3, "lost": 0.1, "stuck": LineFault("b", 0.02)},
    {"index": True, "index_skew_s": 1e-3, "illegal": 1.0, "jitter": 0.3, "stuck": LineFault("a", 0.006)},
    {"sensor": "step-dir", "both_edges": True},
    {"sensor": "pulses", "bounce": Bounce(1, 1.0), "lost": 0.5, "jitter": 0.3},
]


@pytest.mark.parametrize("values", ENCODERS)
def test_a_motion_in_parts(values: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    encoder = VirtualEncoder(25, seed=1, **values)
    known = encoder.record(MOTION)
    whole, counts = known.recording, known.true_position(0.03)
    monkeypatch.setattr(crossings, "_CHUNK", 7)
    parts, truth = encoder.flow(MOTION)
    assert isinstance(parts, Flow)
    found = parts.whole()
    assert (found.duration, *found.lines) == (whole.duration, *whole.lines)
    np.testing.assert_array_equal(found.time, whole.time)
    np.testing.assert_array_equal(found.level, whole.level)
    assert parts.n_changes == whole.n_changes > 100
    assert (truth.n_illegal, truth.n_lost) == (known.n_illegal, known.n_lost)
    assert truth.true_position(0.03) == counts


@pytest.mark.parametrize("clock_hz", [2_000, 1_000_000])
def test_pieces_are_what_the_pins_see(clock_hz: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the slower clock edges are merged, some of them at the ends of parts or pieces."""
    recording = VirtualEncoder(25, illegal=0.1, bounce=Bounce(2, 1e-3)).record(MOTION).recording
    spec = of_texts("m", {"ppr": "25", "clock": f"{clock_hz}Hz", "tick": "10ms"}).tachometer
    whole = PinTrace.of(recording, spec)
    first_update = spec.latency.tick + spec.latency.tick_to_velocity
    monkeypatch.setattr(flow, "ROWS", 5)
    parts, pieces, merged = Flow.of(recording), list[PinTrace](), list[int]()
    for piece in parts.pieces(spec, clock_hz // 100):
        pieces.append(piece)
        n_clocks = sum(each.n_clocks for each in pieces)
        assert n_clocks == whole.n_clocks or (n_clocks + 1) % spec.timing.tick_cycles == first_update
        merged.append(parts.n_merged(clock_hz, n_clocks))
        assert merged[-1] == recording.n_merged(clock_hz, n_clocks)
        assert parts.n_merged(clock_hz, n_clocks - 1) == recording.n_merged(clock_hz, n_clocks - 1)
    assert_same(reduce(PinTrace.then, pieces), whole)
    assert max(piece.n_clocks for piece in pieces) == clock_hz // 100
    assert (parts.n_changes, parts.n_together) == (recording.n_changes, recording.n_together)
    assert merged[-1] > 0
    assert parts.n_together > 0
    monkeypatch.setattr(flow, "MOST_IN_PIECES", 5)
    with pytest.raises(ValueError, match="must have at most 5 ticks, 50ms of this tick, not "):
        [*Flow.of(recording).pieces(spec, clock_hz // 100)]


def test_a_short_recording_is_a_clock() -> None:
    spec = of_texts("m", {"ppr": "25", "clock": "1MHz", "tick": "10ms"}).tachometer
    recording = VirtualEncoder(25).record(parse_motion("stop:100ns")).recording
    (piece,) = Flow.of(recording).pieces(spec, 10_000)
    assert piece.n_clocks == PinTrace.of(recording, spec).n_clocks


@pytest.mark.parametrize("suffix", [".vcd", ".csv", ".sr"])
@pytest.mark.parametrize("end", ["", "#60000\n"])
def test_files_in_parts(suffix: str, end: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that ends with an edge is held for a tick more; Z never changes, but X does."""
    spec = of_texts("m", {"ppr": "25", "clock": "1MHz", "tick": "1ms"}).tachometer
    path, motion = tmp_path / f"x{suffix}", parse_motion("constant:90rad/s:50ms")
    recording = VirtualEncoder(25).record(motion).recording
    if suffix == ".sr":
        write_sr(path, recording.place(20_000), 20_000, _chunk=50)
    else:
        rows = zip(np.rint(recording.time * 1e6).astype(int).tolist(), recording.a, recording.b, strict=True)
        form = "#{0}\n{1}!\n{2}$\n0z\n{2}x\n" if suffix == ".vcd" else "{0},{1},{2},0,{2}\n"
        names = "".join(f"$var wire 1 {code} {name} $end\n" for code, name in zip("!$zx", "abzx", strict=True))
        head = f"$timescale 1 us $end {names} $enddefinitions $end\n" if suffix == ".vcd" else "time_us,a,b,z,x\n"
        last = end if suffix == ".vcd" or not end else "60000,0,0,0,0\n"
        path.write_text(head + "".join(form.format(*row) for row in rows) + last)
    wanted = Channels(others={} if suffix == ".sr" else {"z": "z"})
    capture = with_last_tick(read_parts(path, wanted, None, PLAIN).whole(), spec)
    for module in (flow, sigrok, waveform):
        monkeypatch.setattr(module, "ROWS", 5)
    monkeypatch.setattr(text, "BLOCK", 5)
    parts = with_last_tick(read_parts(path, wanted, None, PLAIN), spec)
    assert_same(reduce(PinTrace.then, parts.pieces(spec, 1500)), PinTrace.of(capture, spec))
    assert parts.read > 0
    assert parts.source == capture.source
    assert parts.source is not None
    assert parts.source.n_changes > 50
    if suffix != ".sr":
        assert parts.read == parts.size == path.stat().st_size
        assert (parts.source.still, parts.source.moving) == (("z",), ("x",))
