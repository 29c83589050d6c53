"""From the lines of an encoder to steps, sampling periods, positions and what goes wrong, a clock at a time."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from reference.settings import Settings

# Levels of (A, B) in the order of forward motion: A leads B.
CYCLE = [(0, 0), (1, 0), (1, 1), (0, 1)]
Level = tuple[int, int, int, int]  # a, b, z, tick_in
Play = list[tuple[int, Level]]  # how many clocks each level is held, from the first clock after reset on


@dataclass
class Front:
    """Holds the steps that the front end makes of the lines, by clocks of the core.

    - `steps`: Counts by the clock in whose window they belong.
    - `errors`, `index`, `missed`, `rises`: Clocks of illegal transitions, of the index, of what tells that it was
      missed, of rises of the external tick.
    - `glitches`: Clocks in which a line went back before it was believed.
    - `changes`: Clocks in which lines change, and which: `a`, `b` or `ab`.
    """

    n_clocks: int
    steps: dict[int, int] = field(default_factory=dict)
    errors: list[int] = field(default_factory=list)
    index: list[int] = field(default_factory=list)
    missed: list[int] = field(default_factory=list)
    rises: list[int] = field(default_factory=list)
    glitches: list[int] = field(default_factory=list)
    changes: list[tuple[int, str]] = field(default_factory=list)


def believed(changes: list[tuple[int, int]], n_clocks: int, clocks: int) -> tuple[dict[int, int], list[int]]:
    """Return levels that hold for so many clocks, by the clock of their first sample; and clocks in which others went
    back.

    The line is unknown up to the first level that holds, whatever it does.
    """
    passed: dict[int, int] = {}
    gone: list[int] = []
    level = -1
    for nth, (at, new) in enumerate(changes):
        until = changes[nth + 1][0] if nth + 1 < len(changes) else n_clocks + clocks
        if new == level:
            continue
        if until - at >= clocks:
            level = passed[at] = new
        elif level >= 0:
            gone.append(until)
    return passed, gone


def count_of(decoding: int, old: tuple[int, int], new: tuple[int, int]) -> int:
    """Return ±1 or 0; a change of both lines or of none counts nothing."""
    turn = (CYCLE.index(new) - CYCLE.index(old)) % 4
    step = {1: 1, 3: -1}.get(turn, 0)
    of_a = new[0] != old[0]
    counted = {4: True, 2: of_a, 1: of_a and new[1] == 0}[decoding]
    return step if counted else 0


def conditioned(settings: Settings, play: Play, latency: int) -> Front:
    """Return steps and errors; a level that is sampled in clock c acts in clock c + latency."""
    n_clocks = sum(clocks for clocks, _ in play)
    front, lines = Front(n_clocks), []
    for which in range(4):
        changes: list[tuple[int, int]] = []
        at = 0
        for clocks, level in play:
            if not changes or changes[-1][1] != level[which]:
                changes.append((at, level[which]))
            at += clocks
        filtered = settings.filter if which < 3 else 0
        passed, gone = believed(changes, n_clocks, filtered)
        front.glitches += gone if which < (3 if settings.flag("index") else 2) else []
        lines.append(passed)
    both = max(min(lines[0]), min(lines[1]))  # clock from which A and B are known
    a, b = (line[max(at for at in line if at <= both)] for line in lines[:2])
    for at in sorted(at for at in {*lines[0], *lines[1]} if at > both):
        new = (lines[0].get(at, a), lines[1].get(at, b))
        front.changes.append((at + latency, "a" * (new[0] != a) + "b" * (new[1] != b)))
        if new[0] != a and new[1] != b:
            front.errors.append(at + latency)
        elif step := count_of(settings.decoding, (a, b), new):
            front.steps[at + latency] = step
        a, b = new
    # The first level of a line is no rise.
    front.index, front.rises = ([at for at in list(line)[1:] if line[at]] for line in lines[2:])
    front.index = [at + latency for at in front.index]
    if settings.words.get("index-at") != "edge":
        front.index, front.missed = in_state(lines[:3], front, latency)
    return front


def in_state(lines: list[dict[int, int]], front: Front, latency: int) -> tuple[list[int], list[int]]:
    """Return clocks in which Z is high in A=1,B=1 anew, and in which it is told that it came and went without that."""
    start = max(min(line) for line in lines)
    level = [line[max(at for at in line if at <= start)] for line in lines]
    taken, missed, before = [], [], list(level)
    directions = [1, *(front.steps[at] for at in sorted(front.steps) if at <= start + latency)]
    came: int | None = None  # the direction with which it came
    met = False
    for at in range(start + 1, front.n_clocks):
        level = [line.get(at, old) for line, old in zip(lines, before, strict=True)]
        if step := front.steps.get(at + latency, 0):
            if came is not None and not (level[2] or before[2]):
                if not met and came == directions[-1] == step:
                    missed.append(at + latency)
                came = None
            directions.append(step)
        if level[2] > before[2] and came is None:
            came, met = directions[-1], False
        met = met or all(level)
        if all(level) and not all(before):
            taken.append(at + latency)
        before = level
    return taken, missed


def external_ends(rises: Iterable[int], n_clocks: int, fewest: int, most: int) -> tuple[list[int], list[int]]:
    """Return last clocks of windows that rises end, none shorter than `fewest` or longer than `most`; and of what is
    wrong.
    """
    ends, wrong, before, waiting = [], [], -1, sorted(rises)
    for clock in range(n_clocks):
        rise = bool(waiting) and waiting[0] == clock
        if rise:
            waiting.pop(0)
        early = rise and clock - before < fewest
        late = not rise and clock - before == most
        if early or late:
            wrong.append(clock)
        if (rise and not early) or late:
            ends.append(clock)
            before = clock
    return ends, wrong


@dataclass(frozen=True)
class Tick:
    """A sampling period: its last clock, its counts as shown, whether they were too many, and the position after it."""

    last: int
    count: int
    overflow: bool
    position: int
    empty: bool  # no count came in it at all


def ticks_of(settings: Settings, front: Front, ends: list[int], most: int, held: bool = False) -> list[Tick]:
    """Return sampling periods that end with these clocks; `most` counts are shown.

    `held`: a sum that was once beyond stays there, as in periods that may be longer than nominal.
    """
    found, position, rises = [], 0, set(front.index)
    events = [clock for clock in sorted({*front.steps, *rises}, reverse=True)]
    for last in ends:
        total, came, left = 0, False, 0
        while events and events[-1] <= last:
            clock = events.pop()
            step = front.steps.get(clock, 0)
            total, position, came = total + step, position + step, came or step != 0
            left = left or (1 if total > most else -1 if total < -most else 0)
            if clock in rises and settings.flag("index-reset"):
                position = 0
        shown = left * most if held and left else max(-most, min(most, total))
        over = bool(left) if held else abs(total) > most
        found.append(Tick(last, shown, over, wrapped(position, settings.position_bits), not came))
    return found


def wrapped(number: int, bits: int) -> int:
    """Return a number in two's complement."""
    return (number + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)


def index_positions(settings: Settings, front: Front) -> list[tuple[int, int]]:
    """Clock and position of each rise of Z, before any reset of the position."""
    found, position, rises = [], 0, set(front.index)
    for clock in sorted({*front.steps, *rises}):
        position += front.steps.get(clock, 0)
        if clock in rises:
            found.append((clock, wrapped(position, settings.position_bits)))
            position = 0 if settings.flag("index-reset") else position
    return found


def faults(settings: Settings, front: Front, late: int) -> list[tuple[int, int, int]]:
    """Return clocks in which a fault is seen, its code, and the counts by which a turn was wrong; `late` is the latency
    of the index.
    """
    edges, errors = int(settings.words["health-edges"]), int(settings.words["health-errors"])
    found, alone, before, counted, second = [], 0, "", 0, 0
    for at, lines in front.changes:
        if at // settings.clock_hz != second:
            second, alone, counted = at // settings.clock_hz, 0, 0
        if lines == "ab":
            alone, counted = 0, counted + 1
            if counted == errors + 1:
                found.append((at, 4, 0))
            continue
        alone, before = (alone + 1 if lines == before and alone else 1), lines
        if alone == edges:
            found.append((at, 2 if lines == "a" else 1, 0))
            alone = 0
    if settings.flag("index"):
        found += _turns(settings, front, late) + [(at + late, 8, 0) for at in front.missed]
    return sorted(found)


def _turns(settings: Settings, front: Front, late: int) -> list[tuple[int, int, int]]:
    """Return indices in the direction of the one before that are neither a turn from it nor where it was."""
    found, last = [], None
    for at, position in index_positions(settings, front):
        direction = next((front.steps[clock] for clock in sorted(front.steps, reverse=True) if clock < at + late), 1)
        if last is not None and last[1] == direction:
            way = wrapped(position - (0 if settings.flag("index-reset") else last[0]), settings.position_bits)
            off = wrapped(way - direction * settings.counts_per_turn, settings.position_bits)
            if way and off:
                found.append((at + late + 1, 3, off))
        last = position, direction
    return found


def compared(settings: Settings, front: Front) -> list[tuple[int, int]]:
    """Return clocks of steps that lead to the awaited positions, and these."""
    start, step, count, _, *direction = settings.words["position-compare"].split(":")
    sign, both = -1 if direction == ["backward"] else 1, direction == ["both"]
    found: list[tuple[int, int]] = []
    number, position, rises = 0, 0, set(front.index)
    while both and number < int(count) and int(start) + number * int(step) <= 0:
        number += 1  # of those that lie behind
    resets = rises if settings.flag("index-reset") else set[int]()
    # Both ways, it goes on by a position a clock after a reset, until all below the new position lie behind.
    places = [int(start) + each * int(step) for each in range(int(count))]
    aiming = False
    for clock in sorted({*front.steps, *rises, *(reset + each for reset in resets for each in range(len(places) + 1))}):
        position = 0 if clock in resets else wrapped(position + front.steps.get(clock, 0), settings.position_bits)
        turn = front.steps.get(clock, 0)
        back = both and turn < 0  # over the edge that the position is forward
        move, aiming = 0, both and (aiming or clock in resets)
        if turn and (both or turn == sign) and not (int(count) > 0 and number == (0 if back else int(count))):
            awaited = wrapped(int(start) + sign * (number - back) * int(step), settings.position_bits)
            if wrapped(position + back, settings.position_bits) == awaited:
                found.append((clock, awaited))
                move = turn if both else 1
        if aiming:
            behind = sum(place <= position for place in places)
            move = (behind > number) - (behind < number)
            aiming = move != 0
        number += move
    return found
