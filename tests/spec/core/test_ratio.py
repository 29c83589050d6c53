"""An encoder that is geared to the shaft: speeds are the shaft's, counts and index the encoder's."""

import math
from fractions import Fraction

import made_of
import numpy as np
import pytest
from support.nightly import only

from tachometry.hdl import core_of
from tachometry.sim import golden
from tachometry.sim.captures.count_log import ShaftLog
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import METHODS, TachometerSpec, of_options, of_texts
from tachometry.spec.core.encoder import Encoder

BASE = {"ppr": "4", "clock": "1MHz", "tick": "1ms", "max-time": "100ms", "unit": "rpm"}


def spec_of(method: str = "m", **more: str) -> TachometerSpec:
    return of_texts(method, BASE | {name.replace("_", "-"): text for name, text in more.items()})


@pytest.mark.parametrize("method", only(["t"], METHODS))  # the encoder is the same for all
def test_a_whole_number_of_counts_gives_the_core_of_that_disc(method: str) -> None:
    geared, disc = spec_of(method, ratio="7/4"), spec_of(method, ppr="7")
    assert geared.encoder.counts_per_rev == 28
    assert geared.velocity.rad_per_s_per_lsb == disc.velocity.rad_per_s_per_lsb
    assert made_of.netlist(core_of(geared)) == made_of.netlist(core_of(disc))
    assert made_of.netlist(core_of(geared)) != made_of.netlist(core_of(spec_of(method)))
    assert of_options(geared.options) == geared
    assert not any("ratio" in spec_of(ratio=one).options for one in ("1", "1.0", "7/7"))


@pytest.mark.parametrize(("ppr", "ratio", "turns"), [("1", "1.75", "7/4"), ("90", "10/9", "10/9")])
def test_a_virtual_shaft_is_read_right(ppr: str, ratio: str, turns: str) -> None:
    """By the golden model; gates are those without a ratio."""
    spec = spec_of("mt", ppr=ppr, ratio=ratio, max_speed="20000rpm", index="yes")
    assert spec.encoder.turns == Fraction(turns) == Fraction(spec.options["ratio"])
    encoding = VirtualEncoder.of_core(spec).record(parse_motion("constant:3000rpm:200ms"))
    trace = PinTrace.of(encoding.recording, spec)
    run = golden.run(spec, trace)
    shown = run.updates.velocity[5:] * spec.velocity.rad_per_s_per_lsb * 30 / math.pi
    assert shown == pytest.approx(3000, rel=0.001)
    assert run.ticks.position[-1] == pytest.approx(10 * 4 * int(ppr) * Fraction(turns), abs=1 + 4 * int(ppr) / 10)
    assert {*np.diff(run.index.index_position)} == {4 * int(ppr)}


def test_angles_of_a_log_are_the_shafts_and_counts_the_encoders() -> None:
    encoder, place = Encoder(4, ratio="7/4"), np.array([0.0, 1.0])
    angles, counts = (ShaftLog(place, place, "log", (), angles) for angles in (True, False))
    assert angles.edges(encoder, 16)[1] == pytest.approx(28 / (2 * math.pi))
    assert counts.edges(encoder, 16)[1] == 1


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"ratio": "0"}, "ratio must be turns of the encoder for one of the shaft, as 7/4 or 1.75, not '0'"),
        ({"ratio": "7:4"}, "ratio must be turns of the encoder for one of the shaft, as 7/4 or 1.75, not '7:4'"),
        ({"ratio": "1/99"}, "ratio must make from 1 to 16777216 counts in a turn of the shaft, not 0.161616"),
        ({"ratio": "2", "position_modulo": "rev", "index": "yes", "index_reset": "yes"}, "position_modulo must be co"),
        ({"ratio": "2", "electrical": "1"}, "electrical does not work with --ratio: "),
    ],
)
def test_invalid_ratios_are_rejected(more: dict[str, str], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}"):
        spec_of(**more)
