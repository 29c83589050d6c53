"""The whole core with a control loop against the golden models: clock by clock, and as exported."""

import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.control import SERIAL, SMALL, check_core, core_case
from support.simulate import Resettable, clock_by_clock
from support.verilog import play_in_icarus

from tachometry.hdl.control.sigma_delta import SigmaDelta
from tachometry.hdl.core.loop_core import LoopCore
from tachometry.sim import golden
from tachometry.sim.golden.control import run_loop
from tachometry.sim.signals.run import compare
from tachometry.spec import Encoder, ParameterError, Timing, TTachometer
from tachometry.spec.core.index import Index

CORE = replace(SMALL, tachometer=replace(SMALL.tachometer, timing=Timing(1_000_000, 100, 3)))


def test_as_the_golden_model() -> None:
    run = check_core(CORE, n_edges=1)
    current = run.tables["current_valid"]
    assert 0.2 < np.mean(current.current_saturated) < 0.98
    clock = run.tables["control_tick"].clock
    assert np.diff(clock).tolist() == [CORE.period] * (len(clock) - 1)
    assert set(current.clock - clock[: len(current)]) == {CORE.latency.tick_to_result}


def test_exported_verilog_in_icarus(tmp_path: Path) -> None:
    """With a generator, gains as inputs, and a method and options of the tachometer that change nothing about it."""
    options: dict[str, Any] = {"lowpass": Fraction(4000), "filter_clocks": 3, "index": Index(reset=True)}
    tachometer = TTachometer(encoder=Encoder(500), timing=Timing(1_000_000, 100, 3), frac_bits=6, **options)
    spec = replace(SERIAL, tachometer=tachometer, command="generator", gains="inputs")
    trace, commands, gains, changes = core_case(spec, 3, 5)
    wanted = run_loop(spec, trace, commands, golden.tables, gains)
    assert len(wanted.tables["current_valid"]) > 20
    count, first = compare(wanted, play_in_icarus(spec, tmp_path, changes, trace.n_clocks))
    assert not count, first


def test_a_reset_amid_a_program() -> None:
    """From a reset on the core shows what it shows after the first one, wherever the program was."""
    *_, changes = core_case(CORE, 5, 1)
    names = [port.name for port in CORE.ports.pins]
    rows: list[dict[str, int]] = [{} for _ in range(700)]
    for clock, *values in changes[changes[:, 0] < len(rows)].tolist():
        rows[clock] = dict(zip(names, values, strict=True))
    rows[0]["rst"] = 0
    outputs = ("control_tick", "current_valid", "current", "filtered_velocity", "disturbance", "current_pdm")
    whole = clock_by_clock(Resettable(LoopCore(CORE)), rows, outputs)
    ticks = [clock for clock, row in enumerate(whole) if row["control_tick"]]
    for amid in (9, CORE.latency.tick_to_result - 1):
        until = ticks[3] + amid
        seen = clock_by_clock(Resettable(LoopCore(CORE)), [*rows[:until], {"rst": 1}, *rows], outputs)[until + 1 :]
        assert [row["control_tick"] for row in seen] == [row["control_tick"] for row in whole]
        assert [row for row in seen if row["current_valid"]] == [row for row in whole if row["current_valid"]]


def check_drive(width: int) -> None:
    """Over 2^width clocks the bits add up to the value, whatever it is."""
    most = 1 << (width - 1)
    for value in (-most, -most + 1, -3, 0, 1, most // 3, most - 1):
        seen = clock_by_clock(SigmaDelta(width), [{"value": value}] * ((1 << width) + 1), ["current_pdm"])
        ones = [row["current_pdm"] for row in seen[1:]]
        assert sum(ones) == value + most
        # And every stretch of them does, within one.
        expected = (value + most) / (1 << width)
        total = np.cumsum(ones) - expected * np.arange(1, len(ones) + 1)
        assert np.abs(total).max() <= 1


def test_the_stream_of_bits() -> None:
    check_drive(8)


def test_what_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"^control_period must be at least 45 clocks, as long as the controller"):
        replace(CORE, control_period=44)


@pytest.mark.parametrize("multiplier", ["serial", "parallel"])
@pytest.mark.parametrize("command", ["ports", "generator"])
def test_the_least_control_period_is_told_whatever_was_asked_for(multiplier: str, command: str) -> None:
    """The shorter the period, the wider the words, and the longer they take."""
    spec = replace(CORE, multiplier=multiplier, command=command, control_period=4800)
    told = set()
    for period in (1, 20, 40):
        with pytest.raises(ParameterError, match=r"^control_period must be at least (\d+) clocks, ") as refused:
            replace(spec, control_period=period)
        told.add(int(re.findall(r"\d+", str(refused.value))[0]))
    (least,) = told
    assert replace(spec, control_period=least).period == least
    with pytest.raises(ParameterError, match=f"^control_period must be at least {least} clocks, "):
        replace(spec, control_period=least - 1)
