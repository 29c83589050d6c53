import numpy as np
import pytest
from reference.sequences import PAPER
from support.simulate import clock_by_clock

from tachometry.hdl.methods.alteration import AlterationDetector
from tachometry.hdl.methods.interval import IntervalAccumulator
from tachometry.sim.golden.methods.s import alterations


def make(max_ticks: int = 4, *, seldom: bool = False) -> IntervalAccumulator:
    return IntervalAccumulator(
        max_ticks=max_ticks, kept_ticks=max_ticks // 2, count_width=4, numerator_width=6, cancel=True, seldom=seldom
    )


def test_length_grows_and_keeps_its_newer_half() -> None:
    rows = []
    for k in range(16):
        rows += [{"tick": 1, "moves": 1, "alteration": int(k in (2, 13))}, {"tick": 0, "moves": 0}]
    seen = clock_by_clock(make(), rows, ["m_s", "update", "forced"])[::2]
    assert [row["m_s"] for row in seen] == [1, 2, 3, 1, 2, 3, 4, 3, 4, 3, 4, 3, 4, 3, 1, 2]
    assert [k for k, row in enumerate(seen) if row["update"]] == [2, 6, 8, 10, 12, 13]
    assert [k for k, row in enumerate(seen) if row["update"] and row["forced"]] == [6, 8, 10, 12]


def test_a_window_of_two_ticks_is_the_longest_after_the_first() -> None:
    rows = [{"tick": 1, "moves": 1, "alteration": int(k == 4)} for k in range(8)]
    seen = clock_by_clock(make(2), rows, ["m_s", "update", "forced"])
    assert [row["m_s"] for row in seen] == [1, 2, 2, 2, 2, 1, 2, 2]
    assert [k for k, row in enumerate(seen) if row["update"]] == [1, 2, 3, 4, 6, 7]


def test_nothing_moves_without_a_tick() -> None:
    rows = [{"tick": 0, "moves": 0, "alteration": 1, "pulse_count": 3, "next_count": 2}] * 9
    seen = clock_by_clock(make(), rows, ["m_s", "update"])
    assert all(row == {"m_s": 1, "update": 0} for row in seen)


def test_what_moves_late_stays_until_then() -> None:
    rows = [{"tick": 1, "alteration": 1}, {"tick": 0}, {"moves": 1}, {"moves": 0, "alteration": 0}]
    rows += [{"tick": 1, "moves": 1}, {"tick": 0, "moves": 0}]
    seen = clock_by_clock(make(), rows, ["m_s", "update", "closes"])
    assert [row["update"] for row in seen] == [1, 0, 0, 0, 0, 0]
    assert [row["closes"] for row in seen] == [1, 1, 1, 0, 0, 0]
    assert [row["m_s"] for row in seen] == [1, 1, 1, 1, 1, 2]


@pytest.mark.parametrize("seldom", [False, True])
def test_numerator_is_the_sum_of_both_end_corrections(seldom: bool) -> None:
    """m_e(a) + m_e(i) − 2·m_e(i−1), in the clock before the tick."""
    m_e = [-8, 7, 7, -8, 7]
    idle = [{"tick": 0}] * (2 * seldom)
    rows: list[dict[str, int]] = []
    for before, number in zip([0, *m_e], m_e, strict=False):
        rows += [*idle, {"tick": 0, "pulse_count": before, "next_count": number}]
        rows += [{"tick": 1, "alteration": int(number != before), "pulse_count": number}]
    seen = clock_by_clock(make(seldom=seldom), rows, ["numerator"])
    opening = [0, -8, 7, 7, -8]
    assert [row["numerator"] for row in seen[2 * seldom :: 2 + 2 * seldom]] == [
        a + i - 2 * b for a, b, i in zip(opening, [0, *m_e], m_e, strict=False)
    ]


def test_numerator_with_a_tick_in_every_clock() -> None:
    """The window opens with the tick in this clock."""
    m_e = [-8, 7, 7, -8, 7]
    rows = [
        {"tick": int(k > 0), "alteration": 1, "pulse_count": before, "next_count": number}
        for k, (before, number) in enumerate(zip([0, *m_e], m_e, strict=False))
    ]
    seen = clock_by_clock(make(), rows, ["numerator"])
    assert [row["numerator"] for row in seen] == [i - b for b, i in zip([0, *m_e], m_e, strict=False)]


def test_bad_max_ticks() -> None:
    with pytest.raises(ValueError, match=r"^max_ticks must be at least 2, not 1$"):
        make(1)


def literal(m_e: list[int]) -> list[bool]:
    """Return the definition, tick by tick."""
    previous = offset = 0
    found = []
    for number in m_e:
        alters = number != previous and number != offset
        found.append(alters)
        if not alters:
            offset = number
        previous = number
    return found


def detected(m_e: list[int], pause: int = 0) -> list[bool]:
    """Inject ticks, `pause` idle clocks apart; what is shown until the next."""
    rows: list[dict[str, int]] = []
    for number, before in zip(m_e, [0, *m_e], strict=False):
        rows += [{"coming": 1, "next_count": number, "pulse_count": before, "tick": int(not pause and len(rows) > 0)}]
        if pause:
            rows += [{"coming": 0, "next_count": 3, "pulse_count": number, "tick": 1}] + [{"tick": 0}] * (pause - 1)
    seen = clock_by_clock(AlterationDetector(4, seldom=pause > 0), [*rows, {}], ["alteration"])
    return [bool(row["alteration"]) for row in seen[pause + 1 :: pause + 1]]


def test_the_papers_sequences() -> None:
    for name, (m_e, updates) in PAPER.items():
        at = {tick for tick, _, forced, *_ in updates if not forced}
        assert detected(m_e) == [tick in at for tick in range(len(m_e))], name


@pytest.mark.parametrize("pause", [0, 1, 3])
@pytest.mark.parametrize("seed", range(4))
def test_random_numbers_against_the_definition(seed: int, pause: int) -> None:
    rng = np.random.default_rng(seed)
    m_e = rng.integers(-2, 2, size=400).tolist() + rng.integers(-8, 8, size=50).tolist()
    assert detected(m_e, pause) == literal(m_e), seed


@pytest.mark.parametrize("seed", range(20))
def test_golden_model_against_the_definition(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m_e = rng.integers(0, rng.integers(2, 5), size=5000) - rng.integers(0, 2)
    assert alterations(m_e).tolist() == literal(m_e.tolist()), seed
