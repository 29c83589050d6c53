"""The electrical angle of each axis of many."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hdl.bus.test_bank import differing, random_accesses
from proofs.formal.mutants import mutant
from support.axes import motions
from support.nightly import nightly, only, only_rows
from support.verilog import run_in_icarus

from tachometry.hdl.core.axes_registers import AxesRegisterCore
from tachometry.hdl.extras import electrical_in_turn
from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.golden.axes_registers import GoldenAxesBank
from tachometry.sim.signals.axes import AxesTrace, of_axis
from tachometry.sim.signals.run import compare
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import AxesSpec, of_texts, with_axes
from tachometry.spec.registers.axes import AxesMap


def core(axes: int, words: str, *, parallel: bool = False) -> AxesSpec:
    texts = {"clock": "48MHz", "lines": "500", "electrical": "7", "max-time": "120us", "max-speed": "3000rad/s"}
    texts |= dict(word.split("=") for word in words.split())
    return with_axes(of_texts("track", texts), axes, parallel=parallel)


SPECS = {
    "two machines": core(3, "tick=720clk unit=rpm index=yes index-reset=yes filter=3clk lead=1.5tick"),
    "held": core(2, "tick=960clk index=yes electrical-offset=30deg", parallel=True),
    "serial, external": core(1, "tick=1920clk max-time=80us multiplier=serial external-tick=yes"),
}


@pytest.mark.parametrize("case", only(["two machines", "held"], SPECS))
def test_gates_and_golden_model_agree(case: str, tmp_path: Path) -> None:
    spec = SPECS[case]
    trace = motions(spec, 12 * spec.timing.tick_cycles)
    expected = golden.run(spec, trace)
    count, first = compare(expected, run_in_icarus(spec, tmp_path, trace))
    assert (count, spec.plan.machines) == (0, 1 + (case == "two machines")), first
    name = "angle_1" if spec.parallel else "angle"
    assert len(np.unique(expected.ticks[name])) > 3
    assert expected.ticks[name.replace("angle", "angle_valid")].any() == bool(spec.tachometer.index)


@nightly
def test_registers_show_the_angle_of_each_axis() -> None:
    spec = SPECS["held"]
    registers, trace = AxesMap(spec.tachometer, spec), motions(spec, 4000)
    assert {"ANGLE_0", "ANGLE_1"} < {one.name for one in registers}
    assert [field.name for field in registers.settings if "angle" in field.name] == []
    played, bank = random_accesses(registers, 4, trace.n_clocks), GoldenAxesBank(registers, trace)
    assert differing(AxesRegisterCore(registers), trace, played, bank) == []


@pytest.mark.parametrize(("axes", "lead"), only_rows([(3, "1.5tick")], [(3, "1.5tick"), (32, "0clk")]))
def test_the_angle_is_that_of_each_motor_at_its_use(axes: int, lead: str) -> None:
    """Of real discs, for the first axis and the last; all have the zero of the index."""
    words = f"tick=100us lines=1000 max-time=100ms index=yes max-speed=6000rpm lead={lead}"
    spec, moved, means = core(axes, words), parse_motion("constant:217rad/s:100ms"), []
    discs = [
        VirtualEncoder(1000, phase_error_deg=10, nonuniformity=0.1, jitter=0.05, seed=11 + k, index=True)
        for k in (0, 1)
    ]
    recordings = [discs[axis == axes - 1].record(moved).recording for axis in range(axes)]
    run = golden.run(spec, AxesTrace.placed(recordings, spec))
    for axis in (0, axes - 1):
        ticks = of_axis(spec, run, axis).ticks
        ticks = ticks.rows((ticks.clock > 40e-3 * 48e6) & (ticks.clock < 99e-3 * 48e6))
        ahead: Any = 7200 if lead == "1.5tick" else 0
        error = ticks.angle * 360 / 65536 - 7 * np.degrees(moved.angle((ticks.clock + ahead) / 48e6))
        error = (error + 180) % 360 - 180
        assert np.std(error) < 0.004
        means.append(np.mean(error))
    assert abs(means[0] - means[1]) < 0.003
    assert abs(means[0]) < 2  # where the index lies in its state


def test_refusals() -> None:
    for method, more, text in (
        ("track", {"sincos": "yes"}, "electrical does not work with both --axes and --sincos"),
        ("s", {}, "electrical must be given together with --method track if there are --axes"),
    ):
        with pytest.raises(ValueError, match=text):
            with_axes(
                of_texts(method, {"clock": "48MHz", "lines": "500", "electrical": "7", **more}), 2, parallel=False
            )


@nightly
@pytest.mark.parametrize(
    ("text", "wrong", "case"),
    [
        ("zeroes = rises | ~ready", "zeroes = ~ready", "held"),
        ("zeroes = rises | ~ready", "zeroes = rises", "held"),
        ("rises | (ready", "(rises & ready", "held"),
        ("+ extra.offset", "+ 0", "held"),
        ("late + extra.ahead for", "late for", "two machines"),
        ("(end >> 1) - late", "end - late", "two machines"),
        ("hands.en.eq(complete)", "hands.en.eq(1)", "held"),
        ("self.position << fine_bits", "0", "two machines"),
    ],
)
def test_wrong_gates_are_seen(text: str, wrong: str, case: str) -> None:
    spec = SPECS[case]
    with mutant(electrical_in_turn.Gates, text, wrong):
        assert lockstep(spec, motions(spec, 12 * spec.timing.tick_cycles), PySim()).n_mismatches
