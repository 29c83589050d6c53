"""The window with its state outside, against the two boxes whose registers it is."""

import numpy as np
import pytest
from amaranth import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from support.mutant import caught, mutant
from support.sequences import PAPER
from support.simulate import clock_by_clock

from tachometry.hdl.axes import axis_window
from tachometry.hdl.axes.axis_window import AxisWindow
from tachometry.hdl.methods.alteration import AlterationDetector
from tachometry.hdl.methods.interval import IntervalAccumulator

OUTPUTS = ["m_s", "numerator", "update", "forced", "stalled"]
SHAPE = {"count_width": 4, "numerator_width": 6}


class Pair(wiring.Component):
    """Both, with the state of the first in a register."""

    def __init__(self, max_ticks: int, cancel: bool) -> None:
        given = {"max_ticks": max_ticks, "kept_ticks": max_ticks // 2, "cancel": cancel, **SHAPE}
        self.window = axis_window.AxisWindow(**given)  # type: ignore[arg-type]
        self.alteration = AlterationDetector(SHAPE["count_width"])
        self.interval = IntervalAccumulator(**given)  # type: ignore[arg-type]
        outputs = {f"{box}_{name}": Out(signed(12)) for box in ("window", "interval") for name in OUTPUTS}
        super().__init__({"tick": In(1), "clears": In(1), "m_e": In(signed(4)), **outputs})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.window = window = self.window
        m.submodules.alteration = alteration = self.alteration
        m.submodules.interval = interval = self.interval
        kept = Signal(window.state.shape())
        with m.If(self.tick | self.clears):
            m.d.sync += kept.eq(window.next)
        m.d.comb += [
            window.clears.eq(self.clears),
            window.state.eq(kept),
            window.m_e.eq(self.m_e),
            alteration.tick.eq(self.tick),
            alteration.m_e.eq(self.m_e),
            interval.tick.eq(self.tick),
            interval.m_e.eq(self.m_e),
            interval.previous.eq(alteration.previous),
            interval.alteration.eq(alteration.alteration),
            self.window_m_s.eq(window.state.m_s),
            self.window_stalled.eq(window.next.rests),
            *(getattr(self, f"window_{name}").eq(getattr(window, name)) for name in ("numerator", "update", "forced")),
            *(getattr(self, f"interval_{name}").eq(getattr(interval, name)) for name in OUTPUTS),
        ]
        return m


def check(m_e: list[int], *, max_ticks: int = 4, cancel: bool = True) -> None:
    # What is in the register before it is cleared is not the state of a reset.
    first = [{"clears": 1, "m_e": 0}]
    rows = [*first, *({"clears": 0, "tick": 1, "m_e": number} for number in m_e)]
    names = [f"{box}_{name}" for box in ("window", "interval") for name in OUTPUTS]
    for tick, row in enumerate(clock_by_clock(Pair(max_ticks, cancel), rows, names)[len(first) :]):
        for name in OUTPUTS:
            assert row[f"window_{name}"] == row[f"interval_{name}"], (tick, name)


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
def test_it_is_what_the_boxes_of_one_axis_are(max_ticks: int, cancel: bool) -> None:
    for m_e, _ in PAPER.values():
        check([max(-8, min(7, number)) for number in m_e], max_ticks=max_ticks, cancel=cancel)
    check(random(max_ticks), max_ticks=max_ticks, cancel=cancel)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        (" & (m_e != state.offset)", ""),
        ("state.opening - state.previous + d1 if", "d1 + d1 if"),
        ("Mux(restarts, 1, goes_on)", "Mux(restarts, 2, goes_on)"),
        ("self._kept_ticks + 1", "1"),
        ("longest & ~restarts", "longest"),
        ("Mux(alteration | longest | self.clears", "Mux(alteration | self.clears"),
        ("Mux(alteration, state.offset, m_e)", "m_e"),
        ("state.rests | state.nearly |", "state.rests |"),
        ("state.opening | state.previous", "state.previous"),
    ],
)
def test_mutants_are_caught(right: str, wrong: str) -> None:
    with mutant(AxisWindow, right, wrong), caught():
        check(random(1))
