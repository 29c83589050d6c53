"""A figure leaves out only what cannot be seen; heat maps of sweeps."""

import resource
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from tachometry.sim.plots.style import columns, in_words, save_figure
from tachometry.sim.plots.sweep import _field, _name, _numbers, save_heat_maps


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


AXES = {"speed": ["1rad/s", "2rad/s", "4rad/s"], "tick": ["10us", "20us"]}


def test_a_field_is_the_median_of_its_points() -> None:
    points: list[tuple[dict[str, str], float | None]]
    points = [({"speed": "1rad/s", "tick": "20us", "seed": str(seed)}, float(seed)) for seed in (1, 2, 30)]
    points += [({"speed": "4rad/s", "tick": "10us"}, None), ({"speed": "4rad/s", "tick": "20us"}, 5.0)]
    np.testing.assert_array_equal(_field(points, AXES), [[np.nan] * 3, [2, np.nan, 5]])


def test_what_has_not_an_axis_is_the_same_along_it() -> None:
    points = [({"speed": speed}, float(k)) for k, speed in enumerate(AXES["speed"])]
    np.testing.assert_array_equal(_field(points, AXES), [[0, 1, 2], [0, 1, 2]])
    np.testing.assert_array_equal(_field(points, {"speed": AXES["speed"]}), [[0, 1, 2]])


def test_a_unit_that_all_have_is_in_the_name() -> None:
    assert (_name("speed", AXES["speed"]), _numbers(AXES["speed"])) == ("speed (rad/s)", ["1", "2", "4"])
    assert (_name("tick", ["10us", "1ms"]), _numbers(["10us", "1ms"])) == ("tick", ["10us", "1ms"])
    assert (_name("lowpass", ["none", "2Hz"]), _numbers(["none", "2Hz"])) == ("lowpass", ["none", "2Hz"])


def test_equal_maps_give_equal_files(tmp_path: Path) -> None:
    at = [{"speed": speed, "tick": tick} for speed in AXES["speed"] for tick in AXES["tick"]]
    methods = [name for name in "abcd" for _ in at]
    for suffix, log in ((".png", True), (".pdf", False)):
        paths = [tmp_path / f"{k}{suffix}" for k in range(2)]
        for path in paths:
            points = [*zip(methods, at * 4, [None, *np.arange(23.0).tolist()], strict=True)]
            save_heat_maps(path, points, AXES, "error", log)
        assert paths[0].read_bytes() == paths[1].read_bytes()
        assert paths[0].stat().st_size > 5000


def test_maps_of_nothing_and_of_one_value(tmp_path: Path) -> None:
    for value in (None, 0.0, 3.0):
        for log in (True, False):
            points = [("s", {"speed": "1rad/s"}, value)]
            save_heat_maps(tmp_path / "m.png", points, {"speed": AXES["speed"]}, "x", log)
