"""Cores of other sensors: hardware against golden model, the exported Verilog in Icarus, and wrong decoders."""

from pathlib import Path

import numpy as np
import pytest
from support.nightly import only
from support.options import had_by
from support.verilog import LintingVerilator, smoke

from tachometry.sim import golden
from tachometry.sim.encoder.imperfections import LineFault
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.stress import stress
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import Encoder, of_options, of_texts

BASE = {"ppr": "8", "clock": "1MHz", "tick": "40us", "max-time": "400us"}
CASES = {
    "pulses": {"decoding": "1", "filter": "2"},
    "step-dir": {"reverse": "yes"},
    "step-dir both": {"sensor": "step-dir", "decoding": "2", "invert": "a"},
    "up-down": {"invert": "a,b"},
    "hall": {"filter": "2", "invert": "b,z", "index": "yes"},
    "quadrature": {"reverse": "yes", "invert": "a,z", "index": "yes"},
}


@pytest.mark.parametrize("sensor", CASES)
def test_every_step_and_every_error(sensor: str) -> None:
    spec = of_texts("s", {"sensor": sensor} | BASE | CASES[sensor])
    found = lockstep(spec, stress(spec, 1, 9), PySim())
    assert found.n_mismatches == 0, found.first
    assert bool(len(found.actual.errors)) == (sensor != "pulses" and not (spec.filter_clocks and sensor != "hall"))
    assert len(found.actual.updates) > 10


@pytest.mark.parametrize("sensor", only(["step-dir", "up-down"], CASES))  # which Verilator 5.48 has counted wrongly
def test_every_step_in_verilator(sensor: str, tmp_path: Path) -> None:
    own = {name: text for name, text in CASES[sensor].items() if name in ("sensor", "decoding")}
    spec = of_texts("m", BASE | {"sensor": sensor} | own)
    found = lockstep(spec, stress(spec, 1, 26), LintingVerilator(tmp_path, few=True))
    assert found.n_mismatches == 0, found.first
    assert {-1, 1} <= {*found.actual.ticks.pulse_count.tolist()} or sensor == "pulses"


@pytest.mark.parametrize("level", [0, 1])
def test_halls_that_are_equal_at_reset_are_one_error(level: int) -> None:
    clock, lines = np.array([0, 200, 240]), np.array([[level] * 3, [1, 0, 1], [1, 0, 0]], dtype=np.uint8).T
    trace = PinTrace(clock, lines[0], lines[1], 400, c=lines[2])
    found = lockstep(of_texts("m", BASE | {"sensor": "hall"}), trace, PySim())
    assert found.n_mismatches == 0
    assert len(found.actual.errors) == 1
    assert found.actual.errors[0] < 5
    assert found.actual.ticks.position[-1] == 1


@pytest.mark.parametrize("sensor", CASES)
def test_the_virtual_encoder_makes_what_the_core_counts(sensor: str) -> None:
    """Also one that is mounted the other way round, with lines that are inverted."""
    texts = {"sensor": sensor} | BASE | CASES[sensor] | {"filter": "0"}
    spec = of_texts("s", texts)
    encoder = VirtualEncoder.of(spec.encoder, index=spec.index is not None, jitter=0.2, seed=3, start_angle_rad=0.013)
    truth = encoder.record(parse_motion("ramp:0:90rad/s:30ms+sine:60rad/s:40Hz:40ms+constant:150rad/s:60ms"))
    found = golden.run(spec, PinTrace.of(truth.recording, spec))
    assert len(found.errors) == 0
    counted = int(truth.true_position(truth.motion.duration, spec.encoder.decoding))
    assert abs(found.ticks.position[-1] - counted) <= 1
    assert abs(counted) > 3


@pytest.mark.parametrize("fault", ["phase_error_deg", "illegal", "lost"])
def test_faults_of_quadrature_are_refused(fault: str) -> None:
    with pytest.raises(ValueError, match=f"^{fault} must not be given with --sensor hall$"):
        VirtualEncoder.of(Encoder(4, sensor="hall"), **{fault: 0.1})


@pytest.mark.parametrize("sensor", CASES)
def test_exported_verilog_counts_in_icarus(sensor: str, tmp_path: Path) -> None:
    spec = of_texts("m", had_by("m", {"sensor": sensor} | BASE | CASES[sensor]))
    assert "PASS: position" in smoke(spec, tmp_path)


def test_many_axes_invert_and_reverse(tmp_path: Path) -> None:
    texts = {"method": "s", "axes": "3", "reverse": "yes", "invert": "b", "decoding": "1"}
    assert "PASS" in smoke(of_options(BASE | texts), tmp_path)


def test_a_line_of_halls_is_broken() -> None:
    """It is high, as an open input is, or stays as it is."""
    c = LineFault("c", 0.05)
    for encoder in (VirtualEncoder(4, sensor="hall", broken=c), VirtualEncoder(4, sensor="hall", stuck=c)):
        recording = encoder.record(parse_motion("constant:50rad/s:100ms")).recording
        assert recording.c is not None
        later = recording.c[recording.time >= 0.05]
        assert len(later) > 5
        assert {*later.tolist()} == ({1} if encoder.broken else {int(later[0])})
    with pytest.raises(ValueError, match=r"^broken must be of line a, b or z, not c$"):
        VirtualEncoder(4, broken=LineFault("c", 0.05))
