"""`--smooth`: the velocity in the middle of the memory, and how long ago that was."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from amaranth import Module, Signal
from amaranth.sim import Simulator
from extras.harness import Case
from support.axes import motions
from support.nightly import nightly, only
from support.tracking import Interpreter, core, windows
from support.verilog import run_in_icarus

from tachometry.hdl.methods import track
from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.golden.methods.track import rows
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import compare
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import AxesSpec, of_options, of_texts
from tachometry.spec.formats import tracking_code
from tachometry.spec.formats.tracking_listing import LISTING
from tachometry.spec.registers.map import RegisterMap

SMOOTH = tracking_code.SMOOTH
TICK, QUICK = "tick=2000clk max-time=8000clk", "tick=400clk max-time=8000clk"
CASES = (
    Case("track", f"smooth=yes {TICK}", edges=200, clocks=60_000),
    Case("track", f"smooth=yes multiplier=block unit=rpm lowpass=200Hz {TICK}", edges=200, clocks=60_000),
    Case("track", f"smooth=yes multiplier=block unit=count/tick velocity-width=12 {QUICK}", edges=200, clocks=30_000),
)


# The last is played in Icarus.
@pytest.mark.parametrize("case", only(CASES[:1], CASES), ids=lambda case: case.words)
def test_gates_and_golden_model_agree(case: Case) -> None:
    """No other output differs from that of the core without."""
    spec, updates = case.spec, case.run().updates
    assert of_options(spec.options) == spec
    assert np.mean(updates.velocity_smooth != 0) > 0.5
    assert len(np.unique(updates.smooth_delay)) > 20
    names = {field.port for register in RegisterMap(spec) for field in register.fields}
    assert names >= {*SMOOTH}
    alone = Case("track", case.words.replace("smooth=yes", "multiplier=serial", "multiplier" not in case.words)).spec
    run = golden.run(alone, case.trace())
    for strobe, table in run.tables.items():
        assert all((case.run().tables[strobe][name] == column).all() for name, column in table.columns.items())


def test_the_exported_verilog_agrees(tmp_path: Path) -> None:
    case = CASES[2]
    assert compare(golden.run(case.spec, case.trace()), run_in_icarus(case.spec, tmp_path, case.trace())) == (0, [])


def test_many_axes_have_it() -> None:
    """In rounds, of which each is a clock of its axis."""
    texts = {"lines": "500", "clock": "48MHz", "tick": "1000clk", "max-time": "8000clk", "max-speed": "3000rad/s"}
    alone: Any = of_texts("track", texts | {"smooth": "yes"})
    spec = AxesSpec(tachometer=alone, axes=3)
    assert spec.plan.machines == 1
    found = lockstep(spec, motions(spec, 40_000), Cxxrtl())
    assert found.n_mismatches == 0, found.first
    assert found.expected.updates.velocity_smooth.any()
    assert [port.unit for port in spec.ports if port.name == "smooth_delay"] == [f"{spec.slots} clocks"]


FAULTS = (
    ("smooth of_v = v s- ~", "smooth of_v = v s+ ~"),
    ("smooth T over 1", "smooth T over 2"),
    ("of_e = ahead + ~ ", "of_e = zero + ~ "),
    ("smooth tick by", "smooth since by"),
    ("smooth of_v = ~ min most_shown max least_shown\n", "smooth of_v = ~\n"),
    ("zero\n    smooth sum out smooth_delay", "zero\n    smooth one out smooth_delay"),  # at rest
    ("zero + zero out", "zero + one out"),  # with the second count
    ("$moved\n    smooth since + of_e", "$moved\n    smooth tau + of_e"),
    ("place_64; smooth since + of_e", "place_64; smooth tau + of_e"),
    ("raw - moved\n    smooth since + of_e", "raw - moved\n    smooth tau + of_e"),
    ("nothing\n    smooth since + of_e", "nothing\n    smooth quiet + of_e"),  # in a silence
)


def differs(spec: Any) -> bool:
    """Return whether the program of a core shows something else than the golden model, in any tick of two motions."""
    columns = ("velocity", "position_fine", "velocity_std", "acceleration", "standstill", *SMOOTH)
    assert spec.program.outputs == columns
    for seed in (2, 3):
        model, machine, ticks = rows(spec.form, spec.program.ahead), Interpreter(spec.program), windows(spec, seed, 800)
        if any(machine.tick(*row) != tuple(right) for row, right in zip(ticks.rows(), model(ticks), strict=True)):
            return True
    return False


@pytest.mark.parametrize("multiplier", only(["block"], ["serial", "block"]))  # of which each is another order
def test_the_program_agrees_with_the_golden_model(multiplier: str) -> None:
    assert not differs(core(smooth="yes", tick="100us", max_speed="1000rad/s", multiplier=multiplier))


@nightly
@pytest.mark.parametrize(("text", "wrong"), FAULTS)
def test_a_wrong_program_is_seen(text: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert LISTING.count(text) == 1
    made = partial(tracking_code.assembled, LISTING.replace(text, wrong))
    monkeypatch.setattr(tracking_code, "assembled", made)
    tracking_code._longest.cache_clear()
    assert differs(core(smooth="yes", tick="100us", max_speed="1000rad/s"))
    tracking_code._longest.cache_clear()


@nightly
def test_wrong_gates_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(track, "delay_of", lambda shown, time_bits: shown)
    assert lockstep(CASES[2].spec, CASES[2].trace(), Cxxrtl()).n_mismatches


def test_a_delay_is_held_at_the_greatest_of_its_port() -> None:
    m, clocks, delay = Module(), Signal(42), Signal(32)
    m.d.comb += delay.eq(track.delay_of(clocks, 2))

    async def held(ctx: Any) -> None:
        for one in (0, 5, 2**32 - 2, 2**32 - 1, 2**32, 2**32 + 5, 2**37, 2**39):
            ctx.set(clocks, one * 4 + 3)
            assert ctx.get(delay) == min(one, 2**32 - 1)

    simulator = Simulator(m)
    simulator.add_testbench(held)
    simulator.run()


@pytest.mark.parametrize("motion", ["sine:50rad/s:5Hz:500ms", "sine:300rad/s:20Hz:200ms"])
def test_the_error_at_that_time_is_a_quarter(motion: str) -> None:
    """Of a real disc, in motions whose speed changes; seeds are others than those of measured pages."""
    spec = of_texts("track", {"lines": "500", "clock": "48MHz", "tick": "20us", "smooth": "yes"})
    moved, wrong = parse_motion(motion), []
    for seed in (71, 72):
        disc = VirtualEncoder(500, phase_error_deg=10, nonuniformity=0.1, jitter=0.05, seed=seed)
        updates = golden.run(spec, PinTrace.of(disc.record(moved).recording, spec)).updates.rows(slice(2000, None))
        delays = np.column_stack((np.zeros(len(updates)), updates.smooth_delay))
        truth = moved.speed((updates.clock[:, None] - delays) / spec.timing.clock_hz)
        shown = np.column_stack((updates.velocity, updates.velocity_smooth)) * spec.velocity.rad_per_s_per_lsb
        wrong.append(np.mean((shown - truth) ** 2, axis=0))
    now, smooth = np.sqrt(np.mean(wrong, axis=0))
    assert 3.5 * smooth < now
