"""A bridge alone, with the native port in the hand of the test."""

from collections.abc import Callable
from typing import Any

import numpy as np

from support.serial import SpiHost, UartHost
from support.simulate import clock_by_clock
from tachometry.spec import Encoder, MTachometer, Timing
from tachometry.spec.registers.map import RegisterMap

SPEC = MTachometer(encoder=Encoder(100), timing=Timing(1_000_000, 10, 10))
_AFTER = 60  # clocks


def check(bridge: Callable[[RegisterMap], Any], host: SpiHost | UartHost, output: str) -> None:
    """Let a host play; the bridge must make its accesses, each in its clock, and show what was answered to them.

    Answers are random, and there for their clock only.
    """
    registers = RegisterMap(SPEC)
    n_clocks = int(host.time) + _AFTER
    rng = np.random.default_rng(n_clocks)
    data, errors = rng.integers(1 << 32, size=n_clocks), rng.integers(2, size=n_clocks)
    numbers = {access.clock + 1: access for access in host.accesses}
    assert len(numbers) == len(host.accesses)
    answers = []
    for access in host.accesses:
        clock = access.clock + 1
        if access.data is not None:
            data[clock] = 0
        errors[clock] = rng.random() < 0.4
        answers.append((int(data[clock]), bool(errors[clock])))
    lines = host.lines(n_clocks)
    # What is on the native port between answers has no meaning, so it may stay.
    rows: list[dict[str, int]] = []
    for clock in range(n_clocks):
        row = {name: int(level[clock]) for name, level in lines.items()}
        if {clock, clock - 1} & numbers.keys() or clock % 16 == 0:
            row |= {"native.read_data": int(data[clock]), "native.error": int(errors[clock])}
        rows.append(row)
    names = ("read", "write", "address", "write_data")
    seen = clock_by_clock(bridge(registers), rows, [output, *(f"native.{name}" for name in names)])
    made: list[tuple[int, int, int | None]] = []
    for clock, row in enumerate(seen):
        assert not (row["native.read"] and row["native.write"])
        if row["native.read"]:
            made.append((clock, row["native.address"], None))
        elif row["native.write"]:
            made.append((clock, row["native.address"], row["native.write_data"]))
    assert made == [(access.clock, access.address, access.data) for access in host.accesses]
    host.check(np.array([row[output] for row in seen], np.uint8), answers)
