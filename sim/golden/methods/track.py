"""Golden tracking method: what each tick holds, and the recursion in C++, or in Python where there is no compiler."""

import ctypes
import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from tachometry.sim import build
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods.track_recursion import Recursion
from tachometry.sim.signals.run import Table
from tachometry.spec import TrackTachometer
from tachometry.spec.formats import tracking
from tachometry.spec.formats.tracking import LOGS, PLACE_BITS, POWERS, Tracking


@dataclass(frozen=True)
class Windows:
    """Holds the counts of every tick, as columns of one length."""

    number: NDArray[np.int64]  # counts that an event takes: the first ones of the tick
    times: NDArray[np.int64]  # sum of the clocks from each of these to the end of the tick
    # sum of twice the places of their edges, in counts from the place at the beginning of the tick
    places: NDArray[np.int64]
    last: NDArray[np.int64]  # clocks from the last count of the tick to its end
    moved: NDArray[np.int64]  # forward counts less backward ones
    # which of four edges the last of these was of: the lower one of the two positions around it, modulo 4
    kind: NDArray[np.int64]
    down: NDArray[np.int64]  # whether it went backward
    end: NDArray[np.int64]  # position at the end of the tick, since reset, modulo 4
    length: NDArray[np.int64]  # clocks of the tick

    @classmethod
    def of(cls, steps: Steps, last: NDArray[np.int64], most: int) -> "Windows":
        """Return the counts of windows that end with the clocks `last`, of which an event takes `most`."""
        counted = (steps.step != 0) & (steps.clock <= (last[-1] if len(last) else -1))
        clock, step = steps.clock[counted], steps.step[counted].astype(np.int64)
        window = np.searchsorted(last, clock)
        through = np.append(0, np.cumsum(step))  # place before each count, and at last
        first = np.searchsorted(clock, np.append(-1, last[:-1]), side="right")  # count of each tick
        until = np.searchsorted(clock, last, side="right")
        begin = through[first]
        age = last[window] - clock
        taken = np.arange(len(clock)) - first[window] < most

        def summed(values: NDArray[np.int64]) -> NDArray[np.int64]:
            total = np.append(0, np.cumsum(np.where(taken, values, 0)))
            return total[until] - total[first]

        some = until > first
        latest = np.minimum(until, first + most) - 1  # of an empty tick it is not used
        lower = through[:-1] - (step < 0)  # of the two positions around an edge
        none = np.zeros(len(last), dtype=np.int64)

        def of_count(values: NDArray[np.int64], which: NDArray[np.int64]) -> NDArray[np.int64]:
            found = none.copy()
            found[some] = values[which[some]]
            return found

        return cls(
            number=np.minimum(until - first, most),
            times=summed(age),
            places=summed(2 * (through[:-1] - begin[window]) + step),
            last=of_count(age, until - 1),
            moved=through[until] - begin,
            kind=of_count(lower & 3, latest),
            down=of_count(step < 0, latest),
            end=through[until] & 3,
            length=np.diff(last, prepend=-1),
        )

    def rows(self) -> Iterator[tuple[int, ...]]:
        """Yield what `Recursion.tick` takes, tick by tick."""
        yield from zip(*(column.tolist() for column in vars(self).values()), strict=True)


Rows = Callable[[Tracking, int, Windows], NDArray[np.int64]]


def rows(form: Tracking, lead: int, windows: Windows) -> NDArray[np.int64]:
    """Return what is shown in each tick, shape (n, 4), by the Python model."""
    state = Recursion(form, lead)
    return np.array([state.tick(*row) for row in windows.rows()], dtype=np.int64).reshape(-1, 4)


def constants_of(form: Tracking, lead: int) -> dict[str, int]:
    """Return what the C++ text takes of a form, by names."""
    bits = {"lead": lead << form.time_bits, "time_bits": form.time_bits, "factor_bits": form.factor_bits}
    return {**form.constants, **form.shifts, **bits}


@functools.cache
def compiled(names: tuple[str, ...]) -> Rows | None:
    """Return the same by its twin in C++, made once for all; None: there is no compiler."""
    if build.find_compiler() is None:
        return None
    numbers = {name: value for name, value in vars(tracking).items() if name.isupper() and isinstance(value, int)}
    text = "\n".join(
        (
            "#include <algorithm>\n#include <cstdint>\n#include <cstdlib>",
            *(f"static const int {name} = {value};" for name, value in numbers.items()),
            f"struct Constants {{ int64_t {', '.join(names)}; }};",
            files(__package__).joinpath("track.h").read_text(encoding="utf-8"),
        )
    )
    key = build.digest(text, build.version(build.compiler()), build.compiler(), build.flags())
    library = ctypes.CDLL(str(build.cached(key, ".so", lambda folder: build.compile_library(text, folder))))
    tables = np.array((*LOGS, *POWERS), dtype=np.int64)

    def of(form: Tracking, lead: int, windows: Windows) -> NDArray[np.int64]:
        constants = np.array(list(constants_of(form, lead).values()), dtype=np.int64)
        all_tables = np.concatenate((tables, np.array(form.gains, dtype=np.int64).ravel()))
        columns = np.array([*vars(windows).values()], dtype=np.int64)
        found = np.empty((columns.shape[1], 4), dtype=np.int64)
        where = [ctypes.c_void_p(array.ctypes.data) for array in (constants, all_tables, columns, found)]
        library.track(where[0], where[1], ctypes.c_int64(columns.shape[1]), where[2], where[3])
        return found

    return of


class Model:
    """Computes the tracking method."""

    def __init__(self, spec: TrackTachometer) -> None:
        self._spec = spec

    def updates(self, ticks: Table, steps: Steps, n_clocks: int) -> Table:
        """Return all updates below `n_clocks` clocks, with the velocity in counts per tick as the datapath has it."""
        spec = self._spec
        windows = Windows.of(steps, ticks.clock - spec.latency.tick, spec.form.most_number)
        lead = spec.program.lead
        found = (compiled(tuple(constants_of(spec.form, lead))) or rows)(spec.form, lead, windows)
        velocity, place, quality, acceleration = found.T
        unused, shift = 64 - spec.position_width - spec.fine_bits, PLACE_BITS - spec.fine_bits
        fine = (ticks.position << spec.fine_bits) + ((place + (1 << shift - 1)) >> shift)
        counted = windows.number > 0
        number = np.arange(len(counted))
        before = np.maximum.accumulate(
            np.append(-spec.timing.max_ticks, np.where(counted, number, -spec.timing.max_ticks))
        )[:-1]
        columns = {
            "velocity": velocity,
            "interval": np.minimum(number - before, spec.timing.max_ticks),
            "forced": ~counted,
            "acceleration": acceleration,
            "quality": quality,
            "position_fine": fine << unused >> unused,
        }
        return Table(ticks.clock + spec.latency.datapath, columns)
