"""Constant speeds on discs with displaced edges, as cells of a grid: counts, and what tracking and M/T show of them."""

import ctypes
import functools
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from support.tracking import core
from tachometry.sim import build
from tachometry.sim.golden.methods import track
from tachometry.spec import TrackTachometer
from tachometry.spec.formats import tracking
from tachometry.spec.formats.tracking import LOGS, POWERS

RATES = sorted({Fraction(p, q) for q in range(1, 9) for p in range(1, 49) if Fraction(1, 5) <= Fraction(p, q) <= 6})
DISPLACEMENTS = [k / 20 for k in range(7)]
PHASES = 16
TICKS, SETTLE = 1000, 500  # ticks that are played, and those before errors count
REST, START = 50, 30  # ticks that a shaft rests, and in which it then reaches its speed


def clocks_of(rate: float, cycles: int, pattern: tuple[float, ...] = (0, 1), phases: int = PHASES) -> NDArray[np.int64]:
    """Return the clocks of counts, one cell a row: in motion, then from rest; by displacement, then by phase.

    The edges of a period are displaced by `pattern`, in parts of the displacement.
    """
    n = int(rate * TICKS) + 8
    shifted = np.outer(DISPLACEMENTS, np.resize(pattern, n))[:, None] + (np.arange(phases)[:, None] + 0.5) / phases
    place = np.maximum(np.arange(n) + shifted, 0).reshape(-1, n)
    reached = rate * START / 2
    start = np.where(place < reached, np.sqrt(2 * place * START / rate), START + (place - reached) / rate)
    return np.floor(np.concatenate((place / rate, REST + start)) * cycles).astype(np.int64)


@functools.cache
def library() -> ctypes.CDLL:
    """Return the C++ of the golden model together with track_grid.h."""
    names = track.constants_of(core().form, 0)
    numbers = {name: value for name, value in vars(tracking).items() if name.isupper() and isinstance(value, int)}
    text = "\n".join((
        "#include <algorithm>\n#include <cstdint>\n#include <cstdlib>\n#include <cmath>\n#include <new>",
        *(f"static const int {name} = {value};" for name, value in numbers.items()),
        f"struct Constants {{ int64_t {', '.join(names)}; }};",
        Path(track.__file__).with_name("track.h").read_text(encoding="utf-8"),
        Path(__file__).with_suffix(".h").read_text(encoding="utf-8"),
    ))  # fmt: skip
    key = build.digest(text, build.version(build.compiler()), build.compiler(), build.flags())
    return ctypes.CDLL(str(build.cached(key, ".so", lambda folder: build.compile_library(text, folder))))


def search(spec: TrackTachometer, clocks: NDArray[np.int64], rate: float) -> NDArray[np.float64]:
    """Return the greatest errors of tracking and of M/T after `SETTLE` ticks, in parts of the speed; a row a cell.

    Every second cell turns backward. It raises NoCompiler.
    """
    form, found = spec.form, np.empty((len(clocks), 2))
    constants = np.array(list(track.constants_of(form, spec.program.lead).values()))
    tables = np.concatenate((LOGS, POWERS, np.ravel(form.gains)), dtype=np.int64)
    backward = np.arange(len(clocks), dtype=np.int64) % 2
    places = [ctypes.c_void_p(array.ctypes.data) for array in (constants, tables, clocks, backward, found)]
    cells, most, cycles, n, settle = map(ctypes.c_int64, (*clocks.shape, form.tick_cycles, TICKS, SETTLE))
    lsb, speed = map(ctypes.c_double, (2.0**-form.velocity_out, rate))
    library().search(*places[:2], cells, most, *places[2:4], cycles, n, settle, speed, lsb, places[4])
    return found
