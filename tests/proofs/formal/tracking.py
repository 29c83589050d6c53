"""These proofs are about the counts of a tick of the tracking method."""

from dataclasses import replace
from functools import partial

from proofs.formal.prove import Proof

from tachometry.hdl.methods import tick_counts as box
from tachometry.spec import Encoder, Timing, TrackTachometer

_SPEC = TrackTachometer(encoder=Encoder(1, 4), timing=Timing(4000, 1000, 4))
_NAMES = ("number", "times", "places", "kind", "down", "last", "moved")


def _counts(name: str, longest_tick: int, max_count: int, max_ticks: int) -> Proof:
    """Return PK: the counts of a tick, alone, as a whole core has longer ticks than a solver can look at."""
    form = replace(_SPEC.form, tick_cycles=longest_tick, longest_tick=longest_tick, max_count=max_count, external=True)
    parameters = {
        "MOST": form.most_number,
        "LONGEST": longest_tick,
        "MAX_TICKS": max_ticks,
        "NUMBER_BITS": form.number_bits,
        "TIMES_BITS": form.times_bits,
        "PLACES_BITS": form.places_bits,
        "MOVED_BITS": form.moved_bits,
        "LAST_BITS": (longest_tick - 1).bit_length(),
        "ELAPSED_BITS": max_ticks.bit_length(),
        "LENGTH_BITS": longest_tick.bit_length(),
    }
    probes = {f"core_{name}": f"open_{name}" for name in (*_NAMES, "length")}
    probes |= {"core_fresh": "fresh", "core_position": "position"}
    # By the name in its module, where a mutant takes its place.
    made = partial(lambda *given: box.TickCounts(*given), form, max_ticks)
    return Proof(name, _SPEC, "tick_counts", parameters, probes, depth=2, box=made)


COUNTS_OF_A_TICK = [
    _counts("counts of a tick", 9, 3, 4),
    _counts("counts of a tick, one for an event", 5, 1, 3),
    _counts("counts of a tick, seven for an event", 9, 7, 5),
]
