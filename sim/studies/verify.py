"""Cores on seeded motions, by several engines, against their golden models."""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from itertools import islice
from multiprocessing import Pipe, Process, parent_process
from multiprocessing.connection import wait
from typing import Any, TypeVar

import numpy as np

from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress_of
from tachometry.sim.engines.engine import Engine
from tachometry.sim.engines.pick import pick
from tachometry.sim.signals.axes import Trace
from tachometry.sim.signals.progress import Bar
from tachometry.sim.signals.run import Mismatch, Run
from tachometry.sim.signals.temporary import held_back
from tachometry.sim.studies.lockstep import lockstep
from tachometry.sim.studies.pairs import AXES, WHEELS, configurations, core_of
from tachometry.spec import CoreSpec

Core = TypeVar("Core")
Result = TypeVar("Result")

_EDGES, _MOST_EDGES = 300, 50_000  # at a speed, of a motion
# Some thousand times slower than the others, it runs a thousandth of their clocks.
_SLOW, _SLOW_SHARE, _SLOW_LEAST = "pysim", 1000, 10_000
_PATIENCE = 10.0  # seconds in which a process that is told to end does so


@dataclass(frozen=True)
class Failure:
    """Holds the first motion on which hardware and golden model differ."""

    seed: int
    first: list[Mismatch]  # in each signal that differs
    trace: Trace  # the motion, up to what differs first


@dataclass
class Outcome:
    """Holds the outcome of all motions on an engine."""

    n_motions: int = 0
    n_clocks: int = 0
    n_ticks: int = 0
    n_updates: int = 0
    n_mismatches: int = 0
    seconds: float = 0.0  # that the engine took, its build included
    failure: Failure | None = None


@dataclass(frozen=True)
class Configuration:
    """Describes a core; `name` is that of its captures, and `words` are those of the command line."""

    name: str
    method: str
    words: tuple[str, ...]

    @property
    def spec(self) -> CoreSpec:
        """The core."""
        return core_of(self.words)


@dataclass(frozen=True)
class Verification:
    """Holds the outcomes of configurations."""

    outcomes: list[tuple[Configuration, dict[str, Outcome]]]  # by the engine
    n_cores: int  # configurations that there are; after Ctrl-C not all have an outcome


def verification(
    methods: Sequence[str],
    engines: Sequence[str],
    n_clocks: int,
    seed: int,
    jobs: int | None,
    bar: Bar,
    save: Callable[[Configuration, str, Failure], None],
) -> Verification:
    """Verify all configurations of methods, in so many processes; method s is also that of many axes.

    Each engine is to run `n_clocks`, spread over the configurations. `save` is given a configuration and an engine that
    has failed, as soon as it has. Without `jobs` there is a process for each core of the computer.
    """
    for engine in engines:
        pick(engine)  # what is missing is reported at once
    cores = [
        Configuration(f"{method}{number}", method, words)
        for method in methods
        for number, words in enumerate(
            [*configurations(method), *(one for one in (*AXES, *WHEELS) if one[1] == method)], 1
        )
    ]
    check = partial(_check, engines=engines, n_clocks=-(-n_clocks // len(cores)), seed=seed)
    found = Verification([], len(cores))
    with (
        suppress(KeyboardInterrupt),
        _each(check, cores, jobs or os.cpu_count() or 1) as results,
        bar("verifying", len(cores), "configurations") as report,
    ):
        for core, outcomes in results:
            for engine, outcome in outcomes.items():
                if outcome.failure is not None:
                    save(core, engine, outcome.failure)
            found.outcomes.append((core, outcomes))
            report(len(found.outcomes))
    return found


def _check(
    core: Configuration, *, engines: Sequence[str], n_clocks: int, seed: int
) -> tuple[Configuration, dict[str, Outcome]]:
    return core, verify(core.spec, engines, n_clocks, seed)


def _work(check: Callable[[Core], Result], calls: Any) -> None:
    """In a process of its own: answer every core that is sent.

    The main process ends it at Ctrl-C and when the terminal is closed, so that it ignores both.
    """
    for name in {"SIGINT", "SIGHUP"} & set(dir(signal)):
        signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(1))  # in order, with a compiler that it runs
    threading.Thread(target=_end_with_the_parent, daemon=True).start()
    while True:
        core = calls.recv()
        try:
            calls.send((check(core), None))
        except Exception as error:
            calls.send((None, error))


def _end_with_the_parent() -> None:
    """End with the main process, which may be killed: nobody else ends this one then."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def _each(check: Callable[[Core], Result], cores: list[Core], n_jobs: int) -> Iterator[Iterable[Result]]:
    """Yield results as they come; what still runs ends with the context.

    Taking a result raises OSError if a process was killed, as the system does when memory runs out.
    """
    if n_jobs == 1:
        yield map(check, cores)
        return
    processes: list[Process] = []
    with ExitStack() as stack:
        stack.callback(_end, processes)
        ends = []
        with held_back():  # what is raised in a fork is lost
            for _ in cores[:n_jobs]:
                mine, theirs = Pipe()
                ends.append(stack.enter_context(mine))
                with theirs:
                    processes.append(Process(target=_work, args=(check, theirs), daemon=True))
                    processes[-1].start()
        left = iter(cores)
        for end, core in zip(ends, left, strict=False):
            end.send(core)
        yield (_answer(ends, left) for _ in cores)


def _answer(ends: list[Any], left: Iterator[Any]) -> Any:
    """Return the next answer of a process, which is given one of the cores that are left."""
    end: Any = wait(ends)[0]
    try:
        result, error = end.recv()
    except EOFError:
        raise OSError("a process of verify was killed (out of memory?): try fewer --jobs") from None
    if error is not None:
        raise error
    for core in islice(left, 1):
        end.send(core)
    return result


def _end(processes: list[Process]) -> None:
    for process in processes:
        process.terminate()
    for process in processes:
        process.join(_PATIENCE / 20)
        process.terminate()  # again: what the first signal raised in a `__del__` is lost
        process.join(_PATIENCE)
        process.kill()
        process.join()


def motions(spec: CoreSpec, seed: int, n_clocks: int) -> Iterator[tuple[int, Trace]]:
    """Seed and motion, of `seed`, `seed` + 1 … until they have `n_clocks` clocks together; one at least."""
    done, n_edges = 0, _EDGES
    while True:
        trace = stress_of(spec, seed, n_edges)
        yield seed, trace
        done += trace.n_clocks
        if done >= n_clocks:
            return
        seed += 1
        n_edges = int(np.clip(n_edges * (n_clocks - done) // trace.n_clocks, _EDGES, _MOST_EDGES))


def verify(spec: CoreSpec, engines: Sequence[str], n_clocks: int, seed: int) -> dict[str, Outcome]:
    """Run motions on every engine, and compare every bit of every tick and update with the golden model.

    Each engine runs `n_clocks` at least, but pysim a thousandth of them, and no fewer than 10,000; `seed` is that of
    the first motion. It returns outcomes by the engine.
    """
    outcomes = {engine: Outcome() for engine in engines}
    used = {engine: pick(engine) for engine in engines}
    few = max(n_clocks // _SLOW_SHARE, _SLOW_LEAST)
    for number, whole in motions(spec, seed, n_clocks):
        expected: dict[int, Run] = {}
        for engine, outcome in outcomes.items():
            most = few - outcome.n_clocks if engine == _SLOW else whole.n_clocks
            if most == 0:
                continue
            trace = whole.until(min(most, whole.n_clocks))
            if trace.n_clocks not in expected:
                expected[trace.n_clocks] = golden.run(spec, trace)
            _add(outcome, spec, used[engine], number, trace, expected[trace.n_clocks])
    return outcomes


def _add(outcome: Outcome, spec: CoreSpec, engine: Engine, seed: int, trace: Trace, expected: Run) -> None:
    begun = time.perf_counter()
    found = lockstep(spec, trace, engine, expected=expected)
    outcome.seconds += time.perf_counter() - begun
    outcome.n_motions += 1
    outcome.n_clocks += trace.n_clocks
    outcome.n_ticks += len(found.actual.ticks)
    outcome.n_updates += len(found.actual.updates)
    outcome.n_mismatches += found.n_mismatches
    if found.n_mismatches and outcome.failure is None:
        # A capture holds what comes before its end; the outputs come a little later.
        end = min(mismatch.clock for mismatch in found.first) + spec.tick.longest + spec.latency.tick
        outcome.failure = Failure(seed, found.first, trace.until(min(end, trace.n_clocks)))
