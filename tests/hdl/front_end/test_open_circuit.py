"""Lines that equal their complements: for how long they may, and what is told of it."""

from pathlib import Path

import pytest
from hdl.front_end.test_place import check_registers
from support.simulate import clock_by_clock
from support.verilog import run_in_icarus

from tachometry.hdl.front_end import open_circuit
from tachometry.sim import golden
from tachometry.sim.encoder.imperfections import LineFault
from tachometry.sim.encoder.stress import stress
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.run import compare
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import ParameterError, TachometerSpec, of_texts

BASE = {"ppr": "8", "clock": "1MHz", "tick": "40us", "max-time": "400us", "health": "yes", "health-edges": "900"}


def spec_of(texts: dict[str, str]) -> TachometerSpec:
    return of_texts("m", BASE | {"health-errors": "900"} | texts)


def test_each_length_is_told_once_until_it_is_cleared() -> None:
    """Every length up to twice what is allowed, each cleared in every clock of it and not at all."""
    for clocks in (2, 5):
        rows, wanted = [], []
        for length in range(2 * clocks + 4):
            for cleared in range(length + 1):
                since = 0
                for clock in range(length + 1):
                    equal, clear = clock < length, clock == cleared and cleared < length
                    rows.append({"equal": int(equal), "clear": int(clear)})
                    since += equal
                    wanted.append({"open": int(equal and since == clocks + 1)})
                    since *= equal and not clear
        assert [*clock_by_clock(open_circuit.OpenCircuit(clocks), rows, ["open"])] == wanted


CASES: tuple[dict[str, str], ...] = (
    {"complements": "3", "index": "yes", "filter": "2"},
    {"complements": "2", "invert": "a"},
)


@pytest.mark.parametrize("texts", CASES)
def test_hardware_does_as_the_golden_model(texts: dict[str, str]) -> None:
    spec = spec_of(texts)
    found = lockstep(spec, stress(spec, 1, 12), PySim())
    assert found.n_mismatches == 0, found.first
    assert found.actual.ticks.health[-1] in (5, 6, 7)


def test_registers_show_what_lasts_again_when_they_are_cleared() -> None:
    check_registers(BASE | CASES[0], 3)


def test_exported_verilog_does_in_icarus(tmp_path: Path) -> None:
    spec = spec_of(CASES[0])
    trace = stress(spec, 4, 12)
    assert compare(golden.run(spec, trace), run_in_icarus(spec, tmp_path, trace)) == (0, [])


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        ({"complements": "1"}, "complements must be from 2us to 1.048576s at this clock, not 1us"),
        ({"complements": "0"}, "complements must be from 2us to 1.048576s at this clock, not 0s"),
        ({"complements": "soon"}, "complements must be"),
    ],
)
def test_what_cannot_be(texts: dict[str, str], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        spec_of(texts)


def test_complements_are_watched_with_health() -> None:
    with pytest.raises(ParameterError, match="complements must be given together with --health"):
        of_texts("m", {"ppr": "8", "clock": "1MHz", "complements": "1us"})


def test_an_encoder_without_complements_breaks_none() -> None:
    with pytest.raises(ParameterError, match="must not be of a_n without --complements"):
        VirtualEncoder(8, broken=LineFault("a_n", 0.1))
