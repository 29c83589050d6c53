"""Tests that every extra has. A test of an extra lists cores, and a rule that reads pins and command line alone.

- `agreeing`: gates and golden model agree wherever a strobe is high, the manifest makes the core again, all ports are
  strobes, streamed or in registers, and the rule holds;
- `on_a_bus`: random reads and writes, aimed at the clocks in which the extra does something, get the answers of the
  golden bank, and the interrupt has its level; each captured register of the extra changes;
- `in_icarus`: the exported Verilog agrees, too;
- `refused`: options that do not fit are rejected with their message.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.nightly import only
from support.simulate import Seen, clock_by_clock
from support.verilog import run_in_icarus

from tachometry.hdl.core.register_core import RegisterCore
from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.signals.run import Run, compare
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import ParameterError, TachometerSpec, of_options, of_texts
from tachometry.spec.registers.manifest import manifest
from tachometry.spec.registers.map import RegisterMap

BASE = {"ppr": "25", "clock": "1MHz", "tick": "20clk", "max-time": "60clk"}


@dataclass(frozen=True)
class Case:
    """A core, in words such as `over-speed=90rad/s age=yes`, on a hostile motion."""

    method: str
    words: str
    edges: int = 30
    clocks: int = 10_000
    seed: int = 1
    swings: bool = False  # the shaft swings about a few edges, and z is often high
    late: bool = False  # another core shows nearly the same: it is left to `make test-all`

    @property
    def texts(self) -> dict[str, str]:
        return BASE | dict(word.split("=", 1) for word in self.words.split())

    @property
    def spec(self) -> TachometerSpec:
        return of_texts(self.method, self.texts)

    @property
    def ports(self) -> set[str]:
        """Names of the outputs of its extras."""
        return {port.name for extra in self.spec.extras for port in extra.ports(self.spec)}

    def trace(self) -> PinTrace:
        spec = self.spec
        if not self.swings:
            return stress(spec, seed=self.seed, n_edges=self.edges).until(self.clocks).completed(spec)
        rng = np.random.default_rng(self.seed)
        clock = np.append(0, np.cumsum(rng.integers(1, 7, self.clocks // 4)))
        level = quadrature(np.cumsum(rng.choice([-1, -1, -1, 0, 1, 1, 1, 2], len(clock))))
        z = (rng.random(len(clock)) < 0.3).astype(np.uint8)
        lines = {"a": level & np.uint8(1), "b": level >> np.uint8(1), "z": z}
        for line in spec.front_end.complemented:
            lines[f"{line}_n"] = lines[line] ^ (rng.random(len(clock)) < 0.7).astype(np.uint8)
        return PinTrace.of_lines(clock, int(clock[-1]) + 9, lines).completed(spec)

    def run(self) -> Run:
        """Run it, and compare every bit with the golden model."""
        return _run(self)

    def rows(self) -> Iterator[Any]:
        """Yield the outputs of each clock with a tick or an update, speeds also in rad/s."""
        run, lsb = self.run(), manifest(self.spec)["velocity"]["rad_per_s_per_lsb"]
        by_clock: dict[int, dict[str, Any]] = {}
        for strobe in ("tick", "velocity_valid"):
            table = run.tables[strobe]
            for k, clock in enumerate(table.clock.tolist()):
                row = by_clock.setdefault(clock, {"clock": clock, "tick": False, "velocity_valid": False})
                row |= {strobe: True, **{name: column[k].item() for name, column in table.columns.items()}}
        for _, row in sorted(by_clock.items()):
            yield SimpleNamespace(**row, rad_per_s=row.get("velocity", 0) * lsb)

    def level(self, line: str) -> Sequence[int]:
        """Return the level of a pin in each clock."""
        trace = self.trace()
        rows = np.searchsorted(trace.clock, np.arange(trace.n_clocks), side="right") - 1
        levels: list[int] = trace.lines[line][rows].tolist()
        return levels

    def steps(self) -> list[int]:
        """Return the count of each clock, by lines A and B alone: 1, −1 or 0."""
        place = [(0, 1, 3, 2).index(a | b << 1) for a, b in zip(self.level("a"), self.level("b"), strict=True)]
        return [0] + [{1: 1, 3: -1}.get((now - before) % 4, 0) for before, now in pairwise(place)]


@cache
def _run(case: Case) -> Run:
    result = lockstep(case.spec, case.trace(), Cxxrtl())
    assert result.n_mismatches == 0, result.first
    return result.actual


def agreeing(cases: Sequence[Case], rule: Callable[[Case], None]) -> Callable[[Case], None]:
    soon = [case for case in cases if not case.late]

    @pytest.mark.parametrize("case", only(soon, cases), ids=lambda case: f"{case.method} {case.words}")
    def test(case: Case) -> None:
        spec = case.spec
        assert of_options(spec.options) == spec
        mapped = {field.port for register in RegisterMap(spec, irq=True) for field in register.fields}
        assert case.ports
        assert case.ports <= mapped | {*spec.ports.strobes, *(port.name for port in spec.ports.streamed)}
        case.run()
        rule(case)

    return test


def on_a_bus(case: Case) -> Callable[[], None]:
    def test() -> None:
        registers, trace = RegisterMap(case.spec, irq=True), case.trace().until(2500)
        accesses = _accesses(case, registers, trace)
        seen, bank = _played(registers, trace, accesses), GoldenBank(registers, trace)
        values: dict[str, set[int | None]] = {}
        for access, (data, error) in zip(accesses, bank.answers(accesses), strict=True):
            row, name = seen[access.clock + 1], registers.registers[access.address].name
            answer = None if data is None else row["bus.read_data"], bool(row["bus.error"])
            assert answer == (data, error), (access, name)
            values.setdefault(name, set()).add(data)
        assert [bool(row["irq"]) for row in seen] == bank.irq(accesses, trace.n_clocks)
        constant = sorted(name for name in _own(case, registers) if len(values[name]) < 2)
        assert not constant, f"they never change: {constant}"

    return test


def _own(case: Case, registers: RegisterMap) -> set[str]:
    """Return the captured registers of the extras of a core."""
    return {register.name for register in registers if case.ports & {field.port for field in register.fields}}


def _accesses(case: Case, registers: RegisterMap, trace: PinTrace) -> list[Access]:
    """Return random accesses, most of them to registers of extras, writes often about a clock with an event there."""
    spec, rng = case.spec, np.random.default_rng(case.seed)
    written = {name for extra in spec.extras for name, *_ in extra.registers(spec)}
    often = {"CONTROL": 3, "INTERRUPT_ENABLE": 2, "INTERRUPT_CLEAR": 3} | dict.fromkeys(written, 5)
    writes = np.array([often.get(register.name, 1) * register.writable for register in registers], dtype=float)
    read = {*_own(case, registers), "VELOCITY", "INTERRUPTS"}
    reads = np.array([4 if register.name in read else 1 for register in registers], dtype=float)
    without = golden.tables(replace(spec, extras=()), trace)
    events = np.concatenate([table.clock for name, table in golden.tables(spec, trace).items() if name not in without])
    assert len(events), "nothing happens: give the case more edges, or another seed"
    aimed = set((rng.choice(events, 100) + rng.integers(-3, 2, 100)).tolist())
    accesses = []
    for clock in range(trace.n_clocks - 2):
        if clock in aimed or rng.random() < 0.04:
            address = int(rng.choice(len(writes), p=writes / writes.sum()))
            clears = registers.registers[address].name == "CONTROL"
            data = 1 if clears else int(rng.integers(1 << rng.integers(1, 9)))
            acts = [field.low for field in registers.registers[address].fields if field.single and field.low in (8, 16)]
            accesses.append(Access(clock, address, data | sum((clock & 1) << low for low in acts)))
        elif rng.random() < 0.36:
            accesses.append(Access(clock, int(rng.choice(len(reads), p=reads / reads.sum()))))
    return accesses


def _played(registers: RegisterMap, trace: PinTrace, accesses: Sequence[Access]) -> Seen:
    """Return the outputs of the gates on the native port, in each clock."""
    inputs = [port.name for port in registers.core_ports if port.direction == "input" and port.name in trace.lines]
    rows: list[dict[str, int]] = [{"bus.read": 0, "bus.write": 0} for _ in range(trace.n_clocks)]
    for number, clock in enumerate(trace.clock.tolist()):
        rows[clock] |= {name: int(trace.lines[name][number]) for name in inputs}
    for access in accesses:
        rows[access.clock] |= {"bus.address": access.address, "bus.write_data": access.data or 0}
        rows[access.clock] |= {"bus.read" if access.data is None else "bus.write": 1}
    return clock_by_clock(RegisterCore(registers), rows, ["bus.read_data", "bus.error", "irq"])


def in_icarus(case: Case) -> Callable[[Path], None]:
    def test(tmp_path: Path) -> None:
        assert compare(golden.run(case.spec, case.trace()), run_in_icarus(case.spec, tmp_path, case.trace())) == (0, [])

    return test


def refused(rows: Mapping[str, str], method: str = "m") -> Callable[[str], None]:
    @pytest.mark.parametrize("words", rows)
    def test(words: str) -> None:
        with pytest.raises(ParameterError, match=rows[words]):
            _ = Case(method, words).spec.ports

    return test
