"""What only the M/T method does."""

from typing import Any

import pytest
from support.mutant import caught, mutant
from support.timed import SILENCE, TICK, run, silence, spec_of, speed

from tachometry.hdl.methods import mt as mt_method
from tachometry.spec import MTTachometer


def check_windows() -> None:
    """A count as late as T_c goes on, the next one closes and opens."""
    spec = spec_of("mt", min_time=50, bound_decay=False)
    assert isinstance(spec, MTTachometer)
    at = [5, 30, 55, 60, 80, 110, 111, 161, 162]
    got = run(spec, dict.fromkeys(at, 1), 163)
    windows = [(60, 3, 55), (111, 3, 51), (162, 2, 51)]
    assert got == [(clock, speed(way, time), time, False) for clock, way, time in windows]


def test_windows() -> None:
    check_windows()


def check_reversals() -> None:
    """Half of the ends and all between: where an edge is met twice, the distance is that of the shaft."""
    steps = {5: 1, 15: 1, 25: -1, 35: -1, 45: -1, 60: 1, 70: -1, 80: -1, 115: -1, 125: 1, 170: 1}
    got = run(spec_of("mt", min_time=50, bound_decay=False), steps, 171)
    # +½ +1 −1 −1 −1 +½, then +½ −1 −1 −½, then −½ +1 +½; to the letter the counts after the opening one.
    assert got == [(clock, speed(way, 55), 55, False) for clock, way in ((60, -1), (115, -2), (170, 1))]
    got = run(spec_of("mt", min_time=50, paper_exact=True), steps, 171)
    assert [row[1:3] for row in got] == [(speed(way, 55), 55) for way in (-1, -3, 2)]


def test_reversals() -> None:
    check_reversals()


def check_lattice() -> None:
    """Eq. (13): the ticks after the opening one, less the edge that a reversal meets twice."""
    spec = spec_of("mt", timer="tick", min_time=2 * TICK, bound_decay=False)
    got = run(spec, {1: 2, 2: 3, 3: -1, 5: 4, 6: 1, 8: 1, 9: -1, 12: -2}, 13 * TICK)
    assert [(row[0] // TICK, row[1], row[2]) for row in got] == [(5, 384, 4), (8, 171, 3), (12, -128, 4)]


def test_lattice() -> None:
    check_lattice()


def check_dithering(timer: str = "tick") -> None:
    """In any rhythm, one edge is no distance; there and back over more of them is what lies between."""
    rhythms = [range(3, 60), range(3, 60, 3), (3, 4, 9, 10, 11, 20, 21, 33, 34, 35, 40, 41, 50)]
    for at in rhythms:
        for min_ticks in (1, 2, 5):
            spec = spec_of("mt", timer=timer, min_time=min_ticks * TICK)
            ticks = TICK if timer == "clock" else 1
            got = run(spec, {ticks * tick: (-1) ** k for k, tick in enumerate(at)}, 60 * TICK)
            assert len(got) > 3
            assert not any(velocity for _, velocity, *_ in got)


@pytest.mark.parametrize("timer", ["clock", "tick"])
def test_dithering_on_one_edge_reads_0(timer: str) -> None:
    check_dithering(timer)


def test_a_count_while_the_divider_runs_goes_on() -> None:
    """A measurement lasts as long as a division, however short T_c is."""
    spec = spec_of("mt", min_time=1, bound_decay=False)
    busy = spec.division_clocks
    steps = dict.fromkeys([5, 45, 45 + busy - 1, 45 + busy], 1)
    got = run(spec, steps, 46 + busy)
    assert got == [(45, speed(1, 40), 40, False), (45 + busy, speed(2, busy), busy, False)]


def check_silence_in_a_window() -> None:
    """It discards what was counted, and the next count only opens."""
    spec = spec_of("mt", min_time=200, bound_decay=False)
    last = 105
    steps = dict.fromkeys([5, 55, last], 1) | dict.fromkeys([last + SILENCE + 60, last + SILENCE + 261], -1)
    got = run(spec, steps, last + SILENCE + 262)
    assert got[:1] == silence(last, last + SILENCE + 1)
    assert got[1:] == [(last + SILENCE + 261, speed(-1, 201), 201, False)]
    # Also in the clock after it.
    got = run(spec, {5: 1, last: 1, last + SILENCE + 1: 1}, last + SILENCE + 50)
    assert got == silence(last, last + SILENCE + 1)
    # A window may be longer than the maximum time, as long as no silence is.
    got = run(spec, {5: 1, 200: 1, 200 + SILENCE: 1}, 201 + SILENCE)
    assert got == [(200 + SILENCE, speed(2, 195 + SILENCE), 195 + SILENCE, False)]


def test_silence_in_a_window() -> None:
    check_silence_in_a_window()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"min_time": 0}, "min_time must be from 1 to 400 clocks, the maximum time, not 0"),
        ({"min_time": 401}, "min_time must be from 1 to 400 clocks, the maximum time, not 401"),
        (
            {"min_time": 30, "timer": "tick"},
            "min_time must be a multiple of 20 clocks with times in ticks, not 30",
        ),
        ({"timer": "x"}, "timer must be clock or tick, not 'x'"),
    ],
)
def test_bad_options(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}$"):
        spec_of("mt", **options)


MUTANTS = {
    "as late as T_c": ("length == self._min_periods", "length == self._min_periods - 1", check_windows),
    "opening count counted": ("Mux(opens, 0, total)", "Mux(opens, self._one, total)", check_windows),
    "distance goes on": ("Mux(opens, 0, total)", "total", check_windows),
    "no sign rule": ("Mux(self._same, self._one, 0)", "self._one", check_reversals),
    "an edge that is met twice": ("Mux(self.gap_timer.negative, 1, -1)", "0", check_dithering),
    "open after a silence": ("timer.count & timer.opened & late", "timer.count & late", check_silence_in_a_window),
    "distance kept through silence": ("ends | ~timer.opened", "ends", check_silence_in_a_window),
    "age for the length": ("Mux(ends, length, timer.age)", "timer.age", check_windows),
    "one for m_e": ("return self._size +", "return self._one +", check_lattice),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_mutants_are_caught(name: str) -> None:
    right, wrong, check = MUTANTS[name]
    with mutant(mt_method.MTMethod, right, wrong), caught():
        check()
