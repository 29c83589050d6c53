"""Estimates of cells and greatest clock: of small netlists by hand, and of cores beside those that nextpnr made."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
import size
from cores import CONFIGURATIONS
from support.nightly import nightly

from tachometry.sim.studies import estimate
from tachometry.sim.studies.estimate import FAMILIES, SPREAD, Estimate, Timing, flip_flops
from tachometry.sim.studies.mapping import ECP5, GOWIN, ICE40, Fabric, Logic, Mapped
from tachometry.sim.studies.size import TARGETS
from tachometry.spec import AxesSpec, STachometer, of_options, of_texts
from tachometry.spec.registers.buses import bus_of

pytestmark = pytest.mark.usefixtures("mapped")
LEVELS = Timing(0, 0, 0, 1, 0, 0, 0, 0, 100, 0, 0)  # a period is the number of tables on the longest path
CORE = {"ppr": "500", "max-speed": "1000rad/s", "tick": "20us", "max-time": "10ms"}


def mapped(fabric: Fabric, cells: Sequence[Mapping[str, Any]], output: list[int]) -> Mapped:
    ports = {"o": {"direction": "output", "bits": output}}
    each = [{"parameters": {}, "attributes": {}, **cell} for cell in cells]
    return Mapped(Logic({"ports": ports, "cells": dict(enumerate(each))}, fabric))


def gate(kind: str, a: int, b: int, y: int) -> dict[str, Any]:
    return {"type": kind, "connections": {"A": [a], "B": [b], "Y": [y]}}


def add(kind: str, a: list[int], b: list[int], y: list[int]) -> dict[str, Any]:
    signs = {"A_SIGNED": "0", "B_SIGNED": "0"}
    return {"type": kind, "connections": {"A": a, "B": b, "Y": y}, "parameters": signs}


def memory(words: int, width: int, **pins: list[int]) -> dict[str, Any]:
    numbers = {"SIZE": words, "WIDTH": width, "RD_PORTS": 1, "RD_CLK_ENABLE": 1}
    address = [*range(2, 2 + (words - 1).bit_length())]
    return {
        "type": "$mem_v2",
        "parameters": {name: f"{number:b}" for name, number in numbers.items()},
        "connections": {"RD_ADDR": address, "RD_DATA": [*range(100, 100 + width)], "WR_DATA": [], **pins},
    }


def test_a_wire_to_many_flip_flops_takes_time() -> None:
    times = LEVELS._replace(end=10)
    held = [{"type": "$_DFFE_PP_", "connections": {"D": [2], "E": [64], "Q": [70 + k]}} for k in range(4)]
    table = gate("$_AND_", 2, 3, 64)
    assert [times.period(mapped(ICE40, [table, *held[:n]], [71])) for n in (1, 2, 4)] == [1, 11, 21]


def test_a_chain_of_gates_becomes_a_tree_of_tables() -> None:
    """Sixteen bits take five tables of four inputs, two on any path; XOR of AND cannot be put in another order."""
    chain = [gate("$_AND_", 2, 3, 50), *(gate("$_AND_", 48 + k, 2 + k, 49 + k) for k in range(2, 16))]
    found = mapped(ICE40, chain, [64])
    assert (len(found.tables), LEVELS.period(found)) == (5, 2)
    turns = [gate(("$_AND_", "$_XOR_")[k % 2], 50 + k, 2 + k, 51 + k) for k in range(6)]
    found = mapped(ICE40, turns, [56])
    assert (len(found.tables), LEVELS.period(found)) == (2, 2)
    assert len(mapped(ECP5, turns[:4], [54]).tables) == 1  # of five inputs


def test_sums_are_carry_chains_but_for_short_ones() -> None:
    a, b, y = ([*range(start, start + 8)] for start in (2, 12, 22))
    found = mapped(ECP5, [add("$add", a, b, y)], y)
    assert (found.logic.chains, len(found.tables)) == ([8], 0)
    found = mapped(ECP5, [add("$sub", a[:3], b[:3], y[:3])], y[:3])
    assert (found.logic.chains, len(found.tables)) == ([], 3)
    found = mapped(ECP5, [add("$lt", a, b, y[:1])], y[:1])
    assert (found.logic.chains, len(found.tables)) == ([8], 0)
    wide = {**add("$neg", a, [], y), "connections": {"A": a, "Y": [*y, *range(30, 38)]}}
    minus = mapped(ECP5, [wide], [37]).logic
    assert (minus.chains, minus.nodes[37]) == ([9], ("gate", (30,)))  # bits above are its sign again


def test_sums_of_sums_are_one_chain() -> None:
    """Three summands take a table for each bit and each carry but the last; one of a bit is the first carry."""
    a, b, c, y, z = ([*range(start, start + 8)] for start in (2, 12, 22, 32, 42))
    inner = add("$add", a, b, y)
    for last, tables in ((c, 15), ([22], 0)):
        found = mapped(ECP5, [inner, add("$sub", y, last, z)], z)
        assert (found.logic.chains, len(found.tables)) == ([8], tables)
    assert mapped(ECP5, [inner, add("$add", y, c, z)], [*z, y[0]]).logic.chains == [8, 8]
    outer = add("$add", y, c, [*range(60, 69)])
    assert mapped(ECP5, [inner, outer], [68]).logic.chains == [8, 9]  # the inner sum may overflow
    wide = add("$add", a, b, [*y, 50])
    found = mapped(ECP5, [wide, add("$add", [*y, 50], c, [*range(60, 70)])], [69])
    assert found.logic.chains == [10]
    four = add("$add", z, [*range(70, 78)], [*range(80, 88)])
    assert mapped(ECP5, [inner, add("$add", y, c, z), four], [87]).logic.chains == [8, 8]  # two first, then the rest


def test_memories_are_blocks_tables_or_constants() -> None:
    constants = mapped(ECP5, [memory(16, 5)], [*range(100, 105)])
    assert (len(constants.tables), len(constants.logic.flip_flops), constants.logic.late) == (5, 5, set())
    written = mapped(ECP5, [memory(16, 5, WR_DATA=[90])], [*range(100, 105)])
    assert (written.logic.small, written.logic.late) == ([(1, 5)], set())
    block = mapped(ECP5, [memory(1024, 18)], [*range(100, 118)])
    assert (len(block.logic.late), LEVELS.period(block)) == (18, 100)
    assert mapped(ECP5, [memory(64, 32)], [*range(100, 132)]).logic.late == set()  # as many bits as a block counts
    moving = [mapped(ECP5, [memory(63, width, WR_DATA=[90])], [100]).logic for width in (20, 22)]
    assert [(logic.small, len(logic.late)) for logic in moving] == [([(4, 20)], 0), ([], 22)]  # costs of 110 and 129
    assert mapped(GOWIN, [memory(63, 22, WR_DATA=[90])], [100]).logic.small == [(4, 22)]  # no bit is paid for in vain
    narrow, wide = (mapped(ICE40, [memory(*size, WR_DATA=[90])], [100]) for size in ((5, 16), (2, 82)))
    assert (len(narrow.logic.late), narrow.logic.small) == (16, [])
    assert (wide.logic.late, wide.logic.small, flip_flops(wide)) == (set(), [(2, 82)], 246)  # six blocks would be more


def test_what_is_not_known_is_not_left_out() -> None:
    with pytest.raises(ValueError, match=r"\$div"):
        mapped(ECP5, [{"type": "$div", "connections": {}}], [])


@pytest.mark.parametrize("name", ["reference", "track", "bus-apb"])
def test_estimates_are_near_what_was_measured(name: str) -> None:
    rows = size.kept(size.PAGE, {})
    (core,) = (one for one in CONFIGURATIONS if one.name == name)
    families = {about.target.device: family for family, about in FAMILIES.items()}
    for device, target in TARGETS.items():
        if row := rows.get((name, device)):
            family = families[target.device]
            found, figures = Estimate.of(core.spec, bus_of(core.bus), family), row.figures
            assert found.cells == pytest.approx(figures.get("COMB", figures.get("LC")), rel=0.2), family
            assert found.flip_flops == pytest.approx(figures.get("FF", found.flip_flops), rel=0.05)
            if "Fmax" in figures:
                assert found.clock_hz == pytest.approx(1e6 * figures["Fmax"], rel=0.2), family


def test_estimates_of_gowin_are_near_what_nextpnr_packed() -> None:
    """Its small memories have flip-flops for reads during writes."""
    options = {"cpr": "1024", "clock": "48MHz", "tick": "20us", "max-time": "10ms", "average": "4"}
    found = Estimate.of(of_texts("m", options), None, "gowin")
    assert found.cells == pytest.approx(162, rel=0.1)
    assert found.flip_flops == pytest.approx(155, rel=0.05)


def test_a_clock_out_of_reach_has_the_first_remedy_that_reaches_it(monkeypatch: pytest.MonkeyPatch) -> None:
    speeds = {"track": 90e6, "mt": 120e6, "s": 130e6, "t": 140e6}

    def known(spec: Any, bus: object, family: str) -> Estimate:
        return Estimate(family, 1, 1, speeds[spec.method], spec.timing.clock_hz)

    monkeypatch.setattr(estimate, "_estimate", known)
    found = Estimate.of(of_texts("track", {**CORE, "clock": "125MHz"}), None, "ecp5")
    assert found.is_too_slow
    assert found.remedy == ("--method s", 130e6)


def test_a_core_is_synthesised_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TACHOMETRY_CACHE", str(tmp_path))
    found = [Estimate.of(of_texts("s", CORE), None, family) for family in ("ecp5", "ice40hx")]
    monkeypatch.setenv("TACHOMETRY_CACHE", "/proc/none")  # does without
    assert Estimate.of(of_texts("s", CORE), None, "ecp5") == found[0]
    monkeypatch.setenv("TACHOMETRY_CACHE", str(tmp_path))
    monkeypatch.setattr(estimate, "mapped", None)
    assert [Estimate.of(of_texts("s", CORE), None, one.family) for one in found] == found
    assert found[0].cells != found[1].cells


def test_a_bus_and_axes_take_cells() -> None:
    spec = of_texts("s", CORE)
    assert isinstance(spec, STachometer)
    alone = Estimate.of(spec, None, "ecp5")
    on_bus = Estimate.of(spec, bus_of("apb"), "ecp5")
    axes = Estimate.of(AxesSpec(tachometer=spec, axes=8), None, "ecp5")
    assert alone.cells + 100 < on_bus.cells < alone.cells + 250
    assert alone.cells < axes.cells < 4 * alone.cells
    assert 0 < SPREAD < 0.1


DRIVE = {"lines": "1024", "clock": "125MHz", "max-speed": "6000rpm"}


def test_a_remedy_is_the_core_that_its_option_makes() -> None:
    """With the defaults of its method: the maximum time of tracking is ten times that of others."""
    found = Estimate.of(of_options(DRIVE | {"tick": "50us"}), None, "ecp5")
    assert found.remedy is not None
    option, method = found.remedy[0].split()
    other = Estimate.of(of_options(DRIVE | {"tick": "50us", option.removeprefix("--"): method}), None, "ecp5")
    assert found.remedy[1] == other.clock_hz > 125e6


@nightly  # another synthesis, to see that a core that is refused is none of them
def test_a_remedy_that_cannot_be_is_none() -> None:
    """A tick that has no time for the serial multiplier, in a core that is too slow with the other."""
    found = Estimate.of(of_options(DRIVE | {"tick": "6us"}), None, "ecp5")
    assert found.is_too_slow
    assert found.remedy is not None
    assert found.remedy[0].startswith("--method ")
