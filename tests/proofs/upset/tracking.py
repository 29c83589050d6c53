"""Upsets of a tracking core at a constant speed: it forgets gradually, so its velocity is right again within a share.

The constants of its program stand in the memory of its words, and only a new configuration would restore them; they
are not upset.
"""

import numpy as np
from numpy.typing import NDArray
from proofs.upset.campaign import FAR, Campaign, compared_names, play, right_rows, spec_of
from proofs.upset.simulate import Bits, Upsettable

from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.spec import TrackTachometer
from tachometry.spec.formats.tracking import WIDTH

GAP = 1.5  # ticks from a count to the next: each is alone in its tick
SETTLED = 900  # counts, after which the noise and the edges of the disc are known
ALLOWED = 1300  # counts
TRACK = ("track", "track, serial")
SHARE = 1000  # of the velocity that it may be off by
_GRADUAL = ("velocity", "acceleration", "position_fine", "velocity_std")


def _trace(spec: TrackTachometer, n: int, gap: int) -> PinTrace:
    """Return `n` counts at a constant speed, with edges that are displaced by their kind, and as the map says."""
    place, far = np.arange(n + 1), 0.0 if spec.displacement is None else np.roll(np.resize(FAR, n), -1)
    clock = np.round((place[1:] + np.resize([0.1, -0.05, 0.02, -0.07], n) + far) * gap).astype(np.int64)
    level, z = quadrature(place), (place % len(FAR) == 2).astype(np.uint8) if spec.index else None
    return PinTrace(np.append(0, clock), level & np.uint8(1), level >> np.uint8(1), int(clock[-1]), z).completed(spec)


def upsets(name: str, n: int, seed: int = 1) -> Campaign:
    """Run a campaign, as `campaign.upsets` does; right is a velocity that is 1/1000 off at most. Of a core with a map
    only what belongs to that is upset, but for its table.
    """
    spec = spec_of(name)
    assert isinstance(spec, TrackTachometer)
    gap = round(GAP * spec.timing.tick_cycles)
    trace = _trace(spec, SETTLED + 300 + ALLOWED + 20, gap)
    core = Upsettable(spec, trace)
    words = next(words for words, bits in core.bits.memories if bits > 1000)
    varying = sum(word not in spec.program.constants for word in spec.program.words)
    core.bits = Bits(core.bits.flip_flops, [(words, WIDTH * varying)])
    names = compared_names(spec)
    columns = [[port.name for port in spec.ports.outputs].index(name) for name in names]
    tick, age, velocity = (names.index(name) for name in ("tick", "age", "velocity"))
    exact = [place for place, name in enumerate(names) if name not in _GRADUAL]
    right: dict[int, NDArray[np.int64]] = {}

    def wrong(clock: int, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        shown = rows[:, columns]
        shown[:, age] *= shown[:, tick]
        phase = int((clock + np.flatnonzero(shown[:, tick])[-1] - spec.latency.tick) % spec.timing.tick_cycles)
        if phase not in right:
            right[phase] = right_rows(spec, trace, phase)
        other = right[phase][clock : clock + len(shown)]
        far = np.abs(shown[:, velocity] - other[:, velocity]) * SHARE > np.abs(other[:, velocity])
        return far | (shown[:, exact] != other[:, exact]).any(axis=1)

    allowed = np.full(trace.n_clocks, ALLOWED * gap)
    own = tuple(each for each in core.bits.names if "disc__box" in each) if spec.displacement else ""
    return play(name, spec, core, trace, n, allowed, seed, wrong, own, first=SETTLED * gap)
