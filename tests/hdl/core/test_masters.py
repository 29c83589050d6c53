"""Cores that read an encoder themselves: hardware against golden model, exported Verilog, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from support.nightly import nightly, only
from support.verilog import smoke

from tachometry.hdl.extras import health
from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.sampled import encoder_of
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.golden.encoder_read import Records
from tachometry.sim.golden.sampled import Reads
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import ParameterError, TachometerSpec, TrackTachometer, of_options, of_texts
from tachometry.spec.core.extras.health import READ_FAULTS
from tachometry.spec.core.reads import JUMP, WARNING, WRONG_CHECK

BASE = {"sensor": "biss", "bits": "17", "clock": "50MHz", "tick": "100us", "max-time": "2ms"}
AMT22 = {"sensor": "spi", "chip": "amt22", "bits": "12"}
SSI = {"sensor": "ssi", "bits": "3+12", "encoder-clock": "2MHz"}
CASES = {
    "m": SSI | {"gray": "yes", "repeat": "yes", "line-delay": "300ns", "reverse": "yes", "health": "yes"},
    "m outside": {"bits": "8+12", "external-tick": "yes", "tick": "50us", "crc": "0x190d9"}
    | {"health": "yes", "max-speed": "6000rpm"},
    "m short": SSI | {"tick": "40us", "average": "3"},
    "track": {},
    "m late": {"sensor": "spi", "chip": "as5047p", "bits": "14", "external-tick": "yes", "max-speed": "6000rpm"}
    | {"max-time": "1ms", "tick": "50us", "health": "yes"},
    "m bytes": AMT22 | {"reverse": "yes"},
    "m tformat": {"sensor": "tformat", "bits": "16+17", "line-delay": "100ns", "health": "yes"},
    "track tformat": {"sensor": "tformat", "bits": "23", "encoder-clock": "5MHz", "max-speed": "3000rpm"},
}


def core(case: str) -> TachometerSpec:
    return of_texts(case.split()[0], BASE | CASES[case])


@pytest.mark.parametrize("case", only(["m", "m outside", "m late"], CASES))
def test_gates_and_golden_model_agree_on_every_read(case: str) -> None:
    spec = core(case)
    found = lockstep(spec, stress(spec, 26, 30), Cxxrtl())  # where the first fault is a jump with a warning
    assert found.n_mismatches == 0, found.first
    assert len(found.actual.errors) > 10
    assert {0, 1} == {*found.actual.ticks.position_valid.tolist()}
    assert len({*found.actual.ticks.position.tolist()}) > 40


def test_a_jump_is_named_before_a_warning() -> None:
    """The warning bit means that the position was taken."""
    spec, sample = core("m outside"), np.array([5, 6, 900, 7, 901, 8])
    clock, reason, warning = np.arange(6) * 2500, np.array([0, 0, 0, 0, 0, 2]), np.array([0, 1, 1, 0, 0, 1]) > 0
    found = Reads.those(spec, Records(clock, sample, 0 * clock, reason, warning))
    assert found.fault.tolist() == [WARNING, JUMP, JUMP, WRONG_CHECK]
    assert found.fault_clock.tolist() == [2503, 5003, 10_003, 12_500]


@nightly
def test_a_wrong_code_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = core("m outside")
    monkeypatch.setattr(health, "READ_FAULTS", READ_FAULTS + 1)
    assert lockstep(spec, stress(spec, 1, 30), Cxxrtl()).n_mismatches > 0


@pytest.mark.parametrize("case", only(["m", "m late", "m bytes", "m tformat"], [*CASES]))
def test_exported_verilog_reads_a_model_in_icarus(case: str, tmp_path: Path) -> None:
    assert "PASS: position 24" in smoke(core(case), tmp_path)


@pytest.mark.parametrize(("errors", "delay"), [(0, "0ns"), (0.05, "1us")])
def test_a_core_follows_a_shaft_by_a_cable_with_wrong_bits(errors: float, delay: str) -> None:
    spec = of_texts("m", BASE | {"bits": "4+17", "line-delay": delay, "unit": "rad/s"})
    encoder = encoder_of(spec, frame_errors=errors, start_angle_rad=1.0, seed=3)
    truth = encoder.record(parse_motion("constant:20rad/s:60ms+ramp:20rad/s:-20rad/s:60ms"))
    run = golden.run(spec, PinTrace.of(truth.recording, spec))
    read = run.ticks.position
    # Shortly before the end of each tick, but of the ticks whose frame was wrong.
    place = truth.true_angle(run.ticks.clock / spec.timing.clock_hz) / (2 * np.pi) * 2**17
    off = np.abs(read - place)[10:]
    assert np.median(off) < 40
    assert (len(run.errors) > 20) == bool(errors)
    assert read[-1] == truth.true_position(run.ticks.clock[-1] / spec.timing.clock_hz)


def test_a_read_begins_so_that_it_ends_with_its_tick() -> None:
    reads = core("track").reads
    assert reads is not None
    # 40 us for the start bit; 17 bits, 2 of state, 6 of CRC, start and CDS of 200 ns; two half periods; 20 us of rest.
    assert reads.longest == 2000 + 10 * 26 + 5 + 1
    assert core("track").read_starts(10_000) == range(4999 - reads.longest, 10_000, 5000)
    short = of_texts("m", BASE | {"tick": "40us"}).reads
    assert short is not None
    assert short.longest + short.rest + 1 == 2000  # the wait is shorter where the tick is


def test_nothing_checks_reads_by_ssi_once_or_without_a_crc() -> None:
    waiting = [{"sensor": "ssi"}, {"crc": "none"}, {"sensor": "sampled", "crc": "none"}]
    checked = [{"sensor": "ssi", "repeat": "yes"}, {}, {"sensor": "sampled"}, AMT22, {"sensor": "tformat"}]
    for nth, more in enumerate((*waiting, *checked)):
        spec = of_texts("track", BASE | {"tick": "200us"} | more)
        assert isinstance(spec, TrackTachometer)
        assert spec.form.waits == (nth < len(waiting))


def test_a_core_is_made_again_from_its_options() -> None:
    for case in CASES:
        assert of_options(core(case).options) == core(case)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"tick": "20us"}, "tick_cycles must be at least 1299 clocks for a read, 25.98us, not 1000"),
        ({"crc": "67"}, "crc must be none, or a polynomial of degree 3 to 32, as 0x43, not '67'"),
        ({"crc": "0x42"}, "crc must be none, or a polynomial of degree 3 to 32, as 0x43, not '0x42'"),
        ({"crc": "0x07"}, "crc must begin with its highest term, as 0x107 of 8 bits, not '0x07'"),
        ({"crc": "0x1021"}, "crc must begin with its highest term, as 0x11021 of 16 bits, not '0x1021'"),
        ({"crc": "0x04C11DB7"}, "crc must begin with its highest term, as 0x104c11db7 of 32 bits, not '0x04C11DB7'"),
        ({"repeat": "yes"}, "repeat must be given with --sensor ssi, not biss"),
        ({"sensor": "ssi", "crc": "none"}, "crc must be given with --sensor biss or sampled, not ssi"),
        ({"sample-age": "3"}, "sample_age must be given with --sensor sampled, not biss"),
        ({"sensor": "sampled", "gray": "yes"}, "gray must be given with --sensor ssi or biss, not sampled"),
        ({"encoder-clock": "20MHz"}, "encoder_clock must be from 1 Hz to 10 MHz, not 20000000 Hz"),
        ({"sensor": "spi"}, "chip must be given with --sensor spi: as5047p or amt22"),
        ({"sensor": "spi", "chip": "amt22"}, "bits must be 12 or 14 for amt22, not 17"),
        (AMT22 | {"encoder-clock": "4MHz"}, "encoder_clock must be from 1 Hz to 2 MHz, not 4000000 Hz"),
        (
            {"sensor": "tformat", "encoder-clock": "4MHz"},
            "encoder_clock must be 2.5MHz or 5MHz for tformat, not 4000000 Hz",
        ),
        ({"sensor": "tformat", "bits": "25+12"}, r"bits must be at most 24 of turns for tformat, not 25\+12"),
        (
            {"sensor": "tformat", "clock": "12MHz"},
            "clock_hz must be nearer to a multiple of 2500000 Hz for tformat, not 12000000",
        ),
    ],
)
def test_what_has_no_meaning_is_refused(more: dict[str, str], message: str) -> None:
    with pytest.raises(ParameterError, match=f"^{message}$"):
        of_texts("m", BASE | more)
