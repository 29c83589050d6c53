"""Interrupts and their registers against their golden model, on motions with every event."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.axes import motions, small
from support.control import SMALL
from support.nightly import only
from support.simulate import clock_by_clock
from support.verilog import play_native

from tachometry.hdl.bus import interrupts
from tachometry.hdl.core.axes_registers import AxesRegisterCore
from tachometry.hdl.core.register_core import RegisterCore
from tachometry.hdl.export import export
from tachometry.sim.golden.axes_registers import GoldenAxesBank
from tachometry.sim.golden.loop_registers import GoldenLoopBank
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.spec import AxesSpec, ParameterError, Timing, of_texts
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.core.index import Index
from tachometry.spec.registers.axes import AxesMap
from tachometry.spec.registers.buses import BUSES, bus_of, ports_on, registers_on
from tachometry.spec.registers.map import RegisterMap

BASE = {"ppr": "25", "clock": "1MHz", "tick": "40clk", "max-time": "160clk", "max-speed": "500rev/s"}
CORES: dict[str, AnySpec] = {
    "s": of_texts("s", BASE | {"index": "yes", "health": "yes", "health-errors": "0", "over-speed": "200rev/s"}),
    "external ticks": of_texts("m", BASE | {"external-tick": "yes", "max-speed": "200rev/s"}),
    "rairan": of_texts("rairan", BASE | {"tick": "20clk"}),
    "axes": small(2, parallel=True, index=Index()),
    "loop": replace(SMALL, tachometer=replace(SMALL.tachometer, timing=Timing(1_000_000, 100, 3)), gains="inputs"),
}
CLOCKS = 3000


def bank_of(registers: RegisterMap, trace: PinTrace | AxesTrace) -> GoldenBank:
    if isinstance(trace, AxesTrace):
        assert isinstance(registers, AxesMap)
        return GoldenAxesBank(registers, trace)
    loop = isinstance(registers.core, LoopSpec)
    return GoldenLoopBank(registers, trace) if loop else GoldenBank(registers, trace)  # type: ignore[arg-type]


def _trace(spec: AnySpec) -> PinTrace | AxesTrace:
    """Return a motion with both lines at once, counts that are too many, an index and a standstill."""
    if isinstance(spec, AxesSpec):
        return motions(spec, CLOCKS)
    rng = np.random.default_rng(1)
    # Too fast, as it may be, and at rest for longer than a measurement; sometimes both lines change at once.
    gaps = np.concatenate([[*rng.choice([11, 30, 50], 1).repeat(6), 450] for _ in range(CLOCKS // 450)])
    turns = np.where(rng.random(len(gaps)) < 0.1, 2, rng.choice([1, -1]))
    clock = np.append(0, np.cumsum(gaps))
    clock = clock[clock < CLOCKS]
    level = quadrature(np.append(0, np.cumsum(turns)))[: len(clock)]
    z = (rng.random(len(clock)) < 0.3).astype(np.uint8) if spec.tachometer.index else None
    made = PinTrace(clock, level & np.uint8(1), level >> np.uint8(1), CLOCKS, z)
    if not spec.tachometer.external_tick:
        return made
    return made.with_tick_in(np.cumsum(rng.choice([2, 40, 39, 43, 250], CLOCKS // 40)))


Rows = list[dict[str, int]]


@cache
def case(core: str) -> tuple[RegisterMap, PinTrace | AxesTrace, list[Access], Rows]:
    """Return a core with its motion, random writes to the registers of the interrupt, and reads of them."""
    spec = CORES[core]
    trace = _trace(spec)
    bus = bus_of("native", irq=True)
    assert bus is not None
    registers = registers_on(spec, bus)
    rng = np.random.default_rng(5)
    # Some events are cleared as they come.
    coming = {clock for clocks in bank_of(registers, trace).interrupts().values() for clock in clocks[::2].tolist()}
    clears = registers["INTERRUPT_CLEAR"].offset // 4
    ours = [number for number, one in enumerate(registers) if one.name.startswith("INTERRUPT")]
    accesses = []
    for clock in range(CLOCKS - 1):
        if clock in coming:
            accesses.append(Access(clock, clears, 63))
        elif rng.random() < 0.1:
            data = int(rng.integers(64)) | int(rng.integers(1 << 20)) << 12 if rng.random() < 0.5 else None
            accesses.append(Access(clock, int(rng.choice(ours)), data))
    rows: Rows = [{"capture": 0, "read": 0, "write": 0} for _ in range(CLOCKS)]
    pins = [pin.name for pin in spec.ports.pins if pin.name in trace.lines]
    for clock, *levels in zip(trace.clock.tolist(), *(trace.lines[pin].tolist() for pin in pins), strict=True):
        if clock < CLOCKS:
            rows[clock] |= dict(zip(pins, levels, strict=True))
    for access in accesses:
        kind = {"read": 1} if access.data is None else {"write": 1, "write_data": access.data}
        rows[access.clock] |= {"address": access.address, **kind}
    return registers, trace, accesses, rows


def compare(core: str, seen: Sequence[tuple[int, int, int]]) -> None:
    """Hold data, errors and interrupt of each clock against the golden model, and see that all has happened."""
    registers, trace, accesses, _ = case(core)
    bank = bank_of(registers, trace)
    answers = bank.answers(accesses)
    for access, (data, error) in zip(accesses, answers, strict=True):
        assert seen[access.clock + 1][:2] == (data, int(error)), (core, access)
    happened = {event: len(clocks) for event, clocks in bank.interrupts().items()}
    assert all(happened.values()), happened
    levels = bank.irq(accesses, CLOCKS)
    wrong = [clock for clock, level in enumerate(levels) if seen[clock][2] != level]
    assert wrong == [], (core, wrong[0])
    assert 100 < sum(levels) < CLOCKS - 100
    enabled = [index for index, one in enumerate(registers) if one.name == "INTERRUPT_ENABLE"]
    read = {data for access, (data, _) in zip(accesses, answers, strict=True) if access.address == enabled[0]}
    assert len(read) > 4


def simulated(core: str) -> list[tuple[int, int, int]]:
    registers, _, _, rows = case(core)
    box = AxesRegisterCore(registers) if isinstance(registers, AxesMap) else RegisterCore(registers)
    bus = ("read", "write", "address", "write_data")
    named = [{f"bus.{name}" if name in bus else name: value for name, value in row.items()} for row in rows]
    seen = clock_by_clock(box, named, ["bus.read_data", "bus.error", "irq"])
    return [(row["bus.read_data"], row["bus.error"], row["irq"]) for row in seen]


@pytest.mark.parametrize("core", only(["s", "axes"], CORES))
def test_interrupts_are_those_of_the_golden_model(core: str) -> None:
    compare(core, simulated(core))


@pytest.mark.parametrize("core", only(["external ticks"], CORES))
def test_exported_verilog_in_icarus(core: str, tmp_path: Path) -> None:
    spec, (_, _, _, rows) = CORES[core], case(core)
    found = play_native(spec, tmp_path, rows, ["reg_read_data", "reg_error", "irq"], irq=True)
    compare(core, [(data, error, irq) for data, error, irq in found])


def test_irq_is_a_clock_behind_its_bit() -> None:
    bus = bus_of("native", irq=True)
    assert bus is not None
    box = interrupts.Interrupts(registers_on(CORES["s"], bus))
    rows = [{"irq_enable_fault": 1, "fault": 0}, {"fault": 1}, {"fault": 0}, {}, {"irq_clear_fault": 1}, {}, {}]
    seen = clock_by_clock(box, rows, ["irq_pending_fault", "irq"])
    assert [row["irq_pending_fault"] for row in seen] == [0, 0, 1, 1, 1, 0, 0]
    assert [row["irq"] for row in seen] == [0, 0, 0, 1, 1, 1, 0]


@pytest.mark.parametrize("bus", BUSES)
def test_every_bus_has_it_and_only_when_it_is_asked_for(bus: str) -> None:
    spec = CORES["s"]
    with_it, without = (bus_of(bus, 50_000 if bus == "uart" else None, irq=irq) for irq in (True, False))
    assert with_it is not None
    assert without is not None
    added = {port.name for port in ports_on(spec, with_it)} - {port.name for port in ports_on(spec, without)}
    assert added == {"irq"}
    registers = registers_on(spec, with_it)
    before = registers_on(spec, without)
    assert [one.name for one in registers][-3:] == ["INTERRUPTS", "INTERRUPT_ENABLE", "INTERRUPT_CLEAR"]
    assert [(one.name, one.offset) for one in registers][:-3] == [(one.name, one.offset) for one in before]
    assert registers.configuration != before.configuration


def test_without_a_bus_there_is_none() -> None:
    with pytest.raises(ParameterError, match="irq must be given together with a bus, which clears its events"):
        export(CORES["s"], irq=True)
