"""A core is simulated on encoder signals: what the hardware says, the golden model, and the shaft itself."""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.engines.engine import Interrupted, Watch
from tachometry.sim.engines.pick import pick
from tachometry.sim.engines.waveform import Curve, add_curves
from tachometry.sim.golden.pieces import Golden, in_pieces
from tachometry.sim.signals.arrays import Ints, wrapped
from tachometry.sim.signals.axes import AxesTrace, Trace, of_axis
from tachometry.sim.signals.flow import Flow
from tachometry.sim.signals.progress import Bar, no_bar
from tachometry.sim.signals.recording import PinTrace, Recording
from tachometry.sim.signals.run import Comparison, Run
from tachometry.sim.signals.tables import HeldVelocity, Tally, VelocityError, held_from, held_velocity, velocity_error
from tachometry.sim.signals.temporary import held_back
from tachometry.sim.studies.lockstep import Lockstep, lockstep
from tachometry.spec import AxesSpec, CoreSpec, TachometerSpec
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.units import format_time
from tachometry.spec.methods.axis import WARM_UP

Window = Callable[[CoreSpec, int], tuple[int, int]]
Pulses = Callable[[TachometerSpec], dict[str, Ints]]
PIECE = 1 << 17  # ticks of a run that are held at once


@dataclass(frozen=True)
class Running:
    """Describes how a simulation is run."""

    engine: str
    window: Window = lambda _, n_clocks: (0, n_clocks)  # gives the clocks that the waveform `vcd` shows
    pulses: Pulses = lambda _: {}  # gives clocks in which other inputs than those of the encoder rise, by their names
    vcd: Path | None = None
    bar: Bar = no_bar
    whole: bool = True  # whether all rows are needed at once; else a core that can be is run in pieces
    # takes the rows of each piece of the run, which may be the whole, with the numbers up to it
    sink: Callable[[Run, Tally], object] = lambda *_: None


@dataclass(frozen=True)
class Axis:
    """Holds what an axis has made of its encoder."""

    spec: TachometerSpec  # of a core of this axis alone
    run: Run  # its rows; of a run in pieces, the last ones
    tally: Tally  # numbers of all of them
    recording: Recording | Flow
    truth: Encoding | None  # what the shaft truly did, if it is known; with it `counts_in` and `error`
    n_merged: int  # edges that came too soon after another to be told apart
    # counts_in and counts_out: of the shaft, up to the last tick, and of the core
    counts_in: int | None
    counts_out: int
    held: HeldVelocity
    error: VelocityError | None  # of it; None also if there was no update

    @property
    def difference(self) -> int:
        """Counts out less counts in; the position may have wrapped."""
        return 0 if self.counts_in is None else wrapped(self.counts_out - self.counts_in, self.spec.position_width)

    @property
    def index_distances(self) -> Ints:
        """Counts from each index to the next; the position may have wrapped, or each index resets it."""
        position = np.concatenate(self.tally.places)
        if self.spec.front_end.index_once or self.spec.preset is not None:
            return position[:0]  # they tell of no turn
        distance = position[1:] if self.spec.front_end.index_resets else np.diff(position)
        return wrapped(distance, self.spec.position_width)

    @property
    def index_lasts(self) -> NDArray[np.float64] | None:
        """Seconds in which Z is high, in each state of A and B, A lowest; None without Z of quadrature."""
        wires, lasts = [*self.recording.wires], self.recording.lasting
        if "z" not in wires or self.spec.encoder.sensor != "quadrature":
            return None
        bits = (np.arange(len(lasts)) >> wires.index(name) & 1 ^ (name in self.spec.encoder.inverted) for name in "abz")
        a, b, z = bits
        return np.bincount(a + 2 * b, lasts * z).astype(np.float64)


@dataclass(frozen=True)
class Simulation:
    """Holds a simulation, compared in every bit."""

    spec: CoreSpec
    engine: str  # what has run the hardware
    wanted: int | None  # clocks that it was to run, if it is known; after Ctrl-C it has run fewer
    lockstep: Lockstep  # of a run in pieces, the last rows, and pins of the first ones
    tally: Tally  # numbers of all rows of the core
    axes: tuple[Axis, ...]

    @property
    def interrupted(self) -> bool:
        """Whether it ended early."""
        return self.wanted is None or self.lockstep.actual.n_clocks < self.wanted


def _check_pulses(spec: CoreSpec, source: str, pulses: dict[str, Ints], n_clocks: int | None) -> None:
    """Check that pulses of other inputs are within so many clocks, if they are known; ParameterError if not."""
    for rises in pulses.values():
        if n_clocks is not None and not 0 < rises[0] <= rises[-1] < n_clocks:  # in clock 0 it would be high, not rise
            end = format_time(spec.tick.seconds(n_clocks))
            raise ParameterError("pulse", f"must have times after 0 and before the end of {source}, at {end}")


def _fewest(spec: CoreSpec) -> int:
    """Return the clocks after which there is something to report."""
    return spec.tick.longest + spec.latency.tick


def _held(recording: Recording | Flow, *, whole: bool) -> Recording | Flow:
    """Return a recording as a whole, or in parts."""
    if isinstance(recording, Flow):
        return recording.whole() if whole else recording
    return recording if whole else Flow.of(recording)


def _placed(spec: CoreSpec, source: str, held: Sequence[Recording | Flow], pulses: Pulses) -> Iterator[Trace]:
    """Yield what the pins of a core see, as a whole or in pieces; ValueError if it has too many ticks."""
    if spec.axes is not None:
        yield AxesTrace.placed([one for one in held if isinstance(one, Recording)], spec)
        return
    (one,), given, begin = held, pulses(spec), 0
    _check_pulses(spec, source, given, _lasts(spec, source, held))
    size = PIECE * spec.timing.tick_cycles
    for piece in one.pieces(spec, size) if isinstance(one, Flow) else [PinTrace.of(one, spec)]:
        pins = piece
        for name, rises in given.items():
            pins = pins.with_pulses(name, rises - begin, spec.filter_clocks + 1)
        yield pins
        begin += pins.n_clocks
    _check_pulses(spec, source, given, _lasts(spec, source, held))


def _lasts(spec: CoreSpec, source: str, held: Sequence[Recording | Flow]) -> int | None:
    """Return how many clocks are to be run, if it is known; ValueError if there is nothing to report then."""
    durations = [one.duration for one in held if one.duration is not None]
    if not durations:
        return None
    n_clocks = max(int(max(durations) * spec.timing.clock_hz), 1)
    if n_clocks < (fewest := _fewest(spec)):
        raise ValueError(
            f"{source} must last at least {fewest} clocks of --clock ({format_time(spec.tick.seconds(fewest))}), "
            f"a tick and its latency, not {n_clocks}"
        )
    return n_clocks


@contextmanager
def _bar(bar: Bar, held: Recording | Flow, n_clocks: int | None) -> Iterator[Callable[[float], None]]:
    """Show how many clocks have been run, or how much of a file, if they are not known."""
    if isinstance(held, Flow) and n_clocks is None and held.size:
        with bar("simulating", held.size, "bytes", rate=True) as progress:
            yield lambda _: progress(held.read)
    else:
        with bar("simulating", n_clocks or 0, "clocks", rate=True) as progress:
            yield progress


def simulate(
    spec: CoreSpec,
    source: str,
    recordings: Sequence[Recording | Flow],
    truths: Sequence[Encoding] | None,
    running: Running,
) -> Simulation:
    """Run hardware and golden model on a recording for each axis, which may come in parts.

    `source` is what messages call that which they come from, and `truths` what the shaft of each axis truly did. It
    raises ValueError if they do not last a tick, or have too many.
    """
    chosen = pick(running.engine)
    engine: Any = getattr(chosen, "in_pieces", None)
    whole = running.whole or engine is None or len(recordings) > 1 or not in_pieces(spec.tachometer)
    held = [_held(recording, whole=whole) for recording in recordings]
    tally, speed = Tally(spec.tachometer), truths[0].true_speed if truths else None
    trace = next(pins := _placed(spec, source, held, running.pulses))
    n_clocks = _lasts(spec, source, held)
    shown, vcd = running.window(spec, trace.n_clocks), running.vcd

    def take(run: Run) -> None:
        tally.count(run)
        if isinstance(trace, PinTrace):
            tally.hold(run, speed)
        running.sink(run, tally)

    with _bar(running.bar, held[0], n_clocks) as progress:
        watch = Watch(vcd, shown, progress)
        if whole:
            take((found := lockstep(spec, trace, chosen, watch=watch, fewest=_fewest(spec))).actual)
        else:
            engine = partial(engine, n_clocks=n_clocks or 1 << 62, watch=watch)
            found = _in_pieces(spec.tachometer, chain([trace], pins), engine, take)
    missing = " (there is no C++ compiler)" if (running.engine, chosen.name) == ("auto", "pysim") else ""
    known: Sequence[Encoding | None] = truths or [None] * len(held)
    axes = tuple(_axis(spec, found.actual, tally, n, *of) for n, of in enumerate(zip(held, known, strict=True)))
    if vcd is not None:
        add_curves(vcd, spec.timing.clock_hz, (shown[0], min(shown[1], found.actual.n_clocks)), _curves(axes))
    return Simulation(spec, chosen.name + missing, _lasts(spec, source, held), found, tally, axes)


def _in_pieces(
    spec: TachometerSpec, pieces: Iterator[Any], engine: Callable[..., Iterator[Run]], take: Callable[[Run], object]
) -> Lockstep:
    """Run a trace in pieces as `lockstep` does the whole; `take` is given the rows of each.

    `engine` is `CompiledEngine.in_pieces` of so many clocks.
    """
    model, comparison, last = Golden(spec), Comparison(), Run(0, {})
    first = next(pieces)

    def expected() -> Iterator[PinTrace]:
        for pins in chain([first], pieces):
            with held_back():
                comparison.expect(model.run(pins))
            yield pins

    def add(run: Run) -> Run:
        with held_back():
            comparison.add(run)
            take(run)
        return run if len(run.ticks) else Run(run.n_clocks, last.tables)

    try:
        for run in engine(spec, expected()):
            last = add(run)
    except KeyboardInterrupt as early:
        last = add(early.run) if isinstance(early, Interrupted) else last
        if last.n_clocks < _fewest(spec):
            raise
    comparison.end(last.n_clocks)
    return Lockstep(first, last, last, comparison.n_mismatches, comparison.first)


def _curves(axes: Sequence[Axis]) -> dict[str, Curve]:
    """Return measured and true speeds for a waveform, as numbers with the unit in their names."""
    found = {}
    for number, axis in enumerate(axes):
        unit = axis.spec.scale.shown_unit
        end = f"_{unit.suffix}" + (f"_{number}" if len(axes) > 1 else "")
        found[f"measured{end}"] = axis.held.time, unit.of(axis.held.velocity_rad_s)
        if axis.truth is not None:
            found[f"true{end}"] = axis.held.time, unit.of(axis.truth.true_speed(axis.held.time))
    return found


def _axis(
    core: CoreSpec, run: Run, tally: Tally, number: int, recording: Recording | Flow, truth: Encoding | None
) -> Axis:
    """Return the results of an axis; `tally` is that of the core, and `run` has the last rows of a run in pieces."""
    if core.axes is not None:
        return _axis_of_many(core, run, number, recording, truth)
    spec = core
    counts_in, held = None, held_velocity(spec, run)
    if truth is not None:
        # Up to the pin sample that the last tick can hold.
        clock = int(run.ticks.clock[-1]) - spec.latency.tick - spec.latency.pin_to_count
        sampled = _sampled(max(clock, 0), spec.timing.clock_hz)
        counts_in = int(truth.true_position(sampled, spec.encoder.decoding))
    # What sets the position does not undo what has been counted.
    reads, ticks = spec.encoder.sampled is not None, run.ticks
    moves = spec.front_end.moves_position and (not reads or spec.preset is not None)
    first = ticks.position[ticks.position_valid.argmax()] if reads else 0
    counts_out = int(first + tally.n_counts if moves else ticks.position[-1])
    n_merged = recording.n_merged(spec.timing.clock_hz, run.n_clocks)
    error = None if truth is None else tally.error
    return Axis(spec, run, tally, recording, truth, n_merged, counts_in, counts_out, held, error)


def _sampled(clock: int, clock_hz: int) -> float:
    """Return the last instant that `Recording.place` puts at or before clock edge `clock`, in seconds."""
    instant = clock / clock_hz
    while instant * clock_hz > clock:
        instant = math.nextafter(instant, 0)
    while (later := math.nextafter(instant, math.inf)) * clock_hz <= clock:
        instant = later
    return instant


def _axis_of_many(spec: AxesSpec, run: Run, axis: int, recording: Recording | Flow, truth: Encoding | None) -> Axis:
    own, alone, counts_in, error = of_axis(spec, run, axis), spec.tachometer, None, None
    tally = Tally(alone)
    tally.count(own)
    held = held_from(own.ticks.clock, own.updates, alone)
    if truth is not None and len(own.ticks):
        # From the first look at the axis to the last one of the last tick.
        last = (int(own.ticks.clock[-1]) - spec.shown(axis, 0)) // spec.slots - spec.axis.filter_clocks
        clocks = np.array([spec.look(axis, number) for number in (WARM_UP - 1, last)]) - (WARM_UP - 1)
        first, last = truth.true_position(clocks / spec.timing.clock_hz, spec.axis.encoder.decoding)
        counts_in = int(last - first)
        error = velocity_error(held, truth.true_speed)
    counts_out = 0
    if len(own.ticks):
        counts_out = tally.n_counts if alone.front_end.index_resets else int(own.ticks.position[-1])
    n_merged = recording.n_merged(spec.timing.clock_hz // spec.slots, run.n_clocks // spec.slots)
    return Axis(alone, own, tally, recording, truth, n_merged, counts_in, counts_out, held, error)
