import numpy as np
import pytest
from reference.sequences import PAPER
from support.simulate import clock_by_clock

from tachometry.hdl.methods.alteration import AlterationDetector
from tachometry.sim.golden.methods.s import alterations


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
