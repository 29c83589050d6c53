"""Kalman filters on time-stamped edges, in C++."""

import ctypes
import functools
from importlib.resources import files

import numpy as np

from tachometry.sim import build
from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.studies.comparing.baselines import Estimate, Steps
from tachometry.sim.studies.comparing.estimators import Edges

_TIMEOUT_S = 0.1
_SPEED, _ACCELERATION = 1e3, 1e5  # rad/s and rad/s^2: standard deviations before the first edge
_RANGES = {"process noise": (0, 1e12), "edge noise": (1e-6, 1e6), "dwell": (1e-9, 1e9)}


def edge_kalman(
    steps: Steps,
    process_noise: float,
    order: int = 3,
    agile: float | None = None,
    dwell_s: float = 0.1,
    edge_noise: float = 0.08,
    bound: float = 2.0,
) -> Estimate:
    """Return a Kalman filter whose measurements are the places of edges, each at its time.

    Bar-Shalom, Li, Kirubarajan: Estimation with applications to tracking and navigation, Wiley 2001, has the models in
    section 6.2, and in 11.6 the interacting multiple model (IMM) that two process noises make. The bound and a timeout
    of 0.1 s are those of `least_squares`. It raises ValueError if a parameter is out of range, and OSError if there is
    no C++ compiler.

    - `process_noise`, `agile`, rad/s^1.5 with order 2 (constant velocity), rad/s^2.5 with order 3 (acceleration): Root
      of the density of the white noise that changes the last state; `agile` is that of a second model.
    - `dwell_s`, seconds: Mean time until the shaft changes from one model to the other.
    - `edge_noise`, counts: Standard deviation of the place of an edge.
    """
    noises = (process_noise,) if agile is None else (process_noise, agile)
    names = ["process noise"] * len(noises) + ["edge noise", "dwell"]
    for name, value in zip(names, (*noises, edge_noise, dwell_s), strict=True):
        least, most = _RANGES[name]
        if not least <= value <= most:
            raise ValueError(f"{name} must be from {least:g} to {most:g}, not {value:g}")
    seen = Edges.of(steps, None)
    return seen.estimate(_slopes(seen, noises, order, dwell_s, edge_noise), bound, _TIMEOUT_S)


@functools.lru_cache(maxsize=1)  # for all bounds
def _slopes(seen: Edges, noises: tuple[float, ...], order: int, dwell_s: float, edge_noise: float) -> FloatArray:
    """Return the speed of the filters at each reading, counts/s."""
    slope, noise = np.zeros(len(seen.time)), np.square(np.array(noises) / seen.count_rad)
    prior = _SPEED / seen.count_rad, (order == 3) * _ACCELERATION / seen.count_rad
    numbers = map(ctypes.c_double, (*np.square([edge_noise, *prior]).tolist(), dwell_s, _TIMEOUT_S))
    arrays = (seen.latest, seen.silence, seen.stamp, seen.place, noise, slope)
    *edges, noise_at, slope_at = (ctypes.c_void_p(array.ctypes.data) for array in arrays)
    _library().slopes(ctypes.c_int64(len(slope)), *edges, len(noise), noise_at, order, *numbers, slope_at)
    return slope


@functools.cache
def _library() -> ctypes.CDLL:
    text = files(__package__).joinpath("edge_filters.h").read_text(encoding="utf-8")
    key = build.digest(text, build.version(build.compiler()), build.compiler(), build.flags())
    return ctypes.CDLL(str(build.cached(key, ".so", lambda folder: build.compile_library(text, folder))))
