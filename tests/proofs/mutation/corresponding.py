"""Which flip-flops are always equal, or opposite, and which never change: C. A. J. van Eijk, "Sequential equivalence
checking based on structural similarities", IEEE Transactions on CAD 19(7), 2000.

All are taken to be so, and no longer when a clock tells them apart after which, or before which, all others are.
"""

import random
from collections.abc import Callable

from proofs.mutation.gates import GAMES, ONES, Gates, Levels, Place

_ZERO = ("", 0)  # stands for a flip-flop that is always 0
_QUIET = 4  # clocks that are played at random without telling any apart
Parts = list[list[Place]]


def corresponding(gates: Gates, anything: Levels, first: Levels, clock: Callable[[Levels], Levels]) -> Levels:
    """Return what is in flip-flops in any clock: of those that correspond, the literal of one of them or a constant.

    Parameters
    ----------
    gates : Gates
    anything : dict
        An input for each flip-flop.
    first : dict
        What is in them in the first clock.
    clock : callable
        Returns what is in them a clock later.
    """
    values = gates.played({}, max(first.values()))
    opposite = {place: (values[literal] & 1) * ONES for place, literal in first.items()} | {_ZERO: 0}
    phase = {place: ones & 1 for place, ones in opposite.items()}

    def apart(parts: Parts, level: Levels, values: list[int]) -> Parts:
        found: dict[tuple[int, int], list[Place]] = {}
        for number, part in enumerate(parts):
            for place in part:
                found.setdefault((number, values[level[place]] ^ opposite[place]), []).append(place)
        return list(found.values())

    def merged(parts: Parts) -> Levels:
        base = [0 if part[0] == _ZERO else anything[part[0]] ^ phase[part[0]] for part in parts]
        found = {place: one ^ phase[place] for part, one in zip(parts, base, strict=True) for place in part}
        return {place: found[place] for place in anything}

    def asked(parts: Parts, level: Levels) -> Parts:
        """Tell apart what the solver does not know to be the same."""
        level, last = level | {_ZERO: 0}, max(level.values())
        same: set[tuple[Place, Place]] = set()
        while left := [(part[0], place) for part in parts for place in part[1:] if (part[0], place) not in same]:
            for one, other in left:
                wrong = gates.differ(level[one] ^ phase[one], level[other] ^ phase[other])
                if gates.may_be(wrong, []):
                    parts = apart(parts, level, gates.played(gates.example(), last))
                    if any(part[0] == one and other in part for part in parts):  # the solver gave up
                        parts = [[place for place in part if place != other] for part in parts] + [[other]]
                    break
                same.add((one, other))
        return parts

    parts = asked(apart([[_ZERO, *anything]], first | {_ZERO: 0}, values), first)
    rng, after = random.Random(1), clock(anything) | {_ZERO: 0}
    while True:
        quiet = 0
        while quiet < _QUIET:
            given: dict[int, int] = {}
            for part in parts:
                base = 0 if part[0] == _ZERO else rng.getrandbits(GAMES)
                given |= {anything[place]: base ^ opposite[place] for place in part if place != _ZERO}
            more = apart(parts, after, gates.played(given, max(after.values())))
            quiet = quiet + 1 if len(more) == len(parts) else 0
            parts = more
        kept = merged(parts)
        more = asked(parts, clock(kept))
        if len(more) == len(parts):
            return kept
        parts = more
