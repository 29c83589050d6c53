"""Methods are compared as they are given, or each with the best of its settings, and what all settings cost."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial

import numpy as np

from tachometry.sim.encoder.motion import FloatArray, parse_motion
from tachometry.sim.encoder.sampled import encoder_of
from tachometry.sim.golden.sampled import Reads, ways
from tachometry.sim.signals.progress import Bar, no_bar
from tachometry.sim.signals.recording import PinTrace, Recording
from tachometry.sim.signals.shown import Shown
from tachometry.sim.studies.comparing.baseline_catalogue import baseline_model, settings, steps_curve
from tachometry.sim.studies.comparing.baselines import Steps
from tachometry.sim.studies.comparing.compare import (
    Curve,
    Instants,
    Judge,
    Score,
    TrueSpeed,
    begun,
    core_curve,
    read_times,
    score,
)
from tachometry.sim.studies.comparing.tune import (
    SETTLED_S,
    TUNED,
    Cost,
    best,
    core_settings,
    cost,
    front,
    possible,
    triangle,
)
from tachometry.sim.studies.extras import judged_angles
from tachometry.spec import TachometerSpec
from tachometry.spec.language.units import format_time

Specs = Mapping[str, TachometerSpec | None]  # by the name of the method; None: it is a baseline
Make = Callable[[str, Mapping[str, str]], TachometerSpec]


@dataclass(frozen=True)
class Source:
    """Holds the edges that all methods see; a capture does not have the true speed."""

    name: str
    recording: Recording
    true_speed: TrueSpeed | None
    true_angle: TrueSpeed | None = None  # rad


@dataclass(frozen=True)
class Judging:
    """Describes which errors count, and which settings are tried."""

    earliest: float | None = None  # seconds before which errors are left out; None: until every method has a value
    latest: float = math.inf  # seconds after which they are
    read_delay: float = 0.0  # seconds by which all values are read later
    tune: bool = False  # each baseline, and M/T, takes part with the best of its settings
    tradeoff: bool = False  # what all settings cost is measured
    bar: Bar = no_bar


@dataclass(frozen=True, repr=False)
class Comparison(Shown):
    """Holds what has come of all methods.

    - `spec`: Whose clock, tick and unit hold for all, and with which float models are read.
    - `specs`: Of the methods that are compared, by their names with their settings.
    - `n_tried`: Number of settings of which one is the best, by the name of this one.
    - `costs`: Of all settings, by the method; empty if they were not asked for.
    - `rms_speed`, rad/s: Of the motion, with which delays were measured.
    - `position_angle`, degrees: RMS and greatest error of the position as an angle at the instant of its use.
    """

    spec: TachometerSpec
    specs: Specs
    curves: list[Curve]
    scores: list[Score]
    instants: Instants
    true_speed: TrueSpeed | None
    recording: Recording
    n_tried: dict[str, int] = field(default_factory=dict)
    costs: dict[str, list[Cost]] = field(default_factory=dict)
    rms_speed: float = 0.0
    position_angle: tuple[float, float] | None = None

    def shown(self) -> tuple[str, list[list[str]]]:
        """Return the errors of all methods."""
        unit = self.spec.scale.shown_unit
        rows = [
            [one.name, *("-" if value is None else f"{unit.of(value):.4g}" for value in (one.rms, one.max))]
            for one in self.scores
        ]
        return f"comparison of {len(rows)} methods", [["method", f"RMS error ({unit.name})", "greatest"], *rows]

    @property
    def n_merged(self) -> int:
        """Edges that no core can tell apart."""
        clock_hz = self.spec.timing.clock_hz
        return self.recording.n_merged(clock_hz, int(self.recording.duration * clock_hz))

    @property
    def front(self) -> list[Cost]:
        """The costs than which no other setting of the same method has both less error and less delay."""
        return [cost for tried in self.costs.values() for cost in front(tried)]


def _instants(source: Source, curves: list[Curve], judge: Judge, earliest: float | None) -> tuple[Judge, Instants]:
    """Return who judges all curves, and when each is read; it raises ValueError if one is read less than twice."""
    judge = replace(judge, begin=begun(curves, judge.begin))
    instants = [judge.among(curve.reads) for curve in curves]
    if min(map(len, instants)) < 2:
        beyond = "" if earliest is None else ", and beyond --from"
        what = source.name if judge.end == source.recording.duration else "--until"
        raise ValueError(f"{what} must last until every method has a value{beyond}, longer than {_time(judge.end)}")
    return judge, instants


def comparison(spec: TachometerSpec, specs: Specs, make: Make, source: Source, judging: Judging) -> Comparison:
    """Run methods on the same edges, and compare them with the truth.

    - `spec`: Whose encoder, clock and tick hold for all, and with which float models are read.
    - `make`: Makes a core of a method and its own options.
    - `source`: With the true speed, where there is to be `tune` or `tradeoff`.

    It raises ValueError if a method cannot be on these edges, or they end too early.
    """
    for name in (name for name, one in specs.items() if one is None):
        baseline_model(name)  # what is wrong is reported at once
    edges = source.recording, steps_beside(spec, source.recording)
    duration, begin = source.recording.duration, judging.earliest or 0.0
    judge = Judge(source.true_speed, begin, min(duration, judging.latest), judging.read_delay)
    costs, speed, n_tried = dict[str, list[Cost]](), 0.0, dict[str, int]()
    if (judging.tune or judging.tradeoff) and source.true_speed is not None:
        if len(judge.among(edges[1].reads)) < 2:
            raise ValueError(f"{source.name} must last longer than --from, not {_time(duration)}")
        trial = _Trial(spec, make, edges, judge, judging.bar)
        if judging.tradeoff:
            costs, speed = trial.costs(specs)
        if judging.tune:
            specs, n_tried = trial.tuned(specs)
    curves = [Setting(name, one).curve(*edges) for name, one in specs.items()]
    judge, instants = _instants(source, curves, judge, judging.earliest)
    scores = [score(curve, duration, at, source.true_speed) for curve, at in zip(curves, instants, strict=True)]
    seen = source.true_speed, source.recording
    result = Comparison(spec, specs, curves, scores, instants, *seen, n_tried, costs, speed)
    angles = judged_angles(spec, curves, edges[1], source.true_angle, judge) if source.true_angle else []
    return _with_angles(result, angles) if angles else result


def _with_angles(result: Comparison, angles: list[tuple[FloatArray, FloatArray]]) -> Comparison:
    """Return a comparison with errors of angles in its curves and scores; those of the position come first."""
    position, *sizes = [(float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())) for _, error in angles]
    return replace(
        result,
        position_angle=position,
        curves=[replace(curve, angle=angle) for curve, angle in zip(result.curves, angles[1:], strict=True)],
        scores=[
            replace(one, angle_rms_deg=rms, angle_max_deg=most)
            for one, (rms, most) in zip(result.scores, sizes, strict=True)
        ],
    )


def _time(seconds: float) -> str:
    return format_time(Fraction(f"{seconds:.4g}"))


def steps_beside(spec: TachometerSpec, recording: Recording) -> Steps:
    """Return the steps for float models, which are read with a core, and stamp edges with its clock or with 0.1 us."""
    reads = read_times(spec, trace := PinTrace.of(recording, spec))
    if spec.encoder.sampled is not None:
        return _positions(spec, trace, reads)
    steps = Steps.of_sensor(recording, spec.encoder)
    return replace(steps, reads=reads, clock_s=min(steps.clock_s, 1 / spec.timing.clock_hz))


def _positions(spec: TachometerSpec, trace: PinTrace, reads: FloatArray) -> Steps:
    """Return the positions read by a core, each held until the next one."""
    sampled, taken, hz = spec.encoder.sampled, Reads.of(spec, trace), spec.timing.clock_hz
    assert sampled is not None
    place = np.cumsum(ways(taken.sample, sampled.width))
    place = np.append(0, place - place[:1])
    at = np.searchsorted(taken.clock, np.round(reads * hz), side="right")
    old = reads * hz - (taken.clock - taken.age)[np.maximum(at - 1, 0)] if len(taken.clock) else reads
    none = np.empty(0, np.int64)
    return Steps(
        *(np.empty(0), none, trace.n_clocks / hz, spec.encoder.encoder_counts, reads, 1 / hz),
        *(place[at], float(np.median(old)) / hz, float(spec.timing.tick_seconds)),
    )


@dataclass(frozen=True)
class Setting:
    """Holds a method with its options; without a spec it is a baseline."""

    name: str
    spec: TachometerSpec | None

    def curve(self, recording: Recording, steps: Steps) -> Curve:
        """Return what it shows; ValueError if its options are wrong, or do not fit the recording."""
        if self.spec is None:
            return steps_curve(self.name, steps)
        return core_curve(self.name, self.spec, PinTrace.of(recording, self.spec))


@dataclass(frozen=True)
class _Trial:
    """Tries all settings of methods on a motion."""

    spec: TachometerSpec
    make: Make
    edges: tuple[Recording, Steps]
    judge: Judge
    bar: Bar

    def tuned(self, specs: Specs) -> tuple[dict[str, TachometerSpec | None], dict[str, int]]:
        """Return the methods, in place of each baseline and of M/T without options its best setting.

        Returns them, and the number of settings that were tried, by the name of the best. It raises ValueError if a
        method has no setting that can be.
        """
        found: dict[str, TachometerSpec | None] = {}
        n_tried = {}
        settings = self._settings(specs, of_cores=False)
        for name, tried in self._counted(settings, "tuning"):
            if len(settings[name]) == 1:
                found[name] = specs[name]
                next(tried)
                continue
            curves = possible(partial(setting.curve, *self.edges) for setting in tried)
            chosen = best(curves, self.judge).name
            found[chosen] = next(setting.spec for setting in settings[name] if setting.name == chosen)
            n_tried[chosen] = len(settings[name])
        return found, n_tried

    def costs(self, specs: Specs) -> tuple[dict[str, list[Cost]], float]:
        """Return what all settings of each method cost, and the RMS speed (rad/s) of the motion, with which delays were
        measured.

        It raises ValueError if the shaft does not move.
        """
        assert self.judge.true_speed is not None
        speed = float(np.sqrt(np.mean(self.judge.true_speed(self.judge.among(self.edges[1].reads)) ** 2)))
        if not speed:
            raise ValueError("--motion must move the shaft where there is a --tradeoff")
        found: dict[str, list[Cost]] = {}
        own = next((spec for spec in specs.values() if spec is not None and spec.index is not None), self.spec)
        moving = encoder_of(own).record(parse_motion(triangle(speed)))
        judge = replace(self.judge, true_speed=moving.true_speed, begin=SETTLED_S, end=moving.recording.duration)
        edges = moving.recording, steps_beside(self.spec, moving.recording)
        for name, tried in self._counted(self._settings(specs, of_cores=True), "measuring"):
            found[name] = []
            for setting in tried:
                try:
                    curves = setting.curve(*self.edges), setting.curve(*edges)
                except ValueError:
                    continue  # not with this clock, encoder or motion
                measured = cost(name, *curves, self.judge, judge)
                if measured is not None:
                    found[name].append(measured)
        return found, speed

    def _settings(self, specs: Specs, *, of_cores: bool) -> dict[str, list[Setting]]:
        return {name: self._tried(Setting(name, spec), of_cores=of_cores) for name, spec in specs.items()}

    def _tried(self, setting: Setting, *, of_cores: bool) -> list[Setting]:
        """Return all settings of a method; one if it is given with options, and of a core that is not to be tuned."""
        if ":" in setting.name:
            return [setting]
        if setting.spec is None:
            return [replace(setting, name=name) for name in settings(setting.name)]
        found = [setting]
        if of_cores or setting.name in TUNED:
            for name, options in core_settings(setting.name):
                try:
                    found.append(replace(setting, name=name, spec=self.make(setting.name, options)))
                except ValueError:
                    continue  # not with this clock or tick
        return found

    def _counted(self, settings: dict[str, list[Setting]], verb: str) -> Iterator[tuple[str, Iterator[Setting]]]:
        """Yield methods with their settings one by one; a progress bar counts these."""
        n_done = 0
        with self.bar(verb, sum(map(len, settings.values())), "settings") as report:

            def count(tried: list[Setting]) -> Iterator[Setting]:
                nonlocal n_done
                for setting in tried:
                    yield setting
                    n_done += 1
                    report(n_done)

            for name, tried in settings.items():
                yield name, count(tried)
