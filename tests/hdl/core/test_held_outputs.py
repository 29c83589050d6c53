"""Outputs that belong to a strobe stay as they are until it comes again, but for those whose help says more."""

import numpy as np
import pytest
from support.simulate import Seen, clock_by_clock

from tachometry.hdl import Tachometer
from tachometry.sim.signals.recording import quadrature
from tachometry.spec import METHODS, TachometerSpec, of_texts

GOES_ON = {"position", "age", "swallowed_edges"}


def shown(spec: TachometerSpec) -> Seen:
    """Return all outputs, clock by clock, of three ticks fast, of three slow, and of rest, with glitches."""
    tick, rng = spec.timing.tick_cycles, np.random.default_rng(1)
    chance = np.repeat([10 / tick, 0.7 / tick, 0], [3 * tick, 3 * tick, spec.times.longest + 2 * tick])
    level = quadrature(np.cumsum(rng.random(len(chance)) < chance))
    a, b, z = level & 1 ^ (rng.random(len(level)) < 3 / tick), level >> 1, level == 0
    rows = [{"a": int(x), "b": int(y), "z": int(w)} for x, y, w in zip(a, b, z, strict=True)]
    return clock_by_clock(Tachometer(spec), rows, [port.name for port in spec.ports.outputs])


@pytest.mark.parametrize("method", METHODS)
def test_outputs_are_held_until_their_strobe(method: str) -> None:
    texts = {"ppr": "3", "clock": "1MHz", "age": "yes", "filter": "2", "index": "yes"}
    tick = 800 if method == "track" else 80
    spec = of_texts(method, texts | {"tick": f"{tick}us", "max-time": f"{4 * tick}us"})
    seen = shown(spec)
    moved = set()
    for strobe, names in spec.ports.strobes.items():
        first = next((clock for clock, row in enumerate(seen) if row[strobe]), len(seen))
        between = [pair for pair in zip(seen[first:], seen[first + 1 :], strict=False) if not pair[1][strobe]]
        moved |= {name for name in names if any(row[name] != before[name] for before, row in between)}
    assert moved == GOES_ON
    assert {port.name for port in spec.ports if "etween the ticks" in port.help} == GOES_ON
