"""Registers of a core with a control loop against their golden model, with random writes to all of them."""

from dataclasses import replace

import numpy as np
import pytest
from support.control import SMALL
from support.simulate import clock_by_clock

from tachometry.hdl.core import register_core
from tachometry.sim.encoder.stress import stress
from tachometry.sim.golden.loop_registers import GoldenLoopBank
from tachometry.sim.golden.registers import Access
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import Timing
from tachometry.spec.control import LoopSpec
from tachometry.spec.registers.loop import LoopMap

CORE = replace(SMALL, tachometer=replace(SMALL.tachometer, timing=Timing(1_000_000, 100, 3)), gains="inputs")
SPECS = {"commands": CORE, "generator": replace(CORE, command="generator")}


def random_accesses(registers: LoopMap, seed: int, n_clocks: int) -> tuple[list[Access], list[int]]:
    """Return writes to what can be written, and reads of all, some in clocks one after the other, and captures."""
    rng = np.random.default_rng(seed)
    words = (1 << registers.address_width - 2) - 1
    named = {one.name: one.offset // 4 for one in registers}
    settings = [one.offset // 4 for one in registers if one.writable and one.name not in ("CONTROL", "LOOP")]
    loop = [
        one.offset // 4 for one in registers if one.fields[0].port in ("current", "disturbance", "filtered_velocity")
    ]
    velocity = next(one.offset for one in registers.registers if one.captures) // 4
    accesses = [Access(0, named["LOOP"], 1)]
    for clock in range(1, n_clocks - 1):
        if rng.random() < 0.7:
            continue
        address, data, kind = int(rng.integers(words + 1)), None, rng.random()
        if kind < 0.1:
            # Enabled as a rule, sometimes frozen.
            address = named["LOOP"]
            data = int(rng.random() < 0.95) | int(rng.random() < 0.3) << 1 | int(rng.integers(1 << 32)) & ~3
        elif kind < 0.3:
            address = int(rng.choice(settings))
            # Of any size, with either sign, or as after a reset.
            value = int(rng.integers(1 << 32)) >> int(rng.integers(0 if rng.random() < 0.2 else 18, 32))
            data = (-value if rng.random() < 0.5 else value) & (1 << 32) - 1
            if rng.random() < 0.4:
                data = registers.registers[address].reset
        elif kind < 0.32:
            data = int(rng.integers(1 << 32))
        elif kind < 0.5:
            address = velocity
        elif kind < 0.8:
            address = int(rng.choice(loop))
        accesses.append(Access(clock, address, data))
    return accesses, np.flatnonzero(rng.random(n_clocks - 1) < 0.05).tolist()


Rows = list[dict[str, int]]


def case(spec: LoopSpec, seed: int, n_clocks: int) -> tuple[LoopMap, PinTrace, list[Access], list[int], Rows]:
    """Return a random motion, accesses and captures; and inputs that change, by clock, by their names in a native
    port.
    """
    registers = LoopMap(spec.tachometer, spec)
    trace = stress(spec.tachometer, seed, 12)
    trace = PinTrace(trace.clock, trace.a, trace.b, n_clocks)
    accesses, captures = random_accesses(registers, seed, n_clocks)
    rows: Rows = [{"capture": 0, "read": 0, "write": 0, "enable": 1} for _ in range(n_clocks)]
    for clock, *levels in zip(trace.clock.tolist(), trace.a.tolist(), trace.b.tolist(), strict=True):
        if clock < n_clocks:
            rows[clock] |= dict(zip(("a", "b"), levels, strict=True))
    for clock in captures:
        rows[clock]["capture"] = 1
    for access in accesses:
        kind = {"read": 1} if access.data is None else {"write": 1, "write_data": access.data}
        rows[access.clock] |= {"address": access.address, **kind}
    return registers, trace, accesses, captures, rows


def compare(
    registers: LoopMap, trace: PinTrace, accesses: list[Access], captures: list[int], seen: list[tuple[int, bool]]
) -> None:
    """Hold data and errors, by clock, against the golden model."""
    answers = GoldenLoopBank(registers, trace).answers(accesses, captures)
    shown: dict[str, set[int]] = {}
    for access, (data, error) in zip(accesses, answers, strict=True):
        got = seen[access.clock + 1] if data is not None else (None, seen[access.clock + 1][1])
        name = registers.registers[access.address].name if access.address < len(registers.registers) else ""
        assert got == (data, error), f"{name}, {access}: {got}, not {data}, {error}"
        if access.data is None:
            shown.setdefault(name, set()).add(data or 0)
    assert len(shown["CURRENT"]) > 5


def check(spec: LoopSpec, seed: int, n_clocks: int = 1400) -> None:
    """In Amaranth's simulator."""
    registers, trace, accesses, captures, rows = case(spec, seed, n_clocks)
    box = register_core.RegisterCore(registers)
    bus = ("read", "write", "address", "write_data")
    named = [{f"bus.{name}" if name in bus else name: value for name, value in row.items()} for row in rows]
    seen = clock_by_clock(box, named, ["bus.read_data", "bus.error"])
    compare(registers, trace, accesses, captures, [(row["bus.read_data"], bool(row["bus.error"])) for row in seen])


@pytest.mark.parametrize("name", SPECS)
def test_registers_are_those_of_the_golden_model(name: str) -> None:
    check(SPECS[name], 1)
