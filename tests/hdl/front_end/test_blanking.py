"""Edges that follow a counted one are ignored for a time: echoes, reed contacts, bounce."""

from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from support.nightly import nightly, only
from support.simulate import clock_by_clock
from support.verilog import run_in_icarus

from tachometry.hdl.core import tachometer
from tachometry.hdl.front_end.blanking import Blanking
from tachometry.sim import golden
from tachometry.sim.encoder.imperfections import Bounce
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.stress import stress
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.golden.front_end import blanked_line
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import compare
from tachometry.sim.studies.lockstep import lockstep
from tachometry.sim.studies.plan import default_range
from tachometry.spec import of_options, of_texts

BASE = {"ppr": "8", "clock": "1MHz", "tick": "40us", "max-time": "400us"}
CASES: dict[str, dict[str, str]] = {
    "quadrature": {"index": "yes", "filter": "2", "invert": "b"},
    "x1": {"decoding": "1"},
    "hall": {"sensor": "hall"},
    "pulses": {"sensor": "pulses", "decoding": "1", "invert": "a"},
    "step-dir": {"sensor": "step-dir"},
    "step-dir both": {"sensor": "step-dir", "decoding": "2"},
    "up-down": {"sensor": "up-down", "invert": "a"},
}


def definition(levels: list[int], clocks: int, starts: int | None) -> list[int]:
    """Return the levels that are shown, clock by clock."""
    shown, until = [levels[0]], 0
    for clock, level in enumerate(levels[1:], 1):
        shown.append(shown[-1] if clock < until else level)
        if shown[-1] != shown[-2] and starts in (None, shown[-1]):
            until = clock + clocks
    return shown


@pytest.mark.parametrize("starts", [None, 0, 1])
@pytest.mark.parametrize("clocks", [2, 3, 9, 16])
def test_random_levels_against_the_definition(clocks: int, starts: int | None) -> None:
    rng = np.random.default_rng([clocks, 5])
    levels = [int(k % 2) for k, run in enumerate(rng.integers(1, 25, size=200)) for _ in range(run)]
    rows = [{"ready": 0, "level": levels[0]}, *({"ready": 1, "level": level} for level in levels)]
    seen = clock_by_clock(Blanking(clocks, starts), [*rows, {}], ["held"])
    expected = definition(levels, clocks, starts)
    assert [row["held"] for row in seen[1:-1]] == expected
    changes = np.flatnonzero(np.diff(levels, prepend=1 - levels[0]))
    at, level = blanked_line(changes, np.array(levels, dtype=np.uint8)[changes], clocks, starts)
    assert level[np.searchsorted(at, np.arange(len(levels)), side="right") - 1].tolist() == expected


# Others have the same box at their lines.
@pytest.mark.parametrize("case", only(["quadrature", "step-dir both"], CASES))
def test_every_bit_of_stress(case: str) -> None:
    spec = of_texts("s", BASE | CASES[case] | {"blanking": "90"})
    trace = stress(spec, 1, 20)
    found = lockstep(spec, trace, PySim())
    assert found.n_mismatches == 0, found.first
    free = golden.run(of_texts("s", BASE | CASES[case]), trace)
    assert free.ticks.pulse_count.tolist() != found.actual.ticks.pulse_count.tolist()


@nightly
@pytest.mark.parametrize("case", CASES)
def test_wrong_gates_are_seen(case: str) -> None:
    spec = of_texts("s", BASE | CASES[case] | {"blanking": "90"})
    with patch.object(tachometer, "Blanking", lambda clocks, starts: Blanking(clocks // 2, starts)):
        assert lockstep(spec, stress(spec, 1, 40), PySim()).n_mismatches


def test_exported_verilog_in_icarus(tmp_path: Path) -> None:
    spec = of_texts("m", BASE | {"blanking": "25", "filter": "3"})
    trace = stress(spec, 2, 30)
    count, first = compare(golden.run(spec, trace), run_in_icarus(spec, tmp_path, trace))
    assert count == 0, first


def test_bounce_of_contacts_counts_once_and_without_delay() -> None:
    """The edge is that of the first contact: a filter of the same time would be as late."""
    texts = BASE | {"tick": "1ms", "max-time": "400ms", "blanking": "2ms"}
    for sensor in ({}, {"sensor": "pulses"}, {"sensor": "hall"}):
        spec = of_texts("m", texts | sensor)
        clean, bounced = (
            VirtualEncoder.of(spec.encoder, **more).record(parse_motion("ramp:0:10rad/s:2s"))
            for more in ({}, {"bounce": Bounce(4, 0.0015)})
        )
        runs = [golden.run(spec, PinTrace.of(each.recording, spec)) for each in (clean, bounced)]
        assert runs[0].ticks.position.tolist() == runs[1].ticks.position.tolist()
        assert runs[0].ticks.position[-1] == clean.true_position(2.0, spec.encoder.decoding)


def test_what_cannot_be_is_refused() -> None:
    for more, message in (
        ({"blanking": "1"}, "^blanking_clocks must be 0 or from 2 to 100000 clocks, 100ms, not 1$"),
        ({"blanking": "101ms"}, "^blanking_clocks must be 0 or from 2 to 100000 clocks, 100ms, not 101000$"),
        (
            {"blanking": "8ms", "max-speed": "10rev/s"},
            "^blanking_clocks must be at most 6.25ms, the time between edges ",
        ),
        ({"blanking": "2", "axes": "2", "method": "s"}, "^blanking_clocks must be left out with --axes: its timer "),
    ):
        with pytest.raises(ValueError, match=message):
            of_options(BASE | {"method": "m"} | more)
    spec = of_texts("m", BASE | {"blanking": "6250"})
    assert default_range(spec)[1] == pytest.approx(2 * np.pi * 10)
    assert spec.recovery.clocks is not None
