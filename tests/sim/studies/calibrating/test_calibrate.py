"""Captures of a virtual encoder become the map of its disc, wherever its index is and whatever is lost."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.arrays import Floats
from tachometry.sim.signals.recording import PinTrace, Recording
from tachometry.sim.studies.calibrating.calibrate import Calibration, calibrate
from tachometry.spec import of_texts
from tachometry.spec.core.disc import Disc

PPR = 50
DOWN = "ramp:150rad/s:60rad/s:3s"
FAULTS = {"nonuniformity": 0.1, "eccentricity": 0.25, "phase_error_deg": 10.0, "duty_error_deg": 4.0, "jitter": 0.05}


@cache
def encoder(**more: Any) -> VirtualEncoder:
    return VirtualEncoder(PPR, **{**FAULTS, "index": True, **more})


def recorded(motion: str = DOWN, **more: Any) -> Recording:
    return encoder(**more).record(parse_motion(motion)).recording


def true(**more: Any) -> Floats:
    offset = encoder(**more).disc.offset
    return offset - offset.mean()


def found(*recordings: Recording, texts: dict[str, str] | None = None, against: Disc | None = None) -> Calibration:
    spec = of_texts("s", {"ppr": str(PPR), **({"index": "yes"} if texts is None else texts)})
    return calibrate([(f"{place}.sr", one) for place, one in enumerate(recordings)], spec, against=against)


def off(one: Calibration, table: Floats) -> float:
    return float(np.std(np.array(one.disc.displacement) - table))


@pytest.mark.parametrize(
    ("texts", "more"),
    [
        ({"index": "yes"}, {}),
        ({"index": "yes", "reverse": "yes"}, {"reverse": True}),
        ({"index": "yes", "invert": "a,z"}, {"invert": "a,z"}),
        ({"index": "yes", "index-at": "A=0,B=1"}, {"index_state": 3}),
        ({"index": "yes", "index-at": "edge"}, {"index_width": 4}),
    ],
    ids=lambda texts: " ".join(map(str, texts.values())),
)
def test_edges_are_counted_from_the_index(texts: dict[str, str], more: dict[str, Any]) -> None:
    """Both directions, and a place in the turn where the shaft begins, make no difference."""
    motion = f"constant:100rad/s:13ms+{DOWN}+ramp:60rad/s:-150rad/s:200ms+ramp:-150rad/s:-60rad/s:3s"
    one = found(recorded(motion, **more), texts=texts)
    assert one.reasons == []
    turned = 4 if "reverse" in more else 0  # its index is at position -2, which is place 2 of another period
    assert off(one, np.roll(true(**more), turned)) < 0.01
    assert one.disc.reverse == ("reverse" in texts)
    assert one.disc.index_place == {"A=0,B=1": 3, "edge": 1}.get(texts.get("index-at", ""), 2)


@pytest.mark.parametrize("index", [True, False])
def test_lost_counts_are_left_out(index: bool) -> None:
    one = found(recorded(lost=0.0003, seed=3), texts=None if index else {})
    assert one.reasons == []
    assert one.slips >= 1 or not index
    table = true(seed=3)
    best = min(range(0, 4 * PPR, 1), key=lambda place: off(one, np.roll(table, place)))
    assert off(one, np.roll(table, best)) < 0.013
    assert best == 0 or not index


def test_a_later_capture_is_counted_as_the_map() -> None:
    first = found(recorded())
    later = found(recorded(f"constant:120rad/s:21ms+{DOWN}", seed=0), texts={}, against=first.disc)
    assert later.reasons == []
    assert off(later, true()) < 0.012
    assert later.change is not None
    assert later.change < 0.02


@pytest.mark.parametrize("texts", [{}, {"reverse": "yes"}])
def test_a_capture_without_an_index_aligns_a_core(texts: dict[str, str], tmp_path: Path) -> None:
    """A core that begins with the capture has the least errors if DISC_TURN gives this number, and no other one."""
    lines = {"ppr": str(PPR), **texts}
    first = found(recorded(), texts={**lines, "index": "yes"})
    later = recorded(start_angle_rad=2.0, seed=0)
    turn = found(later, texts=texts, against=first.disc).turn
    (path := tmp_path / "disc.json").write_text(first.disc.text)
    spec = of_texts("mt", lines | {"clock": "10MHz", "tick": "20us", "max-speed": "400rad/s", "disc": str(path)})
    trace = PinTrace.of(later, spec)
    assert turn is not None

    def error(by: int) -> float:
        high = {"disc_turn_by": np.full(len(trace.clock), by, np.uint8)}
        lines = PinTrace.of_lines(trace.clock, trace.n_clocks, trace.lines | high).completed(spec)
        updates = golden.run(spec, lines.with_pulses("disc_turn", np.array([5]))).updates
        return float(np.std(np.diff(updates.velocity[1000:9000])))

    errors = [error((turn + off) % (4 * PPR)) for off in (-4, -1, 0, 1, 4)]
    assert errors[2] < 0.8 * min(errors[:2] + errors[3:]), errors


def test_another_encoder_is_refused() -> None:
    first = found(recorded())
    (reason,) = found(recorded(seed=5), against=first.disc).reasons
    assert reason.startswith("this is another encoder than that of --against")
    moved = replace(first.disc, displacement=tuple(np.roll(first.disc.displacement, 8).tolist()))
    assert found(recorded(), against=moved).reasons == ["the index is +8 counts from where it is in --against"]
    fewer = replace(first.disc, counts_per_rev=4, displacement=(0.0,) * 4)
    assert "4 counts a turn" in found(recorded(), against=fewer).reasons[0]


def test_halls_need_an_index_or_one_capture() -> None:
    halls = VirtualEncoder(4, sensor="hall", jitter=0.02)
    recordings = [halls.record(parse_motion(f"constant:150rad/s:{place}ms+{DOWN}")).recording for place in (1, 7)]
    spec = of_texts("s", {"pole-pairs": "4", "sensor": "hall"})
    assert calibrate([("1", recordings[0])], spec).reasons == []
    with pytest.raises(ValueError, match="the lines do not show how the disc lies"):
        calibrate([("1", recordings[0]), ("2", recordings[1])], spec)


def test_an_index_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match=r"0\.sr must have an index every 192 counts, as --ppr says, not every 200"):
        found(recorded(), texts={"ppr": "48", "index": "yes"})
    with pytest.raises(ValueError, match="and none comes"):
        found(recorded("constant:1rad/s:100ms", start_angle_rad=1.0))


def test_a_map_is_read_as_it_is_written() -> None:
    disc = found(recorded()).disc
    assert Disc.parse(disc.text) == disc
    for text in ("", "[]", "{}", "1", disc.text.replace("-0.", "-Infinity")[:-9], "[" * 100_000):
        with pytest.raises(ValueError, match="it has no map of a disc"):
            Disc.parse(text)
    for before, after, message in (
        ('"format": 1', '"format": 2', "its format must be 1, not 2"),
        ('_rev": 200', '_rev": 201', "must have 201 displacements, not 200"),
    ):
        with pytest.raises(ValueError, match=message):
            Disc.parse(disc.text.replace(before, after))
    for wrong in (np.nan, np.inf, 200.0):
        with pytest.raises(ValueError, match="must have displacements within 200 counts"):
            replace(disc, displacement=(wrong,) * 200)
