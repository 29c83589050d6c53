"""The virtual encoder: edges against closed forms, lines against the truth."""

import hashlib
import math

import numpy as np
import pytest
from support.lines import FORWARD, GOLDEN, PITCH, PPR, decode, decoded_at, levels, record

from tachometry.sim.encoder import crossings
from tachometry.sim.encoder.motion import Vibration
from tachometry.sim.encoder.virtual import VirtualEncoder


def test_constant_speed_gives_equally_spaced_edges() -> None:
    encoding = record("constant:1rev/s:1s", start_angle_rad=PITCH / 2)
    time = encoding.recording.time
    assert len(time) == 1 + 4 * PPR
    np.testing.assert_allclose(time[1:], (np.arange(4 * PPR) + 0.5) / (4 * PPR), rtol=1e-12)
    np.testing.assert_allclose(np.diff(time[1:]), 1 / (4 * PPR), rtol=1e-11)
    assert encoding.recording.duration == 1
    assert encoding.n_illegal == 0


def test_forward_is_a_before_b() -> None:
    encoding = record("constant:1rev/s:900us")
    assert levels(encoding.recording) == [(0, 0), (1, 0), (1, 1), (0, 1)]


def test_reverse_is_b_before_a() -> None:
    encoding = record("constant:-1rev/s:1ms", start_angle_rad=PITCH / 2)
    assert levels(encoding.recording) == [(0, 0), (0, 1), (1, 1), (1, 0), (0, 0)]
    np.testing.assert_allclose(encoding.recording.time[1:], (np.arange(4) + 0.5) / (4 * PPR), rtol=1e-12)


@pytest.mark.parametrize("quarter", range(-5, 6))
def test_levels_at_rest_follow_from_the_start_angle(quarter: int) -> None:
    encoding = record("stop:1s", start_angle_rad=(quarter + 0.5) * PITCH)
    assert levels(encoding.recording) == [FORWARD[quarter % 4]]


def test_an_angle_on_an_edge_has_passed_it() -> None:
    disc = VirtualEncoder(PPR).disc
    assert disc.quarter(np.array([0.0, PITCH, -PITCH, np.nextafter(0, -1)])).tolist() == [0, 1, -1, -1]
    assert record("constant:-1rad/s:1us").true_position([0, 1e-9]).tolist() == [0, -1]


def test_ramp_from_standstill() -> None:
    encoding = record("ramp:0:100rad/s:2s")
    k = np.arange(1, len(encoding.recording.time))
    np.testing.assert_allclose(encoding.recording.time[1:], np.sqrt(2 * 2 / 100 * k * PITCH), rtol=1e-13)
    assert k[-1] == math.floor(100 / PITCH)


def test_ramp_through_zero_turns_where_the_speed_does() -> None:
    # The apex, 25 rad at 1 s, lies between two points of any grid of ends only.
    encoding = record("ramp:50rad/s:-50rad/s:2s", start_angle_rad=PITCH / 2)
    time, position = encoding.recording.time, decode(encoding.recording, 4)[0]
    assert max(position) == math.floor(25 / PITCH + 0.5)
    assert position[-1] == 0
    np.testing.assert_allclose(time[1:] + time[:0:-1], 2, rtol=1e-13)


def test_turning_point_hidden_by_a_jump_of_the_speed() -> None:
    encoding = record("ramp:10rad/s:-5rad/s:1s+constant:10rad/s:1s", start_angle_rad=PITCH / 2)
    t = np.linspace(0, 2, 10_001)
    assert np.array_equal(decoded_at(encoding, t, 4), encoding.true_position(t))
    assert encoding.true_position(2 / 3) == math.floor(10 / 3 / PITCH + 0.5)


def test_turning_back_for_less_than_a_cell_of_the_grid() -> None:
    # 65 cells in a period of vibration: the shaft turns back within one of them, and passes an edge three times.
    amplitude, center = 1000 * PITCH, 0.5
    speed = 2 * math.pi * amplitude * (1 - 2e-4)
    encoding = record(
        f"constant:{speed!r}rad/s:1.0001s", vibration=Vibration(amplitude, 1), start_angle_rad=-speed * center
    )
    position = np.array(decode(encoding.recording, 4)[0])
    (back,) = np.flatnonzero(np.diff(position) < 0)
    assert encoding.recording.time[back + 1] == pytest.approx(center, abs=1e-6)


def test_jump_from_forward_to_reverse() -> None:
    encoding = record("constant:1rev/s:1ms+constant:-1rev/s:1ms", start_angle_rad=PITCH / 2)
    time = encoding.recording.time
    np.testing.assert_allclose(time[1:] + time[:0:-1], 2e-3, rtol=1e-12)
    assert len(time) == 9


def test_sine_returns() -> None:
    encoding = record("sine:20rad/s:5Hz:1s", start_angle_rad=PITCH / 2)
    position = decode(encoding.recording, 4)[0]
    top = math.floor(20 / (math.pi * 5) / PITCH + 0.5)
    assert position[-1] == min(position) == 0
    assert max(position) == top
    assert len(position) == 1 + 5 * 2 * top


@pytest.mark.parametrize(("past", "edges"), [(-1e-6, 0), (1e-6, 2)])
def test_touching_an_edge_gives_none_or_two(past: float, edges: int) -> None:
    # The peak of the angle is AMPLITUDE / (pi f).
    encoding = record(f"sine:{(0.5 + past) * PITCH * math.pi * 10!r}rad/s:10Hz:100ms", start_angle_rad=PITCH / 2)
    assert len(encoding.recording.time) == 1 + edges
    assert encoding.true_position(0.05) == edges // 2


def test_vibration_dithers_on_one_edge_at_standstill() -> None:
    encoding = record("stop:1s", vibration=Vibration(PITCH / 2, 50), start_angle_rad=PITCH)
    time = encoding.recording.time
    assert sorted(set(levels(encoding.recording))) == [(0, 0), (1, 0)]
    # The edge is met wherever the sine is 0, but not at time 0: there it has been passed.
    np.testing.assert_allclose(time[1:100], np.arange(1, 100) / 100, rtol=1e-12)
    assert set(encoding.true_position(time[1::2]).tolist()) == {-1}
    assert set(encoding.true_position(time[1::2], 1).tolist()) == {-1}
    assert set(encoding.true_position(time[2::2]).tolist()) == {0}


def test_vibration_is_in_the_true_speed_only() -> None:
    encoding = record("constant:3rad/s:1s", vibration=Vibration(1e-3, 50))
    t = np.linspace(0, 1, 7)
    np.testing.assert_allclose(encoding.true_speed(t), 3 + 0.1 * math.pi * np.cos(100 * math.pi * t), rtol=1e-12)


@pytest.mark.parametrize("decoding", [1, 2, 4])
@pytest.mark.parametrize(
    ("motion", "parameters"),
    [
        ("constant:1rev/s:1s", {}),
        ("constant:-7rad/s:1s", {"nonuniformity": 0.45}),
        ("ramp:30rad/s:-40rad/s:1s+stop:10ms+sine:9rad/s:3Hz:1s", {"nonuniformity": 0.2, "start_angle_rad": -12.3}),
        ("stop:1s", {"vibration": Vibration(5e-3, 47.3), "start_angle_rad": 0.1}),
        # Here the vibration only just makes the shaft turn back, at first three times a period and then not at all.
        ("ramp:0.2rad/s:0.6rad/s:3s", {"vibration": Vibration(1e-3, 60.1), "pulses_per_rev": 50_000}),
        ("sine:1rad/s:2Hz:1s", {"vibration": Vibration(2e-3, 301), "nonuniformity": 0.49, "pulses_per_rev": 5000}),
    ],
)
def test_truth_is_what_an_ideal_decoder_of_the_lines_sees(
    motion: str, parameters: dict[str, object], decoding: int
) -> None:
    encoding = record(motion, **parameters)
    time = encoding.recording.time
    t = np.concatenate(
        [time, np.nextafter(time[1:], 0), np.random.default_rng(1).uniform(0, encoding.motion.duration, 100_000)]
    )
    assert len(time) > 100
    assert np.array_equal(decoded_at(encoding, t, decoding), encoding.true_position(t, decoding))


def test_truth_of_one_moment() -> None:
    encoding = record("constant:1rev/s:1s", start_angle_rad=PITCH / 2)
    assert encoding.true_position(0.5) == 2 * PPR
    assert [encoding.true_position(0.999, d) for d in (1, 2, 4)] == [999, 1998, 3996]


def test_equal_inputs_give_equal_bytes_on_every_machine() -> None:
    recording = record(**GOLDEN).recording  # type: ignore[arg-type]
    assert len(recording.time) == 11921
    assert (
        hashlib.sha256(recording.time.astype("<f8").tobytes()).hexdigest()
        == "0f05b1a832222d486202dcae7fc753e91a52e897cdd87ee96576214be3443fa1"
    )
    assert (
        hashlib.sha256(recording.a.tobytes() + recording.b.tobytes()).hexdigest()
        == "4b6622b166cf8acea9330f952662ab55602b4ff924fbfb308e72047914fa73eb"
    )


def test_chunks_leave_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = record(**GOLDEN).recording  # type: ignore[arg-type]
    monkeypatch.setattr(crossings, "_CHUNK", 61)
    monkeypatch.setattr("tachometry.sim.encoder.imperfections._CHUNK", 67)
    parts = record(**GOLDEN).recording  # type: ignore[arg-type]
    assert np.array_equal(whole.time, parts.time)
    assert levels(whole) == levels(parts)


def test_interpolation_finds_what_bisection_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    parameters = {**GOLDEN, "jitter": 0.0}
    fast = record(**parameters).recording.time  # type: ignore[arg-type]
    monkeypatch.setattr(crossings, "_BISECT_AFTER", 0)
    slow = record(**parameters).recording.time  # type: ignore[arg-type]
    # an edge cannot be told more sharply than the angle's rounding allows at its speed
    assert np.quantile(np.abs(fast - slow), 0.99) < 1e-15
    np.testing.assert_allclose(fast, slow, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"pulses_per_rev": 0}, "pulses_per_rev must be from 1 to 67108864, not 0"),
        ({"start_angle_rad": math.inf}, "start_angle_rad must be finite, not inf"),
    ],
)
def test_parameters_out_of_range(parameters: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError) as error:  # noqa: PT011 (the whole message is compared)
        record("stop:1s", **parameters)
    assert str(error.value) == message


def test_decoding_must_exist() -> None:
    with pytest.raises(ValueError, match=r"^decoding must be 1, 2 or 4, not 3$"):
        record("stop:1s").true_position(0, 3)
