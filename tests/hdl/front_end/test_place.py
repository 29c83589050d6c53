"""A position that is set, an index that is taken once, and a position modulo a number."""

import math
from fractions import Fraction
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hdl.bus.test_bank import differing
from support.simulate import clock_by_clock
from support.verilog import run_in_icarus

from tachometry.hdl.core import register_core
from tachometry.hdl.front_end import modulo_counter, position_counter
from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.signals.run import compare
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.registers.map import RegisterMap

BASE = {"ppr": "8", "clock": "1MHz", "tick": "40us", "max-time": "400us"}
CASES = (
    {"preset": "-7", "index": "yes", "health": "yes", "health-errors": "9"},
    {"preset": "99", "index": "yes", "index-reset": "yes", "index-once": "yes", "filter": "2"},
    {"preset": "-3", "position-modulo": "7", "index": "yes", "index-reset": "yes", "position-compare": "2:3:0:1clk"},
    {"position-modulo": "rev", "index": "yes", "index-once": "yes", "position-width": "8"},
    {"position-modulo": "rev/3", "index": "yes", "index-reset": "yes"},
)


def spec_of(texts: dict[str, str], method: str = "s") -> TachometerSpec:
    return of_texts(method, BASE | texts)


def test_no_count_is_lost_by_a_load_and_a_modulus_is_right_both_ways() -> None:
    """Load every value of four bits, and count modulo 5 and 8, with every step in the clock of it and after it."""
    rows = []
    for value, *steps in product(range(-8, 8), (-1, 0, 1), (-1, 0, 1)):
        rows += [{"load": 0, "step": steps[0], "value": value}, {"load": 1, "step": steps[1], "value": value}]
    seen = clock_by_clock(position_counter.PositionCounter(4, preset=0), rows, ["position"])
    late, position = 0, 0  # a step is in the position a clock later than a load
    for row, shown in zip(rows, seen, strict=True):
        assert shown["position"] == position
        position = ((row["value"] if row["load"] else position) + late + 8) % 16 - 8
        late = row["step"]
    for modulus in (5, 8, Fraction(16, 3), Fraction(23, 10)):
        rng = np.random.default_rng(int(modulus))
        turns = [{"step": int(step), "clear": int(rng.random() < 0.03)} for step in rng.integers(-1, 2, 400)]
        counted = clock_by_clock(modulo_counter.ModuloCounter(modulus), turns, ["count"])
        late, place, ends = 0, 0, set[int]()
        for row, shown in zip(turns, counted, strict=True):
            count = place - math.ceil(place // modulus * modulus)
            assert shown["count"] == count
            ends |= {late} & {-1 if count == 0 else 1 if count >= modulus - 1 else 0}
            place = 0 if row["clear"] else place + late
            late = row["step"]
        assert ends >= {-1, 1}


@pytest.mark.parametrize("texts", CASES)
def test_hardware_does_as_the_golden_model(texts: dict[str, str]) -> None:
    spec = spec_of(texts)
    found = lockstep(spec, stress(spec, 1, 8), PySim())
    assert found.n_mismatches == 0, found.first


def test_exported_verilog_does_in_icarus(tmp_path: Path) -> None:
    spec = spec_of(CASES[1] | {"position-modulo": "rev/4"})
    trace = stress(spec, 4, 40)
    assert compare(golden.run(spec, trace), run_in_icarus(spec, tmp_path, trace)) == (0, [])


def turning(quarters: int, apart: int = 10) -> PinTrace:
    """Return a shaft that turns forward, with an index in each of 32 counts."""
    place = np.arange(quarters)
    level = quadrature(place)
    z = (place % 32 == 3).astype(np.uint8)
    return PinTrace(place * apart, level & np.uint8(1), level >> np.uint8(1), quarters * apart, z)


def test_a_preset_in_the_clock_of_an_index_spoils_the_turn_before() -> None:
    """It does not spoil the turn after; every second turn has a preset, in each of the clocks about its index."""
    trace = turning(32 * 14, 4).with_pulses("preset", np.array([256 * nth + 137 + nth for nth in range(7)]))
    found = lockstep(spec_of(CASES[0]), trace, PySim())
    assert found.n_mismatches == 0, found.first


@pytest.mark.parametrize("method", ["s", "mt", "track"])
def test_a_preset_moves_the_position_alone_and_by_no_count_too_many(method: str) -> None:
    texts = {"preset": "1000", "position-modulo": "32", "tick": "1ms", "max-time": "20ms"}
    spec, plain = spec_of(texts, method), turning(4000)
    shown = []
    for rises in ([], [20_000]):  # in the clock of an edge
        shown.append(golden.run(spec, plain.with_pulses("preset", np.array(rises, dtype=np.int64))))
    still, moved = shown
    for strobe, table in still.tables.items():
        other = moved.tables[strobe]
        assert np.array_equal(table.clock, other.clock)
        for name, column in table.columns.items():
            off = other[name].astype(np.int64) - column
            if name.startswith("position") and name != "position_modulo":
                size = 1 << getattr(spec, "position_fine_bits", 0) * (name == "position_fine")
                # 2000 edges came before, the step in the clock of the preset is still added.
                assert {*off.tolist()} == {0, (1000 - 1999) * size}, name
                assert np.count_nonzero(np.diff(off)) == 1
            else:
                assert not off.any(), name
    assert np.array_equal(still.ticks.position_modulo, still.ticks.position % 32)


def test_the_index_is_taken_once_after_each_time_that_it_is_asked_for() -> None:
    spec = spec_of({"index": "yes", "index-at": "edge", "index-once": "yes", "index-reset": "yes"})
    trace = turning(1000).with_pulses("home", np.array([1000, 2400, 2500]))
    run = golden.run(spec, trace)
    at = [(first * 32 + 3) * 10 + spec.latency.pin_to_count + spec.latency.tick for first in (4, 8)]
    assert run.index.clock.tolist() == at
    armed = [clock + spec.latency.pin_to_count + spec.latency.tick for clock in (1000, 2400)]
    clock = run.ticks.clock
    assert np.array_equal(run.ticks.homed, ((clock >= at[0]) & (clock < armed[1])) | (clock >= at[1]))
    latest = int(clock[-1]) - spec.latency.pin_to_count - spec.latency.tick
    assert run.ticks.position[-1] == latest // 10 - 8 * 32 - 3


def check_registers(spec: TachometerSpec, seed: int) -> None:
    """Write presets, offsets and CONTROL, and read what the core shows, on the native port."""
    registers, n_clocks, rng = RegisterMap(spec), 2500, np.random.default_rng(seed)
    trace = stress(spec, seed, 20).until(n_clocks)
    writable = [number for number, one in enumerate(registers) if one.writable]
    accesses = []
    for clock in np.flatnonzero(rng.random(n_clocks - 1) < 0.3).tolist():
        writes = rng.random() < 0.2
        address = int(rng.choice(writable)) if writes else int(rng.integers(len(registers.registers)))
        data = int(rng.integers(1 << 32)) & (0xFFFF_FFFD if registers.registers[address].name == "CONTROL" else -1)
        accesses.append(Access(clock, address, data if writes else None))
    assert differing(register_core.RegisterCore(registers), trace, (accesses, []), GoldenBank(registers, trace)) == []


@pytest.mark.parametrize("texts", [CASES[2] | {"position-width": "48"}, CASES[3] | {"preset": "-5"}])
def test_registers_set_the_position_and_let_the_index_through(texts: dict[str, str]) -> None:
    check_registers(spec_of(texts), 1)
