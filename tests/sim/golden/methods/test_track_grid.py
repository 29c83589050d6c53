"""Speeds at which ticks meet the same edges again and again: tracking locks to no wrong speed, whatever the disc.

A tick takes some edges together. Where their displacements cancel, the noise that is learned is less than the error of
an edge that comes alone.
"""

import ctypes
import functools
from fractions import Fraction
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import nightly, only, only_rows
from support.tracking import core
from support.verilog import LintingVerilator

from tachometry.sim import build, golden
from tachometry.sim.engines.engine import Engine
from tachometry.sim.golden.methods import track
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import TachometerSpec, TrackTachometer, of_texts
from tachometry.spec.formats import tracking
from tachometry.spec.formats.tracking import LOGS, POWERS

RATES = sorted({Fraction(p, q) for q in range(1, 9) for p in range(1, 49) if Fraction(1, 5) <= Fraction(p, q) <= 6})
DISPLACEMENTS = [k / 20 for k in range(7)]
PHASES = 16
TICKS, SETTLE = 1000, 500  # ticks that are played, and those before errors count
RESTING, START = 50, 30  # ticks that a shaft rests, and in which it then reaches its speed


def clocks_of(rate: float, cycles: int, pattern: tuple[float, ...] = (0, 1), phases: int = PHASES) -> NDArray[np.int64]:
    """Return the clocks of counts, one cell a row: in motion, then from rest; by displacement, then by phase.

    The edges of a period are displaced by `pattern`, in parts of the displacement.
    """
    n = int(rate * TICKS) + 8
    shifted = np.outer(DISPLACEMENTS, np.resize(pattern, n))[:, None] + (np.arange(phases)[:, None] + 0.5) / phases
    place = np.maximum(np.arange(n) + shifted, 0).reshape(-1, n)
    reached = rate * START / 2
    start = np.where(place < reached, np.sqrt(2 * place * START / rate), START + (place - reached) / rate)
    return np.floor(np.concatenate((place / rate, RESTING + start)) * cycles).astype(np.int64)


@functools.cache
def library() -> ctypes.CDLL:
    """Return the C++ of the golden model together with test_track_grid.h."""
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
    constants = np.array(list(track.constants_of(form, spec.program.ahead).values()))
    tables = np.concatenate((LOGS, POWERS, np.ravel(form.gains)), dtype=np.int64)
    backward = np.arange(len(clocks), dtype=np.int64) % 2
    places = [ctypes.c_void_p(array.ctypes.data) for array in (constants, tables, clocks, backward, found)]
    cells, most, cycles, n, settle = map(ctypes.c_int64, (*clocks.shape, form.tick_cycles, TICKS, SETTLE))
    lsb, speed = map(ctypes.c_double, (2.0**-form.velocity_out, rate))
    library().search(*places[:2], cells, most, *places[2:4], cycles, n, settle, speed, lsb, places[4])
    return found


Pattern = tuple[float, ...]
QUADRATURE = core(clock="48MHz", tick="20us", max_speed="1000rad/s")
SLOW = core(ppr="16", clock="1MHz", tick="1ms")  # which tests/sim/engines/test_idle.py compiles, too
HALLS = of_texts("track", {"sensor": "hall", "pole-pairs": "10", "tick": "1ms", "max-speed": "700rad/s"})
# The edges of halls have a period of six, and tracking learns four kinds: a period of three is noise to it.
QUICK_HALLS = [((0, 1), 2), ((1, 0, 0), 2), ((1, 1, 1, 0, 0, 0), 2)]
MORE_HALLS = [
    *(pattern for pattern, _ in QUICK_HALLS),
    (0.5, -0.5, 0),
    (1, 0, 0, 0, 0, 0),
    (1, 1, 0, 0, 0, 0),
    (0.5, -0.2, 0.3, -0.5, 0.2, 0),
]
DISCS = [(0, 1), (0, 1, 0, 0), (1, 1, 0, 0), (0.5, -0.5, 0.5, -0.2)]


def check(spec: TachometerSpec, pattern: Pattern, phases: int, drift: float = 0) -> int:
    """Search the grid; the error is at most a tenth of that of M/T, or 0.2 % of the speed. Return the number of cells.

    Rates are `drift` of them faster than fractions.
    """
    assert isinstance(spec, TrackTachometer)
    speeds = [float(rate) * (1 + drift) for rate in RATES]
    cycles = spec.form.tick_cycles
    found = np.array([search(spec, clocks_of(speed, cycles, pattern, phases), speed) for speed in speeds])
    tracked, divided = np.moveaxis(found, -1, 0)
    wrong = np.argwhere(tracked > np.maximum(divided / 10, 0.002))
    assert not len(wrong), [(str(RATES[rate]), int(cell), tracked[rate, cell]) for rate, cell in wrong[:10]]
    assert divided.max() > 0.3
    return int(tracked.size)


@pytest.mark.parametrize("phases", only([PHASES // 2], [PHASES // 2, PHASES]))
def test_no_wrong_speed_is_locked_to_in_quadrature(phases: int) -> None:
    assert check(QUADRATURE, (0, 1), phases) == 1806 * phases


@pytest.mark.parametrize(("pattern", "phases"), only_rows(QUICK_HALLS, [*QUICK_HALLS, *product(MORE_HALLS, [PHASES])]))
def test_no_wrong_speed_is_locked_to_with_halls(pattern: Pattern, phases: int) -> None:
    check(HALLS, pattern, phases)


@nightly
@pytest.mark.parametrize("drift", [0, 5e-4, -2e-3])
@pytest.mark.parametrize("pattern", DISCS, ids=str)
def test_no_wrong_speed_is_locked_to_on_other_discs(pattern: Pattern, drift: float) -> None:
    check(QUADRATURE, pattern, PHASES, drift)
    check(SLOW, pattern, PHASES // 2, drift)


# Rates, and cells of these. The first ones once read half of the speed; the last two are the worst of all now.
CELLS = [
    *((Fraction(1), cell) for cell in (107, 92, 46)), (Fraction(4, 5), 108), (Fraction(15, 7), 109),
    *((Fraction(1, 5), cell) for cell in (114, 117)),
]  # fmt: skip
REST = 10  # ticks before


def error(rate: Fraction, cell: int, engine: Engine | None = None) -> float:
    """Return the greatest error that pins show of a cell of `SLOW` after `SETTLE` ticks, in parts of the speed.

    With an engine, the core must show all that the golden model does.
    """
    cycles = SLOW.form.tick_cycles
    clock = clocks_of(float(rate), cycles)[cell] + REST * cycles - SLOW.latency.pin_to_count
    level = quadrature(np.arange(len(clock) + 1) * (-1) ** cell)
    ends = (TICKS + REST) * cycles + SLOW.latency.tick_to_velocity + 10
    trace = PinTrace(np.append(0, clock), level & np.uint8(1), level >> np.uint8(1), ends).until(ends)
    run = golden.run(SLOW, trace)
    if engine is not None:
        found = lockstep(SLOW, trace, engine, expected=run)
        assert found.n_mismatches == 0, found.first
    velocity = run.updates.velocity[REST + SETTLE : REST + TICKS]
    assert len(velocity) == TICKS - SETTLE
    return float(np.abs((-1) ** cell * velocity * 2.0**-SLOW.form.velocity_out / float(rate) - 1).max())


@pytest.mark.parametrize(("rate", "cell"), CELLS)
def test_pins_show_the_errors_of_the_search(rate: Fraction, cell: int) -> None:
    """In the golden model, which needs no compiler."""
    wrong = error(rate, cell)
    assert wrong < 0.002
    if build.find_compiler():
        assert wrong == search(SLOW, clocks_of(float(rate), SLOW.form.tick_cycles), float(rate))[cell, 0]


@nightly
def test_the_exported_core_plays_the_worst_cells(tmp_path: Path) -> None:
    for rate, cell in CELLS:
        assert error(rate, cell, LintingVerilator(tmp_path, few=False)) < 0.002
