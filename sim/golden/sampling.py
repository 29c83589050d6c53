"""Golden sampling periods say where the windows end, by the core's own clock or by ticks from outside."""

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import TachometerSpec
from tachometry.spec.core.latency import TICK_IN_TO_WINDOW_END


def windows(spec: TachometerSpec, trace: PinTrace) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return last clocks of all windows, and clocks of all `tick_error`s, all within the trace."""
    n_clocks = trace.n_clocks - spec.latency.tick
    if not spec.external_tick:
        cycles = spec.timing.tick_cycles
        return np.arange(cycles - 1, n_clocks, cycles, dtype=np.int64), np.empty(0, dtype=np.int64)
    assert trace.tick_in is not None, "an external tick needs its line"
    # A line that is high at first has not risen.
    rises = trace.clock[np.flatnonzero(np.diff(trace.tick_in, prepend=1) == 1)] + TICK_IN_TO_WINDOW_END
    last, error = external_windows(rises, n_clocks, spec.times.min_tick_cycles, spec.tick.longest)
    return last, error + spec.latency.tick


def external_windows(
    rises: NDArray[np.int64], n_clocks: int, min_cycles: int, max_cycles: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return windows that end with a rise, none shorter than `min_cycles` and none longer than `max_cycles`.

    `rises` are clocks in which a rise is seen. It returns the last clocks of windows, and the clocks of rises that came
    too early or of ends without a rise.
    """
    rises = rises[rises < n_clocks]
    last: list[NDArray[np.int64]] = []
    errors: list[NDArray[np.int64]] = []
    before = -1  # the last clock of the window before

    def overdue(clock: int) -> None:
        """End windows that no rise ends before `clock`."""
        nonlocal before
        made = np.arange(before + max_cycles, clock, max_cycles)
        last.append(made)
        errors.append(made)
        before += max_cycles * len(made)

    # Only rises that are not as far from the one before as they may be have to be looked at one by one.
    gaps = np.diff(rises, prepend=before)
    irregular = np.append(np.flatnonzero((gaps < min_cycles) | (gaps > max_cycles)), len(rises))
    nth = 0
    while nth < len(rises):
        rise = int(rises[nth])
        overdue(rise)
        if rise - before < min_cycles:
            errors.append(rises[nth : nth + 1])
            nth += 1
        else:
            regular = int(irregular[np.searchsorted(irregular, nth, side="right")])
            last.append(rises[nth:regular])
            before = int(rises[regular - 1])
            nth = regular
    overdue(n_clocks)
    return np.concatenate(last, dtype=np.int64), np.concatenate(errors, dtype=np.int64)
