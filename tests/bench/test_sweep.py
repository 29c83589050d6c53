"""The benchmark of sweeps measures what it says."""

from support import docs
from support.script import load

bench = load("sweep")


def test_errors_of_the_page_are_those_of_the_sweep() -> None:
    """The guide says where S is at its worst."""
    places = bench.errors()
    assert len(places) == 80
    assert f"<!-- errors -->\n{bench.bands(places)}<!-- end" in docs.page("measured/sweep.md")
    worst = sorted(places, key=lambda counts: places[counts]["s"])[-4:]
    assert (round(min(worst), 2), round(max(worst), 2)) == (0.35, 0.42)
