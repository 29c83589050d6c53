"""The fit finds discs that are known, as well as it says, and refuses captures from which it cannot."""

from collections.abc import Callable

import numpy as np
import pytest
from support.discs import coasting, disc, off, swinging
from support.nightly import nightly, only_rows

from tachometry.sim.signals.arrays import Floats
from tachometry.sim.studies.calibrating.calibrate import place_of
from tachometry.sim.studies.calibrating.fit import fit_disc, mean_by_edge, residues, shaft_time
from tachometry.sim.studies.calibrating.runs import Run

Random = np.random.Generator
Make = Callable[[Floats, Random], list[Run]]
Draw = Callable[[Random, Floats], list[Run]]

MARGIN = 1.3
DOWN = (150.0, 60.0)  # rad/s
EVEN = (100.0, 100.0)


def down(turns: float, speeds: tuple[float, float], *ripple: tuple[float, int]) -> Make:
    return lambda table, random: [coasting(table, turns, speeds, random, ripple)]


def sampled(megahertz: float) -> Make:
    def make(table: Floats, random: Random) -> list[Run]:
        run = coasting(table, 50, (100, 50), random)
        return [Run(np.ceil(run.time * megahertz * 1e6) / (megahertz * 1e6), run.first)]

    return make


def wobbling(share: float, hertz: float) -> Make:
    return lambda table, random: [swinging(table, 100, EVEN, random, share, hertz)]


# Edges, what turns them, by how many counts the map may be off without the margin, and whether it says so to 10 %.
ROWS: list[tuple[int, Make, float, bool]] = [
    (2000, down(13, EVEN), 0.014, True),
    (2000, down(25, EVEN), 0.0095, True),
    (2000, down(50, EVEN), 0.0065, True),
    (2000, down(100, EVEN), 0.0045, True),
    (24, down(50, EVEN), 0.0065, False),
    (96, down(50, EVEN), 0.0065, False),
    (10_000, down(13, EVEN), 0.014, True),
    (2000, down(50, DOWN), 0.0066, True),
    (2000, down(50, (150, 100)), 0.0072, False),
    (2000, down(50, (100, 70)), 0.0074, False),
    *((2000, sampled(rate), most, False) for rate, most in ((0.1, 0.014), (0.2, 0.0105), (1, 0.0089), (24, 0.0088))),
    (2000, down(50, DOWN, (0.01, 6)), 0.0072, True),
    (2000, down(50, DOWN, (0.01, 1)), 0.0098, False),
    (2000, down(50, DOWN, (0.003, 1)), 0.0072, True),
    (2000, wobbling(0.01, 0.5), 0.0045, True),
    (2000, wobbling(0.003, 2), 0.0045, True),
    (2000, wobbling(0.003, 5), 0.0046, True),
    (2000, wobbling(0.01, 5), 0.0051, False),
    (2000, wobbling(0.003, 9.3), 0.0056, False),
]
SHORT = [ROWS[place] for place in (0, 2, 5, 7, 10, 15, 19)]


# One of each kind of row; the others differ by numbers.
@pytest.mark.parametrize(("n", "make", "most", "says"), only_rows(SHORT, ROWS))
def test_displacements_are_as_good_as_documented(n: int, make: Make, most: float, says: bool) -> None:
    wrong, said = [], []
    for seed in range(71, 74):
        random = np.random.default_rng(seed)
        table = disc(n, random)
        fit = fit_disc(make(table, random), n)
        wrong.append(off(fit, table))
        said.append(fit.error)
    assert np.mean(wrong) < MARGIN * most
    assert not says or np.mean(said) == pytest.approx(np.mean(wrong), rel=0.1)


def test_the_ripple_of_the_torque_is_found() -> None:
    """A ripple of 1 % at 100 rad/s, six times in a turn, displaces edges by 0.01 n / (2 pi 6) counts there."""
    random = np.random.default_rng(1)
    table = disc(400, random)
    fit = fit_disc([coasting(table, 50, DOWN, random, [(0.01, 6)])], 400)
    assert fit.ripple is not None
    top = fit.speeds[1] / 100
    assert abs(fit.ripple[5]) * top**2 == pytest.approx(0.01 * 400 / (2 * np.pi * 6), rel=0.01)


@pytest.mark.parametrize("n", [24, 25])
def test_the_time_of_the_shaft_is_exact_for_a_parabola(n: int) -> None:
    count = np.arange(6.0 * n)
    true = 1e-3 * count + 1e-6 * count**2
    table = np.random.default_rng(1).uniform(-1e-4, 1e-4, n)
    found, first = shaft_time(true + (table - table.mean())[np.arange(6 * n) % n], n)
    assert np.ptp(found - true[first : first + len(found)]) < 1e-12


def clean(random: Random, table: Floats) -> list[Run]:
    ripple, way = (random.uniform(0, 0.003), int(random.integers(1, 7))), int(random.choice([1, -1]))
    return [coasting(table, 60, (150, random.uniform(50, 85)), random, [ripple], direction=way)]


def ripple_at_one_speed(random: Random, table: Floats) -> list[Run]:
    return [coasting(table, 50, EVEN, random, [(random.uniform(0.0003, 0.01), int(random.integers(1, 7)))])]


def ripple_at_two_speeds(random: Random, table: Floats) -> list[Run]:
    ripple = (random.uniform(0.002, 0.01), int(random.integers(1, 4)))
    return [coasting(table, 30, (speed, speed), random, [ripple]) for speed in (60.0, 150.0)]


def swing(counts: tuple[float, float], hertz: tuple[float, float]) -> Draw:
    """Return what draws a coasting run that swings by so many counts."""

    def draw(random: Random, table: Floats) -> list[Run]:
        often = random.uniform(*hertz)
        share = random.uniform(*counts) * (2 * np.pi) ** 2 / len(table) * often / DOWN[0]
        return [swinging(table, 50, DOWN, random, share, often)]

    return draw


POISONS = (ripple_at_one_speed, ripple_at_two_speeds, swing((0.5, 2), (9.3, 33)), swing((10, 20), (5, 8)))
COUNTS = (96, 400, 2000)


def drawn(number: int, kinds: tuple[Draw, ...]) -> list[str]:
    """Return the reasons why a capture of this number is refused."""
    random = np.random.default_rng(9000 + number)
    n = COUNTS[number // len(kinds) % 3]
    return fit_disc(kinds[number % len(kinds)](random, disc(n, random)), n).reasons


@pytest.mark.parametrize("numbers", [range(10), pytest.param(range(10, 100), marks=nightly)], ids=str)
def test_poisoned_captures_are_refused(numbers: range) -> None:
    assert [number for number in numbers if not drawn(number, POISONS)] == []


@pytest.mark.parametrize("numbers", [range(10), pytest.param(range(10, 100), marks=nightly)], ids=str)
def test_clean_captures_are_taken(numbers: range) -> None:
    assert [(number, reasons) for number in numbers if (reasons := drawn(number, (clean,)))] == []


def test_few_turns_are_refused_and_one_speed_can_be_accepted() -> None:
    random = np.random.default_rng(3)
    table = disc(400, random)
    few = fit_disc([coasting(table, 8, EVEN, random)], 400).reasons
    assert any("5 whole turns are used, and at least 6 are needed" in reason for reason in few)
    fit = fit_disc([coasting(table, 50, EVEN, random)], 400)
    assert [reason.split(",")[0] for reason in fit.reasons] == ["there is one speed"]
    assert fit_disc([coasting(table, 50, EVEN, random)], 400, one_speed=True).reasons == []


@pytest.mark.parametrize("n", [96, 2000])
def test_the_pattern_shows_how_a_disc_lies(n: int) -> None:
    """Four turns do, and another disc is never taken for it."""
    for seed in range(5):
        random = np.random.default_rng(seed)
        table, other, turned = disc(n, random), disc(n, random), int(random.integers(-n // 2, n // 2))
        run = coasting(np.roll(table, -turned), 7, (40, 40), random)
        found = mean_by_edge(*residues(run, n, np.zeros(n), np.zeros(n), 1.0)[:2], n)
        assert place_of(table, found)[0] == turned
        assert place_of(table, found)[1] > 1.25 > place_of(other, found)[1]
