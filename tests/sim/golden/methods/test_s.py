"""The golden model against the papers' words and against the definition tick by tick, not against itself."""

from fractions import Fraction
from math import ceil, floor

import numpy as np
import pytest
from reference.front import Tick
from reference.sequences import MAX_TICKS, PAPER, rounded
from reference.settings import Settings
from reference.tsuji import s_updates

from tachometry.sim.golden.methods.s import Model
from tachometry.sim.golden.quotient import round_quotient
from tachometry.sim.golden.standstill import with_standstill
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, STachometer, Timing


def model(max_ticks: int, *, cancel: bool = True, frac_bits: int = 16) -> Model:
    timing = Timing(clock_hz=1_000_000, tick_cycles=16, max_ticks=max_ticks)
    return Model(STachometer(encoder=Encoder(25), timing=timing, frac_bits=frac_bits, cancel=cancel))


def as_ticks(m_e: list[int]) -> Table:
    clock = 16 * np.arange(len(m_e), dtype=np.int64)
    numbers = np.array(m_e, dtype=np.int64)
    return Table(clock, {"pulse_count": numbers})


def results(m_e: list[int], max_ticks: int, **options: bool) -> list[tuple[int, int, bool, bool, int]]:
    """Return (tick, m_s, forced, standstill, raw velocity) of every update; `standstill` is that of the tick."""
    s_model, ticks = model(max_ticks, **options), as_ticks(m_e)
    found = s_model.updates(ticks, None, 1 << 40)
    cause = (found.clock - s_model._spec.latency.datapath) // 16
    standstill = with_standstill(s_model._spec, ticks, np.ones(len(m_e), dtype=np.int64)).standstill[cause]
    columns = (cause, found.interval, found.forced, standstill, found.velocity)
    return list(zip(*(column.tolist() for column in columns), strict=True))


@pytest.mark.parametrize("cancel", [True, False])
@pytest.mark.parametrize("name", PAPER)
def test_the_papers_sequences(name: str, cancel: bool) -> None:
    m_e, updates = PAPER[name]
    got = [(tick, m_s, forced, raw) for tick, m_s, forced, _, raw in results(m_e, MAX_TICKS, cancel=cancel)]
    assert got == [
        (tick, m_s, forced, rounded(eq21 if cancel else eq17, 16)) for tick, m_s, forced, eq17, eq21 in updates
    ]


def definition(m_e: list[int], max_ticks: int, cancel: bool) -> list[tuple[int, int, bool, bool, int]]:
    """Return those of the naive model; S rests if nothing was counted in a forced window."""
    words = {"tick": "16clk", "max-time": f"{16 * max_ticks}clk", "cancel": "yes" if cancel else "no"}
    found = s_updates(Settings("s", words), [Tick(i, number, False, 0, not number) for i, number in enumerate(m_e)])
    quiet = [not any(m_e[max(one.cause - one.interval, 0) : one.cause + 1]) for one in found]
    return [
        (one.cause, one.interval, one.forced, one.forced and rests, rounded(one.speed, 16))
        for one, rests in zip(found, quiet, strict=True)
    ]


@pytest.mark.parametrize("cancel", [True, False])
@pytest.mark.parametrize("max_ticks", [2, 3, 4, 7, 20])
@pytest.mark.parametrize("seed", range(5))
def test_random_numbers_against_the_definition(seed: int, max_ticks: int, cancel: bool) -> None:
    rng = np.random.default_rng(seed)
    m_e: list[int] = []
    while len(m_e) < 1500:
        offset, run = int(rng.integers(-16, 17)), int(rng.integers(1, 4 * max_ticks))
        m_e += np.clip(offset + rng.choice([0, 0, 0, 0, 1, -1], size=run), -16, 16).tolist()
    assert results(m_e, max_ticks, cancel=cancel) == definition(m_e, max_ticks, cancel), seed


def test_rounding_of_ties_and_of_the_largest_numbers() -> None:
    numerator = np.array([1, -1, 3, -3, 5, -5, 0, (1 << 44) - 1, -(1 << 44) + 1])
    denominator = np.array([32, 32, 32, 32, 32, 32, 7, (1 << 21) - 1, (1 << 21) - 1])
    for frac_bits in (4, 16, 24):
        got = round_quotient(numerator, denominator, frac_bits).tolist()
        assert got == [
            rounded(Fraction(int(n), int(d)), frac_bits) for n, d in zip(numerator, denominator, strict=True)
        ]


@pytest.mark.parametrize("eighths", [0, 1, 4, 8])
@pytest.mark.parametrize("cancel", [True, False])
@pytest.mark.parametrize("name", PAPER)
def test_bounds_are_a_count_and_the_edge_error_over_the_window(name: str, cancel: bool, eighths: int) -> None:
    """Rounded outward. The first window, which begins with reset, has none."""
    m_e, updates = PAPER[name]
    spec = STachometer(
        encoder=Encoder(25),
        timing=Timing(clock_hz=1_000_000, tick_cycles=16, max_ticks=MAX_TICKS),
        frac_bits=7,
        cancel=cancel,
        bounds=True,
        edge_error=Fraction(eighths, 8),
    )
    found = Model(spec).updates(as_ticks(m_e), None, 1 << 40)
    exact = [(plain, cancelled)[cancel] for *_, plain, cancelled in updates]
    off = [(1 + Fraction(eighths, 8)) / m_s for _, m_s, *_ in updates]
    assert found["velocity_lower"].tolist() == [floor((x - d) * 2**7) for x, d in zip(exact, off, strict=True)]
    assert found["velocity_upper"].tolist() == [ceil((x + d) * 2**7) for x, d in zip(exact, off, strict=True)]
    assert found["bounds_valid"].tolist() == [k > 0 for k in range(len(updates))]


@pytest.mark.parametrize("cancel", [True, False])
def test_a_step_to_a_whole_number_of_counts_is_shown_after_the_maximum_time(cancel: bool) -> None:
    """1/(2·m_s) of the step, or 1/m_s of it, is shown till then; 14.4 of 1500 rpm after 51 ticks of rest."""
    most, parts = 500, 2 if cancel else 1
    for rest, counts in [(51, 1), (51, 7), *((500 + more, 1) for more in range(0, 500, 83))]:
        found = [row for row in results([0] * rest + [counts] * 1000, most, cancel=cancel) if row[0] >= rest]
        (tick, m_s, forced, _, raw), (after, _, late, _, right) = found[:2]
        assert (tick, forced, after, late) == (rest, False, rest + most, True)
        assert raw == rounded(Fraction(counts, parts * m_s), 16)
        assert right == counts << 16
        assert rest < most or m_s * parts >= model(most, cancel=cancel)._spec.form.rest_divisor
    assert round(1500 / (2 * 52), 1) == 14.4
