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
from tachometry.sim.golden.methods.settling import Settled
from tachometry.sim.golden.methods.track_recursion import Recursion
from tachometry.sim.golden.methods.track_sampled import SampledRecursion
from tachometry.sim.signals.run import Table
from tachometry.spec import TrackTachometer
from tachometry.spec.formats import tracking
from tachometry.spec.formats.tracking import LOGS, POWERS, Tracking
from tachometry.spec.formats.tracking_code import SMOOTH, SMOOTH_DELAY_BITS
from tachometry.spec.formats.tracking_sampled import SampledTracking


@dataclass(frozen=True)
class Windows:
    """Holds the counts of every tick, as columns of one length."""

    number: NDArray[np.int64]  # counts that an event takes: the first ones of the tick
    # times: sum of the clocks from each of these to the end of the tick; places: sum of twice the places of the edges,
    # in counts from the place at the beginning of the tick, and as fine as displacements. Without counts, displacements
    # of the edges below and above
    times: NDArray[np.int64]
    places: NDArray[np.int64]
    last: NDArray[np.int64]  # clocks from the last count of the tick to its end
    moved: NDArray[np.int64]  # forward counts less backward ones
    # which of four edges the last of these was of: the lower one of the two positions around it, modulo 4
    kind: NDArray[np.int64]
    down: NDArray[np.int64]  # whether it went backward
    end: NDArray[np.int64]  # position at the end of the tick, since reset, modulo 4
    length: NDArray[np.int64]  # clocks of the tick

    @classmethod
    def of(cls, steps: Steps, last: NDArray[np.int64], most: int, begin: int = -1, place: int = 0) -> "Windows":
        """Return every count of windows that end with the clocks `last`, of which an event takes `most`.

        The first window comes after the clock `begin`, which ends at the position `place`.
        """
        chosen = slice(*np.searchsorted(steps.clock, (begin, last[-1] if len(last) else begin), side="right"))
        counted = steps.step[chosen] != 0
        clock, step = steps.clock[chosen][counted], steps.step[chosen][counted].astype(np.int64)
        window = np.searchsorted(last, clock)
        through = np.cumsum(np.append(place, step))  # place before each count, and at last
        first = np.searchsorted(clock, np.append(begin, last[:-1]), side="right")  # count of each tick
        until = np.searchsorted(clock, last, side="right")
        before = through[first]
        age = last[window] - clock
        taken = np.arange(len(clock)) - first[window] < most

        def summed(values: NDArray[np.int64]) -> NDArray[np.int64]:
            total = np.append(0, np.cumsum(np.where(taken, values, 0)))
            return total[until] - total[first]

        some = until > first
        latest = np.minimum(until, first + most) - 1  # of an empty tick it is not used
        lower = through[:-1] - (step < 0)  # of the two positions around an edge
        none = np.zeros(len(last), dtype=np.int64)
        places = summed(2 * (through[:-1] - before[window]) + step) << steps.fine_bits
        above = below = none
        if steps.around is not None:
            places += summed(steps.displaced[chosen][counted])
            above, below = steps.around(last)

        def of_count(values: NDArray[np.int64], which: NDArray[np.int64]) -> NDArray[np.int64]:
            found = none.copy()
            found[some] = values[which[some]]
            return found

        return cls(
            number=np.minimum(until - first, most),
            times=np.where(some, summed(age), below),
            places=np.where(some, places, above),
            last=of_count(age, until - 1),
            moved=through[until] - before,
            kind=of_count(lower & 3, latest),
            down=of_count(step < 0, latest),
            end=through[until] & 3,
            length=np.diff(last, prepend=begin),
        )

    @classmethod
    def of_reads(cls, ticks: Table, form: SampledTracking) -> "Windows":
        """Return the reads of ticks: `kind` and `places` are their phase, `end` has the ticks since one; `last` is the
        number of the offset that a program reads, `down` what it writes.
        """
        none, number = np.zeros(len(ticks), dtype=np.int64), ticks.number.astype(np.int64)
        kind, fine = form.phase(ticks.phase) if form.period_bits else (none, none)
        end = np.where(ticks.forgets, form.max_ticks, ticks.silent)
        return cls(number, ticks.times, fine, ticks.asked, ticks.pulse_count, kind, ticks.written, end, ticks.length)

    def rows(self) -> Iterator[tuple[int, ...]]:
        """Yield what `Recursion.tick` takes, tick by tick."""
        yield from zip(*(column.tolist() for column in vars(self).values()), strict=True)


# What is shown in each tick, shape (n, COLUMNS), of windows that come after those of the call before.
Rows = Callable[[Windows], NDArray[np.int64]]
Begin = Callable[[Tracking, int], Rows]
COLUMNS = 7  # those of `track_recursion.Row`, and in track.h
_PIECE = 1 << 16  # ticks at a time, for which memory is needed beside that of the columns


def rows(form: Tracking, lead: int) -> Rows:
    """Return the Python model after a reset."""
    state = Recursion(form, lead, smooth=True)
    if isinstance(form, SampledTracking):
        reads = SampledRecursion(form, lead, smooth=True)

        def of_reads(windows: Windows) -> NDArray[np.int64]:
            made = [(reads.exchanged(row[3], row[6]), *reads.tick(*row)) for row in windows.rows()]
            return np.array(made, dtype=np.int64).reshape(-1, COLUMNS + 1)

        return of_reads
    return lambda windows: np.array([state.tick(*row) for row in windows.rows()], dtype=np.int64).reshape(-1, COLUMNS)


def constants_of(form: Tracking, lead: int) -> dict[str, int]:
    """Return what the C++ text takes of a form, by names."""
    bits = {"ahead": lead << form.time_bits, "time_bits": form.time_bits, "factor_bits": form.factor_bits}
    bits["fine"] = form.fine_bits
    return {**form.constants, **form.shifts, **bits}


@functools.cache
def compiled(names: tuple[str, ...]) -> Begin | None:
    """Return the same by its twin in C++, made once for all; None: there is no compiler."""
    if build.find_compiler() is None:
        return None
    numbers = {name: value for name, value in vars(tracking).items() if name.isupper() and isinstance(value, int)}
    text = "\n".join(
        (
            "#include <algorithm>\n#include <cstdint>\n#include <cstdlib>\n#include <new>",
            *(f"static const int {name} = {value};" for name, value in numbers.items()),
            f"struct Constants {{ int64_t {', '.join(names)}; }};",
            files(__package__).joinpath("track.h").read_text(encoding="utf-8"),
        )
    )
    key = build.digest(text, build.version(build.compiler()), build.compiler(), build.flags())
    library = ctypes.CDLL(str(build.cached(key, ".so", lambda folder: build.compile_library(text, folder))))
    library.size.restype = ctypes.c_int64

    def of(form: Tracking, lead: int) -> Rows:
        constants = np.array(list(constants_of(form, lead).values()), dtype=np.int64)
        tables = np.concatenate((LOGS, POWERS, np.ravel(form.gains)), dtype=np.int64)
        state = np.empty(library.size(), dtype=np.uint8)
        library.begin(*(ctypes.c_void_p(array.ctypes.data) for array in (state, constants, tables)))

        def shown(windows: Windows) -> NDArray[np.int64]:
            columns = np.array([*vars(windows).values()], dtype=np.int64)
            found = np.empty((columns.shape[1], COLUMNS), dtype=np.int64)
            begun, given, taken = (ctypes.c_void_p(array.ctypes.data) for array in (state, columns, found))
            library.track(begun, ctypes.c_int64(len(found)), given, taken)
            return found

        return shown

    return of


class Model:
    """Computes the tracking method."""

    def __init__(self, spec: TrackTachometer) -> None:
        self._spec = spec
        sampled = spec.encoder.sampled is not None
        begin = rows if sampled else compiled(tuple(constants_of(spec.form, spec.program.ahead))) or rows
        self._shown = begin(spec.form, spec.program.ahead)
        self._settled = None if not spec.settles else Settled()
        # The last clock of the ticks before, the position there, the tick of the last count, and the next tick.
        self._end, self._reached, self._latest, self._next = -1, 0, -spec.timing.max_ticks, 0

    def updates(self, ticks: Table, steps: Steps, n_clocks: int) -> Table:
        """Return the updates of the next ticks, with the velocity in counts per tick as the datapath has it."""
        spec = self._spec
        fine_bits = spec.position_fine_bits
        unused, shift = 64 - spec.position_width - fine_bits, spec.form.moved_shift - fine_bits
        n, most = len(ticks), spec.timing.max_ticks
        names = ["velocity", "interval", "forced", "acceleration", "velocity_std", "position_fine", "standstill"]
        names += SMOOTH if spec.smooth else ()
        names += ["offset"] * (spec.encoder.sampled is not None)
        flags = ("forced", "standstill")
        columns = {name: np.empty(n, dtype=bool if name in flags else np.int64) for name in names}
        for first in range(0, n, _PIECE):
            piece = slice(first, first + _PIECE)
            last = ticks.clock[piece] - spec.latency.tick
            if spec.encoder.sampled is None:
                windows = Windows.of(steps, last, spec.form.most_number, self._end, self._reached)
            else:
                assert isinstance(spec.form, SampledTracking)
                windows = Windows.of_reads(ticks.rows(piece), spec.form)
            self._end, self._reached = int(last[-1]), self._reached + int(windows.moved.sum())
            *offset, velocity, place, velocity_std, acceleration, standstill, smooth, delay = self._shown(windows).T
            counted = windows.number > 0
            if self._settled is not None:
                place = self._settled.places(velocity, counted, place)
            place = (place + (1 << shift - 1)) >> shift
            fine = (ticks.position[piece] << fine_bits) + place
            number = np.arange(self._next, self._next + len(last))
            before = np.maximum.accumulate(np.append(self._latest, np.where(counted, number, self._latest)))
            self._next, self._latest = self._next + len(last), int(before[-1])
            interval = np.minimum(number - before[:-1], most)
            if spec.encoder.sampled is not None:  # a read that waits has the mark of a silence
                interval, waits = ticks.elapsed[piece], counted & (standstill > 0)
                counted, standstill = counted & ~waits, standstill * ~(waits | ticks.forgets[piece])
            delay = np.minimum(delay >> spec.form.time_bits, (1 << SMOOTH_DELAY_BITS) - 1)
            fine = fine << unused >> unused
            values = [velocity, interval, ~counted, acceleration, velocity_std, fine, standstill]
            values += [*(smooth, delay) * spec.smooth, *offset]
            for name, value in zip(names, values, strict=False):
                columns[name][piece] = value
        return Table(ticks.clock + spec.latency.datapath, {"cause": ticks.clock, **columns})
