"""Heat maps of sweeps."""

from pathlib import Path

import numpy as np

from tachometry.sim.plots.sweep import _field, _name, _numbers, save_heat_maps

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
            save_heat_maps(path, methods, at * 4, [None, *np.arange(23.0).tolist()], AXES, "error", log)
        assert paths[0].read_bytes() == paths[1].read_bytes()
        assert paths[0].stat().st_size > 5000


def test_maps_of_nothing_and_of_one_value(tmp_path: Path) -> None:
    for value in (None, 0.0, 3.0):
        for log in (True, False):
            save_heat_maps(
                tmp_path / "m.png", ["s"], [{"speed": "1rad/s"}], [value], {"speed": AXES["speed"]}, "x", log
            )
