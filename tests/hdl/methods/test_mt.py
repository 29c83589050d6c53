"""The M/T method has rules that no other has."""

from typing import Any

import pytest
from support.timed import SILENCE, TICK, run, silence, spec_of, speed

from tachometry.spec import Encoder, MTTachometer


def test_windows() -> None:
    """A count as late as T_c goes on, the next one closes and opens."""
    spec = spec_of("mt", min_time=50, bound_decay=False)
    assert isinstance(spec, MTTachometer)
    at = [5, 30, 55, 60, 80, 110, 111, 161, 162]
    got = run(spec, dict.fromkeys(at, 1), 163)
    windows = [(60, 3, 55), (111, 3, 51), (162, 2, 51)]
    assert got == [(clock, speed(way, time), time, False) for clock, way, time in windows]


def test_reversals() -> None:
    """Half of the ends and all between: where an edge is met twice, the distance is that of the shaft."""
    steps = {5: 1, 15: 1, 25: -1, 35: -1, 45: -1, 60: 1, 70: -1, 80: -1, 115: -1, 125: 1, 170: 1}
    got = run(spec_of("mt", min_time=50, bound_decay=False), steps, 171)
    # +½ +1 −1 −1 −1 +½, then +½ −1 −1 −½, then −½ +1 +½; to the letter the counts after the opening one.
    assert got == [(clock, speed(way, 55), 55, False) for clock, way in ((60, -1), (115, -2), (170, 1))]
    got = run(spec_of("mt", min_time=50, paper_exact=True), steps, 171)
    assert [row[1:3] for row in got] == [(speed(way, 55), 55) for way in (-1, -3, 2)]


def test_lattice() -> None:
    """Eq. (13): the ticks after the opening one, less the edge that a reversal meets twice."""
    spec = spec_of("mt", timer="tick", min_time=2 * TICK, bound_decay=False)
    got = run(spec, {1: 2, 2: 3, 3: -1, 5: 4, 6: 1, 8: 1, 9: -1, 12: -2}, 13 * TICK)
    assert [(row[0] // TICK, row[1], row[2]) for row in got] == [(5, 384, 4), (8, 171, 3), (12, -128, 4)]


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
    busy = spec.form.division_clocks
    steps = dict.fromkeys([5, 45, 45 + busy - 1, 45 + busy], 1)
    got = run(spec, steps, 46 + busy)
    assert got == [(45, speed(1, 40), 40, False), (45 + busy, speed(2, busy), busy, False)]


def test_silence_in_a_window() -> None:
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


def windows(steps: dict[int, int], decoding: int = 4, min_time: int = 50) -> list[tuple[int, int, int]]:
    """Return clock, distance and time of the measurements with whole cycles; none of them is forced."""
    encoder = Encoder(100 // decoding, decoding)
    spec = spec_of("mt", encoder=encoder, min_time=min_time, whole_cycles=True, bound_decay=False)
    found = []
    for clock, velocity, time, forced in run(spec, steps, max(steps) + 1):
        assert not forced
        (distance,) = [one for one in range(-40, 41) if speed(one, time) == velocity]
        found.append((clock, distance, time))
    return found


def test_whole_cycles() -> None:
    """Once a cycle is complete, a window ends with a whole one; 4 counts at x4, 2 at x2, and any number at x1."""
    for sign in (1, -1):
        steps = dict.fromkeys(range(5, 200, 12), sign)
        assert windows(steps) == [(101, 8 * sign, 96), (197, 8 * sign, 96)]
        assert windows(steps, 2) == [(5 + 72 * n, 6 * sign, 72) for n in (1, 2)]
        assert windows(steps, 1) == [(5 + 60 * n, 5 * sign, 60) for n in (1, 2, 3)]
    # The first count later than T_c completes a cycle at once.
    assert windows(dict.fromkeys(range(5, 200, 13), 1)) == [(5 + 52 * n, 4, 52) for n in (1, 2, 3)]


def test_less_than_a_cycle() -> None:
    """A shaft that turns less than a cycle in T_c is measured as without: the first count later than T_c ends it."""
    assert windows(dict.fromkeys(range(5, 200, 20), 1)) == [(5 + 60 * n, 3, 60) for n in (1, 2, 3)]
    # After a fast start too: nothing of the window before is left.
    steps = dict.fromkeys([*range(5, 102, 12), 141, 181, 221], 1)
    assert windows(steps) == [(101, 8, 96), (181, 2, 80)]


def test_patience() -> None:
    """A shaft that slows down within a cycle keeps no window open: any count later than twice T_c ends it."""
    begun = dict.fromkeys(range(5, 50, 10), 1)  # a cycle
    assert windows(begun | {70: 1, 105: 1, 106: 1}) == [(106, 7, 101)]
    assert windows(begun | {70: 1, 140: 1}) == [(140, 6, 135)]
    # The time counts from the count that opened the window; whole cycles go on after it.
    again = dict.fromkeys(range(150, 255, 10), 1)
    assert windows(begun | {70: 1, 140: 1} | again) == [(140, 6, 135), (220, 8, 80)]


def test_turning() -> None:
    """A window in which the shaft turns ends with the first count later than T_c after that."""
    begun = dict.fromkeys(range(5, 50, 10), 1)
    # 4 and 2 there, 1 back: the count that shows the reversal ends it.
    assert windows(begun | {56: 1, 60: 1, 70: -1}) == [(60 + 10, 6, 65)]
    # Earlier reversals too, in either rhythm; and the next window knows nothing of them.
    turned = {5: 1, 15: -1, 25: -1, 35: -1, 45: -1, 52: -1, 58: -1}
    assert windows(turned) == [(58, -5, 53)]
    assert windows(turned | dict.fromkeys(range(68, 180, 10), -1)) == [(58, -5, 53), (138, -8, 80)]
    # The opening count may be against the one before it.
    steps = dict.fromkeys(range(5, 60, 12), 1) | {66: -1} | dict.fromkeys(range(76, 160, 10), -1)
    assert windows(steps) == [(66, 4, 61), (146, -8, 80)]


def test_whole_cycles_after_silence() -> None:
    """The window begins anew with the count after it."""
    before = dict.fromkeys(range(5, 60, 10), 1)
    begin = 55 + SILENCE + 30
    spec = spec_of("mt", min_time=50, whole_cycles=True, bound_decay=False)
    got = run(spec, before | dict.fromkeys(range(begin, begin + 120, 10), 1), begin + 115)
    assert got == [*silence(55, begin), (begin + 80, speed(8, 80), 80, False)]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"whole_cycles": True, "timer": "tick"},
            "whole_cycles must not be given with times in ticks, which are coarser than the errors that cancel",
        ),
        (
            {"whole_cycles": True, "paper_exact": True},
            "whole_cycles must not be given with paper_exact, which has no such windows",
        ),
        ({"min_time": 0}, "min_time must be from 1 to 400 clocks, the maximum time, not 0"),
        ({"min_time": 401}, "min_time must be from 1 to 400 clocks, the maximum time, not 401"),
        ({"min_time": 30, "timer": "tick"}, "min_time must be a multiple of 20 clocks with times in ticks, not 30"),
        ({"timer": "x"}, "timer must be clock or tick, not 'x'"),
    ],
)
def test_bad_options(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}$"):
        spec_of("mt", **options)
