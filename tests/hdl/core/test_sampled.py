"""Cores whose encoder is read: hardware against golden model, exported Verilog, and what each read does."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from amaranth import Mux
from support.nightly import nightly, only
from support.simulate import clock_by_clock
from support.verilog import smoke

from tachometry.hdl.extras.health import ReadGates
from tachometry.hdl.front_end import sampled_position
from tachometry.hdl.methods.track_machine import TrackMachine
from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.sampled import encoder_of, read_lines, stress_reads
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run
from tachometry.sim.studies.extras import expected_rows
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import ParameterError, TachometerSpec, TrackTachometer, of_options, of_texts
from tachometry.spec.core.extras.health import Fault
from tachometry.spec.formats.tracking import PLACE_BITS

BASE = {"sensor": "sampled", "bits": "17", "clock": "48MHz", "tick": "40clk", "max-time": "400clk"}
SLOW = {"tick": "900clk", "max-time": "9000clk"}
CASES = {
    "m": {},
    "m of turns": {
        "bits": "3+9",
        "average": "3",
        "external-tick": "yes",
        "position-width": "8",
        "max-speed": "2e5rad/s",
        "reverse": "yes",
        "health": "yes",
    },
    "m zero": {"bits": "2+10", "zero": "-700", "preset": "100", "position-modulo": "rev/4", "reverse": "yes"},
    "m geared": {"bits": "3+9", "position-width": "14", "position-modulo": "1016", "zero": "-7000", "preset": "100"},
    "m fixed": {"bits": "12", "sample-age": "7", "position-width": "48", "lowpass": "20kHz", "age": "yes"},
    "m narrow": {"bits": "9", "position-width": "8", "position-modulo": str(1 << 20), "external-tick": "yes"},
    "track": SLOW,
    "track fine": SLOW
    | {"bits": "16+24", "multiplier": "block", "smooth": "yes", "external-tick": "yes"}
    | {"position-width": "48", "period": "64", "zero": "1000000007", "preset": "3", "crc": "none"}
    | {"electrical": "7", "lead": "1tick"},
    "track coarse": SLOW
    | {"bits": "5", "unit": "rpm", "sample-age": "100", "reverse": "yes", "max-memory": "5ms"}
    | {"position-modulo": "33"},
    "track period": SLOW
    | {"multiplier": "serial", "tick": "1000clk", "max-time": "10000clk", "period": "128", "crc": "none"},
}


INPUTS_OF = TrackMachine._inputs


def core(case: str) -> TachometerSpec:
    return of_texts(case.split()[0], BASE | CASES[case])


def trace_of(spec: TachometerSpec, reads: list[tuple[int, int, int, int]], n_clocks: int) -> PinTrace:
    """Return the trace of reads: clock, sample, age and whether it is right."""
    assert spec.encoder.sampled is not None
    clock, sample, age, right = (np.array(column, dtype=np.int64) for column in zip(*reads, strict=True))
    lines = read_lines(spec.encoder.sampled, sample, age, right)
    at = np.append(0, np.stack([clock, clock + 1], axis=1).ravel())
    none = np.zeros(len(at), dtype=np.uint8)
    zero: dict[str, Any] = {name: np.append(0, values) for name, values in lines.items()}
    return PinTrace.of_lines(at, n_clocks, {"a": none, "b": none} | zero)


def both(spec: TachometerSpec, reads: list[tuple[int, int, int, int]], n_clocks: int) -> Run:
    found = lockstep(spec, trace_of(spec, reads, n_clocks), PySim())
    assert found.n_mismatches == 0, found.first
    return found.actual


def test_the_angle_before_the_first_read_is_that_of_the_gates() -> None:
    spec = of_texts("track", BASE | SLOW | {"electrical": "7"})
    found = lockstep(spec, trace_of(spec, [(3000, 77_000, 3, 1)], 6000).completed(spec), PySim())
    assert found.n_mismatches == 0, found.first


# A core of track is compiled for this.
@pytest.mark.parametrize("case", only([*[*CASES][:5], "track fine"], CASES))
def test_gates_and_golden_model_agree_on_every_read(case: str) -> None:
    spec = core(case)
    few = case.startswith("track")
    found = lockstep(spec, stress(spec, 1, 20).completed(spec), Cxxrtl() if few else PySim())
    assert found.n_mismatches == 0, found.first
    run = found.actual
    assert len(run.errors) > 1
    assert {0, 1} == {*run.ticks.position_valid.tolist()}
    assert len({*run.ticks.position.tolist()}) > 50


def test_the_angle_of_a_motor_is_that_of_the_encoder_whatever_the_position_is() -> None:
    motion, angles = parse_motion("sine:40rad/s:10Hz:120ms"), []
    for zero in ("0", "12345"):
        texts = {"tick": "100us", "max-time": "2ms", "zero": zero, "electrical": "7", "lead": "1.5tick"}
        spec = of_texts("track", BASE | texts)
        truth = encoder_of(spec, start_angle_rad=1.0).record(motion)
        ticks = golden.run(spec, PinTrace.of(truth.recording, spec)).ticks
        angles.append(ticks.angle.tolist())
        assert ticks.angle_valid.tolist() == [0] + [1] * (len(ticks) - 1)
        use = (ticks.clock + 7200) / spec.timing.clock_hz
        error = ticks.angle / 2**16 - 7 * truth.true_angle(use) / (2 * np.pi)
        assert np.abs((error + 0.5) % 1 - 0.5)[300:-2].max() < 0.002
    assert angles[0] == angles[1]
    coarse = of_texts("track", BASE | texts | {"bits": "12"})
    (row,) = expected_rows(coarse, 600.0)
    assert float(row[1].split()[0]) < 0.05  # degrees


def test_zero_is_subtracted_from_the_position() -> None:
    spec = of_texts("m", BASE | {"bits": "2+9", "zero": "1000", "position-modulo": "512", "position-width": "16"})
    run = both(spec, [(20, 2040, 0, 1), (60, 5, 0, 1), (100, 900, 0, 1)], 200)
    assert run.ticks.position[:3].tolist() == [1040, 1053, 1948]
    assert run.ticks.position_modulo[:3].tolist() == [16, 29, 412]
    assert run.ticks.pulse_count[:3].tolist() == [0, 13, 256]


def test_a_preset_sets_what_the_next_tick_goes_on_from() -> None:
    """Two clocks of the synchroniser later; while no read is known it is left out, and it does not move the modulus."""
    spec = of_texts("m", BASE | {"bits": "2+9", "zero": "1000", "preset": "-5", "position-modulo": "512"})
    trace = trace_of(spec, [(20, 2040, 0, 1), (60, 5, 0, 1), (100, 900, 0, 1), (140, 901, 0, 1)], 700)
    found = lockstep(spec, trace.with_pulses("preset", np.array([2, 76, 118, 638])), PySim())
    assert found.n_mismatches == 0, found.first
    ticks = found.actual.ticks
    assert ticks.position[[0, 1, 2, 3, 15, 16]].tolist() == [1040, 8, 903, -4, -4, -4]
    assert ticks.position_modulo[:4].tolist() == [16, 29, 412, 413]


def test_the_first_read_is_absolute_and_later_ones_wrap() -> None:
    spec = of_texts("m", BASE | {"bits": "2+9", "position-width": "16"})
    reads = [(20, 2040, 0, 1), (60, 5, 0, 1), (100, 2030, 0, 1), (140, 1030, 0, 1), (180, 7, 0, 1), (220, 1031, 0, 1)]
    run = both(spec, reads, 300)
    assert run.ticks.position[:6].tolist() == [2040, 2053, 2030, 1030, 7, 7 - 1024]
    assert run.ticks.pulse_count[:6].tolist() == [0, 13, -23, -256, -256, -256]
    assert run.ticks.overflow[:6].tolist() == [0, 0, 0, 1, 1, 1]


@pytest.mark.parametrize("reverse", ["no", "yes"])
def test_a_position_is_that_of_the_last_good_read_of_a_tick(reverse: str) -> None:
    """A read in the last clock of a tick belongs to it; wrong and old ones are reported, and not taken."""
    spec = of_texts("m", BASE | {"bits": "9", "reverse": reverse})
    reads = [(10, 100, 0, 1), (39, 101, 0, 1), (41, 110, 80, 1), (60, 400, 81, 1), (70, 400, 0, 0), (159, 120, 3, 1)]
    run = both(spec, reads, 1000)
    sign, off = (-1, 512) if reverse == "yes" else (1, 0)
    expected = [101, 110, 110, 120, 120]
    assert run.ticks.position[:5].tolist() == [off + sign * place for place in expected]
    assert run.ticks.pulse_count[:5].tolist() == [0, sign * 9, 0, sign * 10, 0]
    assert run.errors.tolist() == [60, 70]
    valid = run.ticks.position_valid
    assert np.flatnonzero(valid).tolist() == [*range(13)]  # ten ticks without a read end it


@pytest.mark.parametrize("reverse", ["no", "yes"])
def test_a_jump_is_refused_until_a_second_read_agrees(reverse: str) -> None:
    """One LSB a tick is the greatest speed: 4 LSB more may be off, a fifth is not taken; two that agree begin anew."""
    spec = of_texts("m", BASE | {"bits": "9", "sample-age": "0", "max-speed": "14726rad/s", "reverse": reverse})
    sign = -1 if reverse == "yes" else 1
    places = [100, 105, 111, 107, 300, 320, 110, 400, 404, 405]
    run = both(spec, [(20 + 40 * at, sign * place % 512, 0, 1) for at, place in enumerate(places)], 420)
    assert run.ticks.position[:10].tolist() == [100, 105, 105, 107, 107, 107, 110, 110, 404, 405]
    assert run.ticks.pulse_count[:10].tolist() == [0, 1, 0, 1, 0, 0, 1, 0, 0, 1]  # saturated
    assert run.errors.tolist() == [103, 183, 223, 303]  # three clocks after the read
    assert both(spec, [(20, 0, 0, 1), (22_000, 256, 0, 1)], 22_100).errors.tolist() == []  # in time, it may be anywhere
    run = both(spec, [(20, sign * 100 % 512, 0, 1), (22, 101, 0, 1), (24, sign * 104 % 512, 0, 1)], 100)
    assert (run.ticks.position[0], run.errors.tolist()) == (104, [22])  # it comes while the first one is compared


@pytest.mark.parametrize(
    ("read", "code"), [((100, 0, 0), Fault.WRONG_CHECK), ((100, 81, 1), Fault.NO_ANSWER), ((111, 0, 1), Fault.JUMP)]
)
def test_health_names_the_first_fault(read: tuple[int, int, int], code: Fault) -> None:
    spec = of_texts("m", BASE | {"bits": "9", "max-speed": "1rad/s", "health": "yes"})
    run = both(spec, [(20, 100, 0, 1), (60, *read), (100, 100, 0, 1), (140, 200, 0, 0), (180, 100, 0, 1)], 240)
    assert run.ticks.health[:5].tolist() == [0, code, code, code, code]
    assert run.ticks.faults[:5].tolist() == [0, 1, 1, 2, 2]
    jumps = int(code == Fault.JUMP)
    assert run.ticks.jumps[:5].tolist() == [0, jumps, jumps, jumps, jumps]
    assert run.ticks.frame_errors[:5].tolist() == [0, 1 - jumps, 1 - jumps, 2 - jumps, 2 - jumps]
    assert run.errors.tolist() == [60 + 3 * jumps, 140]


def test_numbers_of_reads_stay_at_their_end_until_they_are_cleared() -> None:
    """A jump, code 5, is not a frame error, a warning, code 4, is neither."""
    names = ["frame_errors", "jumps"]
    inputs = [{"read_fault": code, "clear": 0} for code in (*[3] * 65_534, 4, 4, 5, 5, 1, 2)]
    seen = clock_by_clock(ReadGates(names), [*inputs, {"clear": 1}, {"clear": 0}, {}, {}], names)
    assert [tuple(seen[-at].values()) for at in (10, 8, 6, 4, 3, 1)] == [
        (65_534, 0),
        (65_534, 0),
        (65_534, 2),
        (65_535, 2),
        (0, 0),
        (2, 0),
    ]


def test_tracking_begins_anew_after_two_jumps_that_agree() -> None:
    spec = of_texts("track", BASE | SLOW | {"bits": "12", "max-speed": "100rad/s", "multiplier": "block"})
    places = [100, 101, 102, 103, 2000, 2001, 2002, 2003, 2004]
    trace = trace_of(spec, [(800 + 900 * at, place, 0, 1) for at, place in enumerate(places)], 9000)
    found = lockstep(spec, trace, Cxxrtl())
    assert found.n_mismatches == 0, found.first
    ticks, updates = found.actual.ticks, found.actual.updates
    assert ticks.position.tolist()[:9] == [100, 101, 102, 103, 103, 2001, 2002, 2003, 2004]
    assert ticks.position_valid.all()
    assert not updates.standstill.any()
    speed = updates.velocity[:9] * 2.0**-spec.velocity.frac_bits
    assert speed[[2, 3, 4]] == pytest.approx(1, abs=0.01)
    assert speed[[0, 5, 6]].tolist() == [0, 0, 0]
    assert speed[[7, 8]] == pytest.approx(1, abs=0.01)


def test_a_read_that_waits_is_no_update() -> None:
    """Its tick is forced: the position is that of the read, and the place between counts is carried on."""
    spec = of_texts("track", BASE | SLOW | {"bits": "12", "crc": "none", "multiplier": "block"})
    places = [100 + at + 400 * (at == 12) for at in range(20)]
    found = lockstep(
        spec, trace_of(spec, [(800 + 900 * at, place, 0, 1) for at, place in enumerate(places)], 18_800), Cxxrtl()
    )
    assert found.n_mismatches == 0, found.first
    ticks, updates = found.actual.ticks, found.actual.updates
    assert np.flatnonzero(updates.forced).tolist() == [12]
    assert not updates.standstill.any()
    assert ticks.position[11:14].tolist() == [111, 512, 113]
    assert spec.carrying is not None
    fine = updates.position_fine * 2.0**-spec.carrying.position_fine_bits
    assert fine[11:14] == pytest.approx([111.1, 112.1, 113.1], abs=0.1)


def test_after_the_maximum_time_the_next_read_is_absolute() -> None:
    spec = of_texts("m", BASE | {"bits": "9"})
    run = both(spec, [(20, 500, 0, 1), (60, 5, 0, 1), (1020, 7, 0, 1), (1060, 8, 0, 1)], 1200)
    assert run.ticks.position[[0, 1, 24, 25, 26]].tolist() == [500, 517, 517, 7, 8]
    assert run.ticks.pulse_count.sum() == 17 + 1


@nightly
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("known = self.position_valid & self.open_number", "known = self.open_number"),
        ("~off[-1] & off[width - 1]))", "~off[-1]))"),
        ("age <= self._most_age", "age < self._most_age"),
        ("self.checks[-1] & held & far.all()", "self.checks[-1] & far.all()"),
        (" & ~self.checks.any()", ""),
        ("before.eq(read)", "before.eq(self.open_sample)"),
        ("value.eq(reach.first)", "value.eq(0)"),
        ("self.silent.eq(Mux(self.open_number, 0, waited))", "self.silent.eq(Mux(self.open_number, 1, waited))"),
    ],
)
def test_a_wrong_reader_is_seen(monkeypatch: pytest.MonkeyPatch, old: str, new: str) -> None:
    spec = core("m" if "off[-1]" in old else "m of turns")
    text = Path(sampled_position.__file__).read_text(encoding="utf-8")
    assert text.count(old) == 1
    wrong: dict[str, Any] = {"__name__": "wrong"}
    exec(compile(text.replace(old, new), "wrong", "exec"), wrong)
    reader = sampled_position.SampledPosition
    for name in ("build", "_close", "_find_jumps"):
        monkeypatch.setattr(reader, name, getattr(wrong["SampledPosition"], name))
    assert lockstep(spec, stress(spec, 1, 30), PySim()).n_mismatches > 0


@pytest.mark.parametrize("case", only(["m of turns"], [*CASES]))
def test_exported_verilog_reads_in_icarus(case: str, tmp_path: Path) -> None:
    assert f"PASS: position {24 - int(CASES[case].get('zero', 0))}," in smoke(core(case), tmp_path)


@pytest.mark.parametrize("reverse", ["no", "yes"])
def test_the_virtual_encoder_reads_what_the_core_tracks(reverse: str) -> None:
    texts = {"tick": "100us", "max-time": "10ms", "clock": "10MHz", "bits": "2+17", "reverse": reverse}
    spec = of_texts("track", BASE | texts | {"unit": "rad/s"})
    encoder = encoder_of(spec, noise=0.3, interpolation=(0.15, 1024), frame_errors=0.01, start_angle_rad=1.0, seed=3)
    truth = encoder.record(parse_motion("constant:20rad/s:300ms+ramp:20rad/s:-20rad/s:300ms"))
    run = golden.run(spec, PinTrace.of(truth.recording, spec))
    assert run.ticks.position[-1] == truth.true_position(run.ticks.clock[-1] / spec.timing.clock_hz)
    time = (run.updates.clock + 1) / spec.timing.clock_hz
    off = run.updates.velocity * spec.velocity.rad_per_s_per_lsb - truth.true_speed(time)
    assert np.sqrt(np.mean(off[1000:2900] ** 2)) < 0.001
    assert np.sqrt(np.mean(off[4000:] ** 2)) < 0.02
    assert 20 < len(run.errors) < 100


@nightly
@pytest.mark.parametrize(
    ("name", "gate"),
    [
        ("_stored", lambda self, word: self._offset(word, self.kind)),  # not at the next offset
        ("_stored", lambda self, word: self._offset(word, Mux(word[0], self.end, self.kind)[:2])),  # four of them
        ("_inputs", lambda self: [value >> (place == 2) for place, value in enumerate(INPUTS_OF(self))]),
    ],
)
def test_a_wrong_offset_is_seen(monkeypatch: pytest.MonkeyPatch, name: str, gate: Callable[..., Any]) -> None:
    spec = core("track fine")
    monkeypatch.setattr(TrackMachine, name, gate)
    found = lockstep(spec, stress_reads(spec, 1, 30).completed(spec), Cxxrtl())
    assert found.n_mismatches > 0


@pytest.mark.parametrize(("bits", "noise", "most"), [("20", 2.0, 0.1), ("23", 2.0, 0.05), ("23", 0.0, 0.05)])
def test_an_interpolation_error_is_learned(bits: str, noise: float, most: float) -> None:
    """Eight offsets leave little of a sine, even where nothing else is wrong."""
    errors = []
    period = (1 << int(bits)) // 1024
    for more in ({"period": str(period)}, {}):
        spec = of_texts("track", BASE | {"tick": "100us", "max-time": "10ms", "bits": bits, "unit": "rad/s"} | more)
        encoder = encoder_of(spec, noise=noise, interpolation=(period / 850, 1024), seed=3)
        motion = parse_motion("constant:20rad/s:500ms+ramp:20rad/s:0.1rad/s:50ms+constant:0.1rad/s:400ms")
        truth = encoder.record(motion)
        run = golden.run(spec, PinTrace.of(truth.recording, spec))
        time = (run.updates.clock + 1) / spec.timing.clock_hz
        off = run.updates.velocity * spec.velocity.rad_per_s_per_lsb - truth.true_speed(time)
        errors.append(np.sqrt(np.mean(off[6500:] ** 2)))
    assert errors[0] < most * errors[1]


def test_a_core_is_made_again_from_its_options() -> None:
    spec = core("track coarse")
    assert of_options(spec.options) == spec


@pytest.mark.parametrize(
    ("method", "more", "message"),
    [
        ("s", {}, "bits must not be given with method s"),
        ("m", {"bits": "25"}, "bits must be bits of turns and of a turn, as 12\\+17"),
        ("m", {"ppr": "3"}, "ppr must be left out with --sensor sampled, not 3: type --bits"),
        ("m", {"index": "yes"}, "index must be left out with --sensor sampled: it is for edges"),
        ("m", {"blanking": "3"}, "blanking_clocks must be left out with --sensor sampled: it is for edges"),
        ("m", {"filter": "3"}, "filter_clocks must be left out with --sensor sampled: it is for edges"),
        ("m", {"sample-age": "81"}, "sample_age must be from 0 to 80 clocks, two ticks, not 81"),
        ("m", {"health": "yes", "health-edges": "3"}, "health must be alone for an encoder that is read"),
        (
            "m",
            {"sensor": "hall"},
            "bits must be given with --sensor sampled or ssi or biss or spi or tformat, not hall",
        ),
        ("m", {"decoding": "4"}, "decoding must be 1 for sampled, not 4"),
        ("m", {"zero": "3000000000"}, "zero must be from -2147483648 to 2147483647, a position, not 3000000000"),
        ("m", {"position-modulo": "rev/3"}, "position_modulo must be whole for .* read, not 43690.6667"),
        ("m", {"position-modulo": "24", "tick": "10clk"}, "tick_cycles must be at least 18 clocks for position_modulo"),
        ("track", {"crc": "0x43"}, "crc must be none or left out with --sensor sampled, not 0x43"),
        ("m", {"period": "64"}, "period must not be given with method m"),
        ("track", SLOW | {"period": "4"}, "period must be a power of two from 8 to 131072 LSB, a turn, not 4"),
        ("track", SLOW | {"period": "100"}, "period must be a power of two from 8 to 131072 LSB, a turn, not 100"),
        ("auto", {"tick": "2us"}, "tick must be longer for method track"),
    ],
)
def test_what_has_no_meaning_is_refused(method: str, more: dict[str, str], message: str) -> None:
    with pytest.raises(ParameterError, match=f"^{message}"):
        of_texts(method, BASE | {"max-time": "100us"} | more if method == "auto" else BASE | more)


def test_bits_must_be_given() -> None:
    with pytest.raises(ParameterError, match=r"^bits must be given with --sensor sampled, as 17"):
        of_texts("m", {name: text for name, text in BASE.items() if name != "bits"})


@pytest.mark.parametrize(("bits", "fraction"), [("17", 4), ("12", 0)])
def test_floors_are_those_of_rounding(bits: str, fraction: int) -> None:
    """The noise is at least 1/3 LSB of the read, a change is above 3/2, a mean above 1 LSB."""
    spec = of_texts("track", BASE | SLOW | {"bits": bits})
    assert isinstance(spec, TrackTachometer)
    lsb = 2.0 ** (PLACE_BITS - fraction)
    found = [spec.form.constants[name] / lsb for name in ("least_noise", "minus_change", "minus_mean")]
    assert found == pytest.approx([1 / 3, -3 / 2, -2], abs=1e-3)
