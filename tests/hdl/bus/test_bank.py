"""Registers against their golden model, on random motions with random accesses and captures."""

import numpy as np
import pytest
from support.lockstep import random_case
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.bus import counter
from tachometry.hdl.core import register_core
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import METHODS
from tachometry.spec.registers.map import RegisterMap

CLOCKS, SEEDS = 1500, range(6)


def random_accesses(registers: RegisterMap, seed: int, n_clocks: int) -> tuple[list[Access], list[int]]:
    """Return accesses and captures, some of them in clocks one after the other, some rare."""
    rng = np.random.default_rng(seed)
    clocks = np.flatnonzero(rng.random(n_clocks - 1) < rng.choice([0.03, 0.3, 1]))
    words = (1 << registers.address_width - 2) - 1
    velocity = next(one.offset for one in registers.registers if one.name.startswith("VELOCITY"))  # or its low word
    accesses = []
    for clock in clocks.tolist():
        address = int(rng.integers(words + 1)) if rng.random() < 0.7 else velocity // 4
        written = rng.random()
        if written < 0.02:
            address = registers["CONTROL"].offset // 4
        data = int(rng.integers(1 << 32)) if written < 0.05 else None
        accesses.append(Access(clock, address, data))
    captures = np.flatnonzero(rng.random(n_clocks - 1) < rng.choice([0, 0.01, 0.3]))
    return accesses, captures.tolist()


# One motion has every register of a method in it; more motions have other widths.
@pytest.mark.parametrize("seed", only([1], SEEDS))
@pytest.mark.parametrize("method", METHODS)
def test_registers_are_those_of_the_golden_model(method: str, seed: int) -> None:
    """One random core, its motion, accesses and captures."""
    spec, _, trace = random_case(seed, method)
    registers = RegisterMap(spec)
    n_clocks = min(trace.n_clocks, CLOCKS)
    accesses, captures = random_accesses(registers, seed, n_clocks)
    rows: list[dict[str, int]] = [{"capture": 0, "bus.read": 0, "bus.write": 0} for _ in range(n_clocks)]
    for clock, *levels in zip(trace.clock.tolist(), *(trace.lines[pin.name] for pin in spec.ports.pins), strict=True):
        if clock < n_clocks:
            rows[clock] |= {pin.name: int(level) for pin, level in zip(spec.ports.pins, levels, strict=True)}
    for clock in captures:
        rows[clock]["capture"] = 1
    for access in accesses:
        kind = {"bus.read": 1} if access.data is None else {"bus.write": 1, "bus.write_data": access.data}
        rows[access.clock] |= {"bus.address": access.address, **kind}
    seen = clock_by_clock(register_core.RegisterCore(registers), rows, ["bus.read_data", "bus.error"])
    short = PinTrace(trace.clock, trace.a, trace.b, n_clocks, trace.z, trace.tick_in)
    answers = GoldenBank(registers, short).answers(accesses, captures)
    for access, (data, error) in zip(accesses, answers, strict=True):
        row = seen[access.clock + 1]
        got = row["bus.read_data"] if data is not None else None, bool(row["bus.error"])
        assert got == (data, error), f"{method}, seed {seed}, {access}: {got}, not {data}, {error}"


def test_it_counts_and_saturates() -> None:
    """Counts to 7 in 3 bits, stays there, and begins anew; an event together with clear is not counted."""
    rows = [{"event": event, "clear": 0} for event in (1, 0, 1, 1, 1, 1, 1, 1, 1, 1)]
    rows += [{"event": 1, "clear": 1}, {"clear": 0}, {"event": 0}]
    seen = clock_by_clock(counter.SaturatingCounter(3), rows, ["count"])
    assert [row["count"] for row in seen] == [0, 1, 1, 2, 3, 4, 5, 6, 7, 7, 7, 0, 1]
