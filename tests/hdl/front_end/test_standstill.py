"""`standstill` rises after the same silence with all methods but tracking, and falls with the next count."""

import numpy as np
import pytest
from amaranth.lib import wiring
from support.nightly import only
from support.options import had_by
from support.simulate import clock_by_clock, ticks

from tachometry.hdl.front_end.standstill import Standstill
from tachometry.hdl.methods.s import SMethod
from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress
from tachometry.spec import METHODS, Encoder, STachometer, Timing, of_texts
from tachometry.spec.language.port import TICK
from tachometry.spec.registers.manifest import manifest

WIDTH = 4


def numbers(max_ticks: int, most: int = 3) -> list[int]:
    """Return steady numbers, single ones, and silences of about the maximum time, after a reset as well."""
    rng = np.random.default_rng(max_ticks)
    found = [0] * (max_ticks + 1)
    while len(found) < 30 * max_ticks:
        steady = [int(rng.integers(-most, most + 1))] * int(rng.integers(1, 4))
        found += [0] * int(max_ticks + rng.integers(-2, 3)) + steady + [0] * int(rng.integers(0, 2 * max_ticks))
        found += rng.integers(-2, 3, 6).tolist() + [1] * int(rng.integers(0, 2 * max_ticks))
    return found


def expected(m_e: list[int], max_ticks: int, length: list[int]) -> list[int]:
    """Return tick by tick: the silence so far, with the tick before the first, is longer than the maximum time."""
    silence, found = 1, []
    for number, n_ticks in zip(m_e, length, strict=True):
        silence = 0 if number else silence + n_ticks
        found.append(int(silence > max_ticks))
    return found


def check(box: wiring.Component, max_ticks: int, name: str, pause: int, shifts: bool = False) -> None:
    """It changes with a tick, and stays from tick to tick."""
    m_e = numbers(max_ticks, 2 ** (WIDTH - 1) - 1)
    k = np.random.default_rng(1).integers(0, 3 if shifts else 1, len(m_e)).tolist()
    rows: list[dict[str, int]] = []
    for number, shift in zip(m_e, k, strict=True):
        rows += [{"tick": 1, name: number} | ({"shift": shift} if shifts else {}), *[{"tick": 0}] * pause]
    seen = [row["standstill"] for row in clock_by_clock(box, rows, ["standstill"])]
    wanted = expected(m_e, max_ticks, [1 << shift for shift in k])
    assert seen == [value for value in wanted for _ in range(1 + pause)]
    assert {*wanted} == {0, 1}


def check_box(max_ticks: int = 5) -> None:
    check(Standstill(max_ticks, WIDTH), max_ticks, "m_e", 1)


def check_long_ticks(max_ticks: int = 5) -> None:
    check(Standstill(max_ticks, WIDTH, max_shift=2), max_ticks, "m_e", 1, shifts=True)


def check_s(max_ticks: int = 5) -> None:
    for clocks in (3, 40):
        box = SMethod(STachometer(encoder=Encoder(25), timing=Timing(1_000_000, clocks, max_ticks)))
        m_e = numbers(max_ticks)
        seen = [row["standstill"] for row in clock_by_clock(box, ticks(box, m_e, clocks), ["standstill"])][1:]
        assert seen == [value for value in expected(m_e, max_ticks, [1] * len(m_e)) for _ in range(clocks)]


@pytest.mark.parametrize("max_ticks", only([2, 5], [2, 3, 4, 5, 8]))  # the least, and an odd one
def test_after_the_maximum_time(max_ticks: int) -> None:
    check_box(max_ticks)
    check_s(max_ticks)
    check(Standstill(max_ticks, WIDTH), max_ticks, "m_e", 0)
    check_long_ticks(max_ticks)


@pytest.mark.parametrize("method", [name for name, kind in METHODS.items() if kind.facts.rests_with == TICK])
def test_methods(method: str) -> None:
    """By the golden models, whose outputs those of the hardware are; see tests/test_matrix.py."""
    texts = {"ppr": "1", "clock": "1MHz", "tick": "5clk", "max-time": "30clk", "frac-bits": "4", "position-width": "8"}
    for more in ({}, {"adaptive": "25%"} if method == "rairan" else {"external-tick": "yes"}):
        spec = of_texts(method, had_by(method, texts | more))
        assert manifest(spec)["standstill_after_ticks"] == 7
        ticks = golden.run(spec, stress(spec, 1, 30)).ticks
        if "adaptive" not in more:
            ones = [1] * len(ticks)
            assert ticks.standstill.astype(int).tolist() == expected(ticks.pulse_count.tolist(), 6, ones)
        assert np.count_nonzero(np.diff(ticks.standstill.astype(int))) > 2
