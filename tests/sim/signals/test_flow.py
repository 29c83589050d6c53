"""A recording in parts is the whole, in what the pins see and in what it says of itself."""

from functools import reduce
from typing import Any

import numpy as np
import pytest
from support.captures import assert_same

from tachometry.sim.encoder import crossings
from tachometry.sim.encoder.imperfections import Bounce
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
]


@pytest.mark.parametrize("values", ENCODERS)
def test_a_motion_in_parts(values: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    encoder = VirtualEncoder(25, seed=1, **values)
    whole = encoder.record(MOTION).recording
    monkeypatch.setattr(crossings, "_CHUNK", 7)
    parts, truth = encoder.flow(MOTION)
    assert isinstance(parts, Flow)
    found = parts.whole()
    assert (found.duration, *found.lines) == (whole.duration, *whole.lines)
    np.testing.assert_array_equal(found.time, whole.time)
    np.testing.assert_array_equal(found.level, whole.level)
    assert parts.n_changes == whole.n_changes > 100
    assert (truth.n_illegal, truth.n_lost) == (0, 0)


@pytest.mark.parametrize("values", [{"lost": 0.1}, {"illegal": 0.1}, {"index": True}, {"sensor": "step-dir"}])
def test_a_motion_that_is_made_as_a_whole(values: dict[str, Any]) -> None:
    parts, truth = VirtualEncoder(25, **values).flow(MOTION)
    assert parts is truth.recording


@pytest.mark.parametrize("clock_hz", [2_000, 1_000_000])
def test_pieces_are_what_the_pins_see(clock_hz: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the slower clock edges are merged, some of them at the ends of parts or pieces."""
    recording = VirtualEncoder(25, illegal=0.1, bounce=Bounce(2, 1e-3)).record(MOTION).recording
    spec = of_texts("m", {"ppr": "25", "clock": f"{clock_hz}Hz", "tick": "10ms"}).tachometer
    whole = PinTrace.of(recording, spec)
    monkeypatch.setattr(flow, "ROWS", 5)
    parts, pieces, merged = Flow.of(recording), list[PinTrace](), list[int]()
    for piece in parts.pieces(spec, clock_hz // 500):
        pieces.append(piece)
        n_clocks = sum(each.n_clocks for each in pieces)
        merged.append(parts.n_merged(clock_hz, n_clocks))
        assert merged[-1] == recording.n_merged(clock_hz, n_clocks)
        assert parts.n_merged(clock_hz, n_clocks - 1) == recording.n_merged(clock_hz, n_clocks - 1)
    assert_same(reduce(PinTrace.then, pieces), whole)
    assert max(piece.n_clocks for piece in pieces) == clock_hz // 500
    assert (parts.n_changes, parts.n_together) == (recording.n_changes, recording.n_together)
    assert merged[-1] > 0
    assert parts.n_together > 0
