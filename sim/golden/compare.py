"""The golden compare output finds the steps that lead to positions, one after the other."""

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.front_end import Steps, positions
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.compare import COUNT_WIDTH


def pulses(spec: TachometerSpec, steps: Steps) -> Table:
    """Return the first clocks of pulses, and their positions."""
    compare = spec.compare
    clocks: list[int] = []
    reached: list[int] = []
    if compare is not None:
        size = 1 << spec.position_width
        rows = np.flatnonzero(steps.step == (-1 if compare.backward else 1))
        at = positions(spec, steps)[rows]
        order = np.argsort(at, kind="stable")
        ordered = at[order]
        awaited, first = compare.start, 0
        while not compare.count or len(clocks) < compare.count:
            begin, end = np.searchsorted(ordered, [awaited, awaited + 1])
            place = begin + np.searchsorted(order[begin:end], first)
            if place == end:
                break
            first = int(order[place]) + 1
            clocks.append(int(steps.clock[rows[first - 1]]))
            reached.append(awaited)
            awaited = (awaited + compare.apart + size // 2) % size - size // 2
    clock = np.array(clocks, dtype=np.int64) + spec.latency.tick + 1
    return Table(clock, {"compare_position": np.array(reached, dtype=np.int64)})


def shown(spec: TachometerSpec, found: Table, clock: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
    """Return what is shown of pulses in these clocks."""
    assert spec.compare is not None
    number = np.searchsorted(found.clock, clock, side="right")
    begun = np.append(np.iinfo(np.int64).min // 2, found.clock)[number]
    return {
        "compare": clock - begun < spec.compare.clocks(spec.timing.clock_hz),
        "compare_count": number % (1 << COUNT_WIDTH),
    }


def with_compare(spec: TachometerSpec, ticks: Table, found: Table) -> Table:
    """Return ticks with what is shown of pulses."""
    return ticks if spec.compare is None else ticks.having(**shown(spec, found, ticks.clock))
