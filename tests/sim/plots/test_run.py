"""A figure leaves out only what cannot be seen."""

import resource
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from tachometry.sim.plots.style import columns, in_words, save_figure


@pytest.mark.parametrize("n", [0, 1, 400])
def test_what_can_be_drawn_is_kept(n: int) -> None:
    x = np.arange(n, dtype=np.float64)
    assert columns(x, x, n_columns=100).tolist() == list(range(n))


def test_each_column_keeps_its_first_least_greatest_and_last() -> None:
    random = np.random.default_rng(1)
    x = np.sort(random.uniform(5, 6, 50_000))
    y = random.standard_normal(50_000)
    kept = columns(x, y, n_columns=100)
    assert len(kept) <= 4 * 101
    assert np.all(np.diff(kept) > 0)
    column = ((x - x[0]) * (100 / (x[-1] - x[0]))).astype(int)
    for k in range(101):
        (every,) = np.nonzero(column == k)
        seen = kept[column[kept] == k]
        assert (seen[0], seen[-1]) == (every[0], every[-1])
        assert (y[seen].min(), y[seen].max()) == (y[every].min(), y[every].max())


def test_one_spike_in_a_million_is_kept() -> None:
    y = np.zeros(1_000_000)
    y[345_678] = 1
    assert 345_678 in columns(np.arange(1_000_000.0), y)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("s", "S method"),
        ("mt:min-time=1ms", "M/T method (min-time=1ms)"),
        ("rairan", "Rairán's method"),
        ("odrive", "odrive"),
    ],
)
def test_legends_speak_in_words(name: str, words: str) -> None:
    assert in_words(name) == words


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_a_disk_that_is_full_within_a_figure_is_told(suffix: str, tmp_path: Path) -> None:
    """Matplotlib forgets it in a PDF, as it cannot end what it has begun."""
    path = tmp_path / f"figure.{suffix}"

    def draw() -> Figure:
        figure = Figure()
        figure.text(0, 0, "ABCDEFGHIJKLMNOPQRSTUVWXYZ")
        return figure

    save_figure(path, draw)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    for least in range(0, path.stat().st_size, 1000):
        resource.setrlimit(resource.RLIMIT_FSIZE, (least, before[1]))
        try:
            with pytest.raises(OSError, match="File too large"):
                save_figure(path, draw)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
