"""The window with its state outside, in a register, against the golden model of the S method."""

import numpy as np
import pytest
from amaranth import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from reference.sequences import PAPER
from support.simulate import clock_by_clock

from tachometry.hdl.axes import axis_window
from tachometry.sim.golden.methods.s import alterations, windows

OUTPUTS = ["m_s", "base", "numerator", "update", "forced", "standstill"]


class Followed(wiring.Component):
    """A window of one axis, a tick in every clock."""

    def __init__(self, max_ticks: int, cancel: bool) -> None:
        given = {"max_ticks": max_ticks, "kept_ticks": max_ticks // 2, "count_width": 4, "numerator_width": 6}
        self.window = axis_window.AxisWindow(**given, cancel=cancel)
        super().__init__({"clears": In(1), "m_e": In(signed(4)), **{name: Out(signed(12)) for name in OUTPUTS}})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.window = window = self.window
        kept = Signal(window.state.shape())
        m.d.sync += kept.eq(window.next)
        m.d.comb += [
            window.clears.eq(self.clears),
            window.state.eq(kept),
            window.m_e.eq(self.m_e),
            self.m_s.eq(kept.m_s),
            self.base.eq(kept.previous),
            self.standstill.eq(window.next.rests),
            *(getattr(self, name).eq(getattr(window, name)) for name in ("numerator", "update", "forced")),
        ]
        return m


def check(m_e: list[int], *, max_ticks: int = 4, cancel: bool = True) -> None:
    # What is in the register before it is cleared is not the state of a reset.
    rows = [{"clears": 1, "m_e": 0}, *({"clears": 0, "m_e": number} for number in m_e)]
    seen = clock_by_clock(Followed(max_ticks, cancel), rows, OUTPUTS)[1:]
    numbers = [0, *m_e]  # m_e(−1) = 0 comes first
    at, m_s, forced = (column.tolist() for column in windows(alterations(np.array(m_e)), max_ticks))
    assert [tick for tick, row in enumerate(seen) if row["update"]] == at
    for tick, length, by_force in zip(at, m_s, forced, strict=True):
        row, inside = seen[tick], numbers[tick + 2 - length : tick + 2]
        assert (row["m_s"], bool(-row["forced"])) == (length, by_force), tick
        if cancel:
            doubled = numbers[tick + 1 - length] + 2 * sum(inside[:-1]) + inside[-1]
            assert 2 * length * row["base"] + row["numerator"] == doubled, tick
        else:
            assert length * row["base"] + row["numerator"] == sum(inside), tick
    for tick, row in enumerate(seen):
        latest = numbers[tick + 1 - max_ticks : tick + 2] if tick + 1 >= max_ticks else [1]
        assert bool(-row["standstill"]) == (not any(latest)), tick


def random(seed: int) -> list[int]:
    rng = np.random.default_rng(seed)
    slow = rng.random(300) < 0.1
    return [
        *rng.integers(2, 4, 200).tolist(),
        *slow.astype(int).tolist(),
        *[0] * 20,
        1,
        *rng.integers(-8, 8, 50).tolist(),
    ]


@pytest.mark.parametrize("cancel", [True, False])
@pytest.mark.parametrize("max_ticks", [2, 3, 8])
def test_windows_of_the_paper_and_of_random_numbers(max_ticks: int, cancel: bool) -> None:
    for m_e, _ in PAPER.values():
        check([max(-7, min(7, number)) for number in m_e], max_ticks=max_ticks, cancel=cancel)
    check(random(max_ticks), max_ticks=max_ticks, cancel=cancel)
