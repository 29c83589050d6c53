"""Upsets of the electrical angle: it is right again at the second index, which zeroes the counts of each turn.

What `angle_set` has set stands until it is set again, and is not upset.
"""

import numpy as np
from numpy.typing import NDArray
from proofs.upset.campaign import Campaign, motion, play
from proofs.upset.simulate import Upsettable

from tachometry.sim import golden
from tachometry.spec import of_texts

NEAR = 2  # 2^-16 turns, by what is left of a debt


def upsets(n: int, seed: int = 1, only: str = "") -> Campaign:
    """Run a campaign, as `campaign.upsets` does, of the angle at ticks alone."""
    texts = {"ppr": "10", "clock": "5MHz", "tick": "100clk", "max-time": "2000clk", "index": "yes"}
    spec = of_texts("s", texts | {"index-reset": "yes", "index-at": "A=0,B=0", "electrical": "3"})
    trace = motion(spec, 100, seed)
    core, right = Upsettable(spec, trace), golden.run(spec, trace)
    own = tuple(name for name in core.bits.names if "electrical" in name and not name.endswith(("sets", "difference")))
    index = np.append(right.index.clock, [trace.n_clocks] * 3)
    clock = np.arange(trace.n_clocks)
    allowed = index[np.searchsorted(index, clock) + 1] - clock + spec.timing.max_ticks * spec.timing.tick_cycles
    angle = [port.name for port in spec.ports.outputs].index("angle")

    def wrong(at: int, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        found = np.zeros(len(rows), dtype=bool)
        ticks = right.ticks.rows((right.ticks.clock >= at) & (right.ticks.clock < at + len(rows)))
        place = ticks.clock - at
        found[place] = (rows[place, angle] - ticks.angle + NEAR) % 2**16 > 2 * NEAR
        return found

    return play("angle", spec, core, trace, n, allowed, seed, wrong, only or own)
