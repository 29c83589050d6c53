"""The golden front end turns sampled levels into steps, pulse numbers and positions."""

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.index_state import in_state, passed_by
from tachometry.sim.golden.sampled import Reads
from tachometry.sim.golden.sorted_lookup import places
from tachometry.sim.golden.tooth_wheel import Teeth, filled
from tachometry.sim.signals.arrays import wrapped
from tachometry.sim.signals.recording import PinTrace, merged, packed
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, TachometerSpec
from tachometry.spec.core.reads import SYNCHRONISER
from tachometry.spec.core.sensors import changes as changes_of
from tachometry.spec.core.sensors import packed_levels

# Where a pair of levels stands in the forward cycle 00, 10, 11, 01 of (A, B).
_PHASE = np.array([[0, 3], [1, 2]], dtype=np.uint8)


def decode(a: NDArray[np.uint8], b: NDArray[np.uint8], decoding: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the step, −1, 0 or +1, of each change of levels, and whether both lines changed; shape (n − 1,).

    - `a`, `b`, shape (n,): Levels, each row different from the one before.
    """
    turn = np.diff(_PHASE.ravel()[2 * a + b]) & 3
    step = np.array([0, 1, 0, -1], dtype=np.int64)[turn]
    if decoding < 4:
        of_a = a[1:] != a[:-1]
        step[~(of_a if decoding == 2 else of_a & (b[1:] == 0))] = 0
    return step, turn == 2


def looked_up(
    encoder: Encoder, levels: Sequence[NDArray[np.uint8]], *, brief: bool
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the step, −1, 0 or +1, of each row of levels of any sensor, 0 for the first, and whether it is wrong.

    - `levels`, shape (n,): Of each line of the sensor, each row different from the one before.
    - `brief`: The first row lasts for a clock only, in which the decoder does not yet look.
    """
    bits = len(levels)
    table = np.zeros((1 << bits, 1 << bits, 2), dtype=np.int64)
    for (before, after), counted in changes_of(encoder.sensor, encoder.decoding).items():
        table[packed_levels(before), packed_levels(after)] = counted
    legal = np.isin(np.arange(1 << bits), [packed_levels(each) for each in encoder.kind.legal])
    now = packed(levels)
    rows = np.arange(len(now))
    illegal = ~legal[now] & ~((rows == 0) & brief)
    latest = np.maximum.accumulate(np.where(legal[now], rows, 0))  # the row whose levels are remembered
    step, wrong = table[now[np.append(0, latest[:-1])], now].T
    return step, (wrong == 1) | (illegal & ~np.append(False, illegal[:-1]))


def counted(
    encoder: Encoder, lines: Mapping[str, NDArray[np.uint8]], *, brief: bool = False
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Step of each row of a list of levels as they are on the pins, and whether it is wrong, see `looked_up`."""
    levels = [lines[name] ^ np.uint8(name in encoder.inverted) for name in encoder.kind.lines]
    if encoder.sensor == "quadrature":
        step, wrong = decode(levels[0], levels[1], encoder.decoding)
        step, wrong = np.append(0, step), np.append(False, wrong)
    else:
        step, wrong = looked_up(encoder, levels, brief=brief)
    return step * (-1 if encoder.reverse else 1), wrong


def filter_line(
    clock: NDArray[np.int64], level: NDArray[np.uint8], clocks: int
) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.int64]]:
    """Return the changes of a line that pass the glitch filter, and the clocks at which other levels went back.

    A level passes if it holds for `clocks`, and is dated when it was first sampled.
    """
    lasts = np.append(clock[1:] - clock[:-1] >= clocks, True)
    first = int(np.argmax(lasts))
    clock, level, lasts = clock[first:], level[first:], lasts[first:]
    latest = np.maximum.accumulate(np.where(lasts, np.arange(len(clock)), 0))
    believed = level[latest]  # after each change, once it has held or gone
    glitch = np.flatnonzero(~lasts & (level != believed))
    changed = np.append(True, believed[1:] != believed[:-1])
    return clock[changed], level[changed], clock[glitch + 1]


def blanked_line(
    clock: NDArray[np.int64], level: NDArray[np.uint8], clocks: int, starts: int | None
) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return the change list of a line that is held for `clocks` after each change that is shown.

    - `clock`, `level`, shape (n,): Change list of one line.
    - `starts`: Level whose changes are held; None for both.
    """
    if np.all(np.diff(clock) >= clocks):
        return clock, level
    at, levels = clock.tolist(), level.tolist()
    shown, row, free = levels[0], 0, 0  # the row whose level the line has in clock `free`, from which it is seen
    held = [(at[0], shown)]
    while (row := row + (levels[row] == shown)) < len(at):
        now, shown = max(at[row], free), levels[row]
        held.append((now, shown))
        free = now + clocks * (starts in (None, shown))
        row = bisect_right(at, free) - 1
    shown_at, shown_level = zip(*held, strict=True)
    return np.array(shown_at, dtype=np.int64), np.array(shown_level, dtype=np.uint8)


def changes(trace: PinTrace, name: str) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Change list of one line: the clocks from which its levels are sampled, and the levels."""
    line, _, bit = name.rpartition("_")
    level = trace.lines[name] if name in trace.lines else trace.lines[line] >> np.uint8(bit) & np.uint8(1)
    changed = np.append(True, level[1:] != level[:-1])
    return trace.clock[changed], level[changed]


def _none() -> NDArray[np.int64]:
    return np.empty(0, dtype=np.int64)


MOST_FILTERED = (1 << 16) - 2  # edges: a glitch has two

# clocks of `Steps`, and what it has for each
_EVENTS = {"clock": ("step", "displaced", "mapped"), "presets": ("values",)} | dict.fromkeys(
    ("errors", "index", "swallowed", "wide", "missed", "z", "arms"), ()
)


@dataclass(frozen=True)
class Steps:
    """Holds the steps that the decoder sees, on the core's clock."""

    clock: NDArray[np.int64]  # shape (n,): clocks, increasing, with a step or where a line changes without one
    step: NDArray[np.int64]  # shape (n,): −1, 0 or +1
    errors: NDArray[np.int64]  # clocks in which `decode_error` is high
    # clocks in which the index is taken, or of the first teeth after a gap; none without an index
    index: NDArray[np.int64]
    swallowed: NDArray[np.int64]  # clocks in which the glitch filter has counted a glitch
    # shape (n,): the lines that change in `clock`: 1 of A, 2 of B, 3 both
    changed: NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, dtype=np.uint8))
    # wide and missed: clocks in which Z meets its state a second time, and has come and gone without it
    wide: NDArray[np.int64] = field(default_factory=_none)
    missed: NDArray[np.int64] = field(default_factory=_none)
    z: NDArray[np.int64] = field(default_factory=_none)  # clocks in which Z rises, or would be taken in its state
    # presets and values: clocks in which the position is set, before the step in them, and to what
    presets: NDArray[np.int64] = field(default_factory=_none)
    values: NDArray[np.int64] = field(default_factory=_none)
    arms: NDArray[np.int64] = field(default_factory=_none)  # clocks in which the next index is let through
    turned: int = 0  # counts since the zero of `position_modulo`, before the first step
    homed: bool = False  # before the first of `arms`
    wheel: Teeth | None = None  # of a wheel with missing teeth, the teeth
    reads: Reads | None = None  # of an encoder that is read
    # clocks from which levels of the lines of the sensor are seen, and these; only the last of a clock lasts
    levels: tuple[NDArray[np.int64], ...] = ()
    # shape (n,): displacement of the edge of each step that an extra gives; empty if none does
    displaced: NDArray[np.int64] = field(default_factory=_none)
    mapped: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, np.bool_))  # shape (n,): whether it gives one
    fine_bits: int = 0  # of these below half a count
    # displacements of the edges above and below the place before the steps of some clocks
    around: Callable[[NDArray[np.int64]], tuple[NDArray[np.int64], NDArray[np.int64]]] | None = None
    # of each line of an extra the clocks from which its level is seen, and the levels; the first is no edge
    pins: Mapping[str, tuple[NDArray[np.int64], NDArray[np.uint8]]] = field(default_factory=dict)

    def then(self, more: "Steps") -> "Steps":
        """Return the steps of both, as `part` has them."""
        names = [name for at, others in _EVENTS.items() for name in (at, *others)]
        columns: dict[str, Any] = {name: np.append(getattr(self, name), getattr(more, name)) for name in names}
        return replace(self, **columns)

    def part(self, begin: int, end: int = 1 << 62, later: int = 0) -> "Steps":
        """Return what happens from a clock on and before another, put `later`; what only extras need is left out."""
        columns: dict[str, Any] = {}
        for at, others in _EVENTS.items():
            rows = slice(*np.searchsorted(getattr(self, at), (begin, end)))
            columns |= {name: getattr(self, name)[rows] for name in others} | {at: getattr(self, at)[rows] + later}
        return Steps(**columns, fine_bits=self.fine_bits)

    def asked(
        self, spec: TachometerSpec, presets: NDArray[np.int64], values: NDArray[np.int64], arms: NDArray[np.int64]
    ) -> "Steps":
        """Return the same steps with presets, and with the indices that are taken."""
        index = self.z
        if spec.front_end.index_once:
            after = np.unique(np.searchsorted(index, arms, side="right"))
            index = index[after[after < len(index)]]
        return replace(self, index=index, presets=presets, values=values, arms=arms)


def together(
    lines: Sequence[tuple[NDArray[np.int64], NDArray[np.uint8]]],
) -> tuple[NDArray[np.int64], list[NDArray[np.uint8]]]:
    """Change lists of lines as one, from the first clock on from which all are known."""
    clock = merged(*(at for at, _ in lines))
    clock = clock[clock >= max(at[0] for at, _ in lines)]
    return clock, [level[np.searchsorted(at, clock, side="right") - 1] for at, level in lines]


def _indices(
    spec: TachometerSpec,
    clock: NDArray[np.int64],
    levels: Sequence[NDArray[np.uint8]],
    step: NDArray[np.int64],
    line_z: tuple[NDArray[np.int64], NDArray[np.uint8]],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return clocks of indices, of those wider than a period, and of those that pass without the state of the index."""
    at_z, z = line_z
    delay = spec.latency.pin_to_count
    wide = missed = clock[:0]
    z = z ^ np.uint8("z" in spec.encoder.inverted)
    if spec.front_end.index_state is not None:
        at_z, levels_z = together([*((clock, level) for level in levels), (at_z, z)])
        z, again = in_state(spec, levels_z)
        wide = at_z[again] + delay
        at = clock + delay + (np.arange(len(clock)) == 0)
        missed = passed_by(at[step != 0], step[step != 0], at_z + delay, levels_z[-1], z)
    return at_z[1:][z[1:] > z[:-1]] + delay, wide, missed


def decoded(spec: TachometerSpec, trace: PinTrace) -> Steps:
    """Return conditioned and decoded lines; of an encoder that is read, the clocks of wrong reads."""
    returned, none, encoder = [_none()], _none(), spec.encoder
    if encoder.sampled is not None:
        reads = Reads.of(spec, trace)
        found = Steps(none, none, reads.errors, none, none, reads=reads)
        return _asked(spec, found, {name: changes(trace, name) for name in spec.front_end.controls}, SYNCHRONISER)

    def conditioned(name: str) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        clock, level = changes(trace, name)
        if spec.filter_clocks:
            clock, level, gone = filter_line(clock, level, spec.filter_clocks)
            returned.append(gone)
        if name in spec.front_end.blanked:
            clock, level = blanked_line(clock, level, spec.blanking_clocks, spec.front_end.blanked[name])
        return clock, level

    clock, levels = together([conditioned(name) for name in encoder.kind.lines])
    lines = dict(zip(encoder.kind.lines, levels, strict=True))
    step, wrong = counted(encoder, lines, brief=bool(np.any(np.diff(clock[:2]) == 1)))
    # The level before the first is not real.
    at = clock + spec.latency.pin_to_count + (np.arange(len(clock)) == 0)
    changed = packed([line[1:] ^ line[:-1] for line in levels])
    seen = {name: conditioned(name) for name in spec.front_end.sensed}
    pins = {name: (clock_of + spec.latency.pin_to_count, level) for name, (clock_of, level) in seen.items()}
    if spec.front_end.wheel is not None:
        swallowed = np.sort(np.concatenate(returned)) + 3
        return _without_gaps(spec, Steps(at[1:], step[1:], at[:0], at[:0], swallowed, pins=pins), trace)
    rises, wide, missed = at[:0], at[:0], at[:0]
    if spec.index:
        rises, wide, missed = _indices(spec, clock, levels, step, conditioned("z"))
    asked = {name: conditioned(name) for name in spec.front_end.controls}
    swallowed = np.sort(np.concatenate(returned)) + 3
    read = (at, packed([level ^ np.uint8(name in encoder.inverted) for name, level in lines.items()]).astype(np.int64))
    found = Steps(at[1:], step[1:], at[wrong], rises, swallowed, changed, wide, missed, rises, pins=pins, levels=read)
    return _asked(spec, found, asked, spec.latency.pin_to_count)


def _asked(
    spec: TachometerSpec, steps: Steps, pins: Mapping[str, tuple[NDArray[np.int64], NDArray[np.uint8]]], delay: int
) -> Steps:
    """Return the same steps with the presets and the homing of pins, whose steps come `delay` clocks later."""
    asked = {"preset": _none(), "home": _none()}
    for name, (at, level) in pins.items():
        asked[name] = at[1:][level[1:] > level[:-1]] + delay
    return steps.asked(spec, asked["preset"], np.full(len(asked["preset"]), spec.preset or 0), asked["home"])


def _without_gaps(spec: TachometerSpec, steps: Steps, trace: PinTrace) -> Steps:
    """Return the steps of a wheel with its missing teeth."""
    assert spec.front_end.wheel is not None
    teeth = filled(spec.front_end.wheel, steps.clock[steps.step != 0], trace.n_clocks)
    index = teeth.index if spec.index else steps.index
    step = np.full(len(teeth.clock), -1 if spec.encoder.reverse else 1)
    return replace(steps, clock=teeth.clock, step=step, errors=teeth.errors, index=index, wheel=teeth)


def first_beyond(steps: Steps, last: NDArray[np.int64], limit: int) -> NDArray[np.int64]:
    """Return direction in which the sum of steps first left ±`limit` in each window; 0 where it did not."""
    found = np.zeros(len(last) + 1, dtype=np.int64)
    window = places(last, steps.clock, "left")
    total = np.cumsum(steps.step)
    before = np.append(0, total)[np.searchsorted(steps.clock, last, side="right")]
    partial = total - np.append(0, before)[window]
    beyond = np.flatnonzero(np.abs(partial) > limit)[::-1]
    found[window[beyond]] = np.sign(partial[beyond])  # the first is written last
    return found[:-1]


@dataclass(frozen=True)
class _Origins:
    """Says what is taken off the sum of all steps: at each index, and from what clock on."""

    # captured and at_index: the sum at each index, and what is taken off it there
    captured: NDArray[np.int64]
    at_index: NDArray[np.int64]
    clock: NDArray[np.int64]  # shape (n,)
    off: NDArray[np.int64]  # shape (n + 1,): what is taken off before any of these clocks, and after each

    @classmethod
    def of(cls, spec: TachometerSpec, steps: Steps) -> "_Origins":
        """Find them; of a preset and an index in one clock the preset is first."""
        sums = np.append(0, np.cumsum(steps.step))
        captured = sums[np.searchsorted(steps.clock, steps.index, side="right")]
        preset = sums[np.searchsorted(steps.clock, steps.presets, side="left")] - steps.values
        resets = len(steps.index) * spec.front_end.index_resets
        clock = np.concatenate([steps.presets, steps.index[:resets]])
        order = np.argsort(clock, kind="stable")
        clock = clock[order]
        off = np.append(0, np.concatenate([preset, captured[:resets]])[order])
        found = cls(captured, captured, clock, off)
        return replace(found, at_index=found.before_reset(steps.index, steps))

    def before_reset(self, clock: NDArray[np.int64], steps: Steps) -> NDArray[np.int64]:
        """Return the offset to subtract in each of these clocks, with a preset of the clock, but not its index."""
        found: NDArray[np.int64] = self.off[np.searchsorted(self.clock, clock) + np.isin(clock, steps.presets)]
        return found

    def after(self, clock: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the offset to subtract from the sum of the steps up to each of these clocks."""
        found: NDArray[np.int64] = self.off[np.searchsorted(self.clock, clock, side="right")]
        return found


def positions_at(
    spec: TachometerSpec, steps: Steps, clock: NDArray[np.int64], *, reset: bool = False
) -> NDArray[np.int64]:
    """Return the position with all steps of each clock and before, before an index of the clock resets it or after."""
    total = np.append(0, np.cumsum(steps.step))[np.searchsorted(steps.clock, clock, side="right")]
    origins = _Origins.of(spec, steps)
    position = total - (origins.after(clock) if reset else origins.before_reset(clock, steps))
    return wrapped(position, spec.position_width)


def homed(spec: TachometerSpec, steps: Steps, clock: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return the clocks in which `homed` is high: the index was taken since it was let through."""
    known = np.searchsorted(steps.index + spec.latency.tick, clock, side="right")
    armed = np.searchsorted(steps.arms + spec.latency.tick, clock, side="right")
    return np.append(steps.homed - 1, steps.index)[known] > np.append(-1, steps.arms)[armed]


def count(
    spec: TachometerSpec, steps: Steps, last: NDArray[np.int64], beyond: NDArray[np.bool_] | None = None
) -> tuple[Table, Table]:
    """Return pulse numbers and positions of all ticks, and positions at the index.

    - `last`: Last clock of each window.
    - `beyond`: Windows that may be longer than nominal: whether the method raises `overflow`. A sum that has left
      ±max_pulse_count is saturated, whatever comes after.
    """
    window = places(last, steps.clock, "left")
    sums = np.subtract(*(np.bincount(window[steps.step == sign], minlength=len(last) + 1)[:-1] for sign in (1, -1)))
    reached = np.cumsum(sums)
    overflow = np.abs(sums) > spec.widths.max_pulse_count
    if beyond is not None:
        left = first_beyond(steps, last, spec.widths.max_pulse_count)
        sums = np.where(left != 0, left * spec.widths.max_pulse_count, sums)
        overflow = (left != 0) | beyond
    origins = _Origins.of(spec, steps)
    strobe = last + spec.latency.tick
    columns = {
        "pulse_count": np.clip(sums, -spec.widths.max_pulse_count, spec.widths.max_pulse_count),
        "position": wrapped(reached - origins.after(last), spec.position_width),
        "overflow": overflow,
    }
    if spec.front_end.index_once:
        columns["homed"] = homed(spec, steps, strobe)
    if spec.modulus is not None:
        zeros = np.append(0, (origins.captured + steps.turned) * spec.front_end.index_resets) - steps.turned
        counts, parts = spec.modulus.as_integer_ratio()
        columns["turned"] = reached - zeros[places(steps.index, last, "right")]
        columns["position_modulo"] = columns["turned"] % counts * parts % counts // parts
    if spec.filter_clocks:
        columns["filtered_edges"] = np.minimum(2 * places(steps.swallowed, strobe, "right"), MOST_FILTERED)
    if steps.wheel is not None:
        columns["synced"] = steps.wheel.synced(strobe - 1)
    index = {"index_position": wrapped(origins.captured - origins.at_index, spec.position_width)}
    return Table(strobe, columns), Table(steps.index + spec.latency.tick, index)
