"""The SystemRDL against the gates: what it says of each register and field is what the simulated core does.

Offsets, bits, accesses and resets come from the text alone, as its compiler reads it. What a register of this name must
show comes from the golden bank.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from support.random_case import random_case
from support.rdl import read_rdl
from support.simulate import clock_by_clock
from systemrdl.node import RegNode

from tachometry.hdl.core import register_core
from tachometry.hdl.export.registers.files import register_files
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec.registers.map import RegisterMap

# Among them every register and every field shows something else than after reset.
CASES = [("rairan", 6), ("m", 21), ("s", 1), ("rairan", 9), ("m", 1), ("s", 5), ("t", 5)]
WIDE = ("m", 1)  # its velocity takes two registers, and its index is anywhere
BACKWARD = ("s", 5)  # its positions take two registers, and a turn is wrong by less than 0
ROUND = 160
ONES = (1 << 32) - 1


@cache
def case(method: str, seed: int) -> tuple[RegisterMap, PinTrace, list[dict[str, int]]]:
    """Return a random core, its pins, and these as rows of clocks."""
    spec, _, trace = random_case(seed, method)
    if (method, seed) == WIDE:
        spec = replace(spec, velocity_width=40)
        toggles = np.random.default_rng(seed).random(len(trace.clock)) < 0.2
        trace = replace(trace, z=(np.cumsum(toggles) & 1).astype(np.uint8))
    if (method, seed) == BACKWARD:
        spec = replace(spec, position_width=40, encoder=replace(spec.encoder, reverse=not spec.encoder.reverse))
    n_clocks = min(trace.n_clocks, 1650)
    rows: list[dict[str, int]] = [{"bus.read": 0, "bus.write": 0} for _ in range(n_clocks)]
    for clock, *levels in zip(trace.clock.tolist(), *(trace.lines[pin.name] for pin in spec.ports.pins), strict=True):
        if clock < n_clocks:
            rows[clock] |= {pin.name: int(level) for pin, level in zip(spec.ports.pins, levels, strict=True)}
    registers = RegisterMap(spec, irq=True)
    return registers, PinTrace(trace.clock, trace.a, trace.b, n_clocks, trace.z, trace.tick_in), rows


def plan(registers: list[RegNode], n_clocks: int) -> list[tuple[int, RegNode, int | None]]:
    """Return clocks, registers and what is written: resets, writes of every register, and then rounds of reads."""
    # From the last to the first: what a capture takes is 0 until the first of it is read.
    found: list[tuple[int, RegNode, int | None]] = [(clock, one, None) for clock, one in enumerate(registers[::-1], 1)]
    steps = [(one, data) for one in registers for data in (ONES, None, 0, None)]
    found += [(clock, *step) for clock, step in enumerate(steps, ROUND)]  # there are updates by then
    for start in range(2 * ROUND, n_clocks - len(registers) - 4, ROUND):
        found += [(start + place, one, None) for place, one in enumerate(registers)]
    return found


def check(method: str, seed: int, folder: Path) -> tuple[set[str], set[str]]:
    """Return the fields of one core, and those of them that showed something else than after reset."""
    registers, trace, pins = case(method, seed)
    text = register_files(registers, "core")["core.rdl"]
    top = read_rdl(text, folder)
    accesses = plan(list(top.registers()), len(pins))
    rows = [dict(row) for row in pins]
    for clock, one, data in accesses:
        kind = {"bus.read": 1} if data is None else {"bus.write": 1, "bus.write_data": data}
        rows[clock] |= {"bus.address": one.absolute_address // 4, **kind}
    seen = clock_by_clock(register_core.RegisterCore(registers), rows, ["bus.read_data", "bus.error"])
    golden = GoldenBank(registers, trace).answers(
        [Access(clock, registers[one.inst_name].offset // 4, data) for clock, one, data in accesses]
    )
    moved, written = set(), dict.fromkeys((one.inst_name for one in top.registers()), 0)
    for (clock, one, data), (expected, error) in zip(accesses, golden, strict=True):
        row, where = seen[clock + 1], f"{method}, seed {seed}, clock {clock}, {one.inst_name}"
        assert bool(row["bus.error"]) == error == (data is not None and not one.has_sw_writable), where
        if data is not None:
            written[one.inst_name] = data
            continue
        word = row["bus.read_data"]
        for field in one.fields():
            (meant,) = (each for each in registers[one.inst_name].fields if each.name == field.inst_name)
            value, mask = word >> field.low & (1 << field.width) - 1, (1 << field.width) - 1
            name = f"{one.inst_name}.{field.inst_name}"
            reset = field.get_property("reset")
            word &= ~(mask << field.low)
            if field.is_sw_writable:
                assert value == (written[one.inst_name] >> field.low & mask) * field.is_sw_readable, (where, name)
                moved.add(name)
            elif not field.is_hw_writable:
                assert value == reset, (where, name)
                moved.add(name)
            elif expected is not None:
                assert value == (expected & meant.mask) >> meant.low, (where, name)
                assert not (one.has_sw_writable and value == mask), (where, name)  # it is not what was written
                assert value == reset or clock >= ROUND or one.inst_name == "COUNTERS", (where, name)
                moved |= {name} if value != reset else set()
        assert word == 0, where
    return {f"{one.inst_name}.{field.inst_name}" for one in top.registers() for field in one.fields()}, moved


def test_every_register_and_field_is_checked_on_the_core(tmp_path: Path) -> None:
    """A field that no case moves has no check, and fails."""
    fields, moved = set[str](), set[str]()
    for method, seed in CASES:
        of_core, of_run = check(method, seed, tmp_path)
        fields |= of_core
        moved |= of_run
    assert fields - moved == set()
    assert {
        "POSITION_HIGH.value",
        "VELOCITY_HIGH.value",
        "STATUS.velocity_overflow",
        "COUNTERS.tick_errors",
        "DT_SHIFT.value",
    } <= fields
    assert {"INDEX_POSITION_HIGH.value", "STATUS.out_of_range", "N_EP1.value", "FILTERED_EDGES.value"} <= fields
