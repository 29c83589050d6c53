"""Registers against their golden model, on random motions with random accesses and captures."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from amaranth.lib import wiring
from support import compiled
from support.nightly import only
from support.random_case import random_case
from support.simulate import clock_by_clock
from support.tracking import core

from tachometry.hdl.bus import counter
from tachometry.hdl.core import register_core
from tachometry.hdl.export.files import top_of
from tachometry.sim.encoder.stress import stress
from tachometry.sim.golden.registers import Access, GoldenBank
from tachometry.spec import METHODS
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.map import RegisterMap

CLOCKS, SEEDS = 1500, range(6)
Played = tuple[list[Access], list[int]]  # accesses and captures


def random_accesses(registers: RegisterMap, seed: int, n_clocks: int) -> Played:
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


# By bus: levels by clocks from that in which an access reaches the registers; the clock, data and error of its answer.
LINES = tomllib.loads(Path(__file__).with_name("lines.toml").read_text())


def differing(component: wiring.Component, trace: Any, played: Played, golden: Any, bus: str = "alone") -> list[Access]:
    """Return accesses that a core answers in another way than a golden bank; on a bus, it is played by CXXRTL."""
    lines, (later, data, error) = LINES[bus]["levels"], LINES[bus]["answer"]
    accesses, captures = played
    rows: list[dict[str, int]] = [{"capture": 0} for _ in range(trace.n_clocks)]
    for name in trace.lines.keys() & component.signature.members.keys():
        for clock, level in zip(trace.clock.tolist(), trace.lines[name].tolist(), strict=True):
            if clock < trace.n_clocks:
                rows[clock][name] = int(level)
    for clock in captures:
        rows[clock]["capture"] = 1
    for access in accesses:
        written, byte = access.data is not None, 4 * access.address
        words = {"read": int(not written), "write": int(written), "data": access.data or 0}
        for place, text in lines.items():
            pairs = (one.split("=") for one in text.format(word=access.address, byte=byte, **words).split())
            rows[access.clock + int(place)] |= {name: int(level) for name, level in pairs}
    errors = [error.format(side=side) for side in "rb"]
    play = clock_by_clock if bus == "alone" else compiled.clock_by_clock
    seen = play(component, rows, [*dict.fromkeys([data, *errors])])
    wrong = []
    for access, (value, failed) in zip(accesses, golden.answers(accesses, captures), strict=True):
        row, written = seen[access.clock + later], access.data is not None
        known = value is not None and not (written and bus == "axi-lite")
        if bool(row[errors[written]]) != failed or (known and row[data] != value):
            wrong.append(access)
    return wrong


# One motion has every register of a method in it; more motions have other widths.
@pytest.mark.parametrize("seed", only([1], SEEDS))
@pytest.mark.parametrize("method", METHODS)
def test_registers_are_those_of_the_golden_model(method: str, seed: int) -> None:
    """One random core, its motion, accesses and captures."""
    spec, _, trace = random_case(seed, method)
    registers = RegisterMap(spec)
    short = replace(trace, n_clocks=min(trace.n_clocks, CLOCKS))
    played = random_accesses(registers, seed, short.n_clocks)
    assert differing(register_core.RegisterCore(registers), short, played, GoldenBank(registers, short)) == []


def test_a_capture_between_the_velocity_and_the_rest_takes_the_update_before() -> None:
    spec = core(tick="300clk", max_time="3000clk", multiplier="block")
    registers, trace = RegisterMap(spec), replace(stress(spec, 1, 40), n_clocks=2 * CLOCKS)
    played = random_accesses(registers, 1, trace.n_clocks)
    assert differing(register_core.RegisterCore(registers), trace, played, GoldenBank(registers, trace)) == []


@pytest.mark.parametrize("bus", only(["wishbone"], [name for name in LINES if name != "alone"]))
def test_registers_of_the_exported_text_are_right_in_cxxrtl(bus: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """One access after the other; tests/hdl/bus/test_exported_serial.py has SPI and UART."""
    spec, _, trace = random_case(1, "s")
    registers = RegisterMap(spec)
    short = replace(trace, n_clocks=min(trace.n_clocks, 20 * CLOCKS))
    accesses, captures = random_accesses(registers, 1, short.n_clocks - 8)
    apart = [replace(one, clock=8 * place + 8) for place, one in enumerate(accesses[: short.n_clocks // 8 - 2])]
    assert len(apart) > 100
    compiled.read_exported(monkeypatch)
    assert differing(top_of(spec, bus_of(bus)), short, (apart, captures), GoldenBank(registers, short), bus) == []


def test_it_counts_and_saturates() -> None:
    """Counts to 7 in 3 bits, stays there, and begins anew; an event together with clear is not counted."""
    rows = [{"event": event, "clear": 0} for event in (1, 0, 1, 1, 1, 1, 1, 1, 1, 1)]
    rows += [{"event": 1, "clear": 1}, {"clear": 0}, {"event": 0}]
    seen = clock_by_clock(counter.SaturatingCounter(3), rows, ["count"])
    assert [row["count"] for row in seen] == [0, 1, 1, 2, 3, 4, 5, 6, 7, 7, 7, 0, 1]
