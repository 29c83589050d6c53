"""`tachometry verify`: every method on every engine, in many configurations, against the golden models."""

from __future__ import annotations

import functools
import os
import shlex
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import Pool, parent_process
from pathlib import Path

import click
from rich.text import Text

from tachometry.cli.options.option import GroupedCommand, option, output_folder
from tachometry.cli.reports.streams import INTERRUPTED
from tachometry.cli.reports.terminal import print_table, progress_bar, stdout_console
from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.engines.pick import NAMES, pick, present
from tachometry.sim.studies.axes import AXES, core_of
from tachometry.sim.studies.pairs import configurations
from tachometry.sim.studies.verify import Outcome
from tachometry.sim.studies.verify import verify as verify_core
from tachometry.spec import METHODS

_VERIFICATION = "Verification"


@dataclass(frozen=True)
class _Configuration:
    """One core; `name` is that of its captures."""

    name: str
    method: str
    words: tuple[str, ...]


@click.command(
    cls=GroupedCommand,
    epilog="""\b
Examples:
  tachometry verify
  tachometry verify --methods s,rairan --engines cxxrtl --clocks 1000000000

The first run builds every core for every engine, which takes most of the time;
later ones find them in the cache.""",
)
@option(
    _VERIFICATION,
    "--methods",
    default="all",
    metavar="LIST",
    help=lambda: f"Methods to verify: all, or names with commas between, of {', '.join(METHODS)}.",
)
@option(
    _VERIFICATION,
    "--engines",
    default="all",
    metavar="LIST",
    help="Engines to verify, with commas between: pysim, cxxrtl, verilator; all are those that can be used here. With "
    "cxxrtl-every-clock, which is not among all, CXXRTL skips no clock.",
)
@option(
    _VERIFICATION,
    "--clocks",
    type=click.IntRange(min=0),
    default=0,
    metavar="N",
    help="Clocks that each engine simulates, spread over the configurations; pysim simulates a thousandth of them. "
    "Every "
    "configuration runs one motion at least.",
)
@option(_VERIFICATION, "--seed", type=click.IntRange(min=0), default=1, metavar="N", help="Seed of the first motion.")
@option(
    _VERIFICATION,
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Number of processes. [default: one for each core of the computer]",
)
@output_folder("build/verify", help="Folder of the captures of failing motions; it is made if a motion fails.")
def verify(methods: str, engines: str, clocks: int, seed: int, jobs: int | None, directory: Path) -> int:
    """Hold all engines against the golden models, in many configurations.

    Every two options of a method meet in some configuration; method s is also that of many axes. Seeded motions visit
    what a core must survive: speeds about the unit velocity and its multiples, reversals, illegal transitions,
    creeping, standstill. Every bit of every tick and update is compared.

    Exit status 1 if any differs: the first motion on which it does is saved as a capture, and the command that replays
    it is printed.
    """
    chosen = _listed("methods", methods, list(METHODS))
    used = present() if engines.strip() == "all" else _listed("engines", engines, list(NAMES))
    for engine in used:
        pick(engine)  # what is missing is reported at once
    cores = [
        _Configuration(f"{method}{number}", method, words)
        for method in chosen
        for number, words in enumerate([*configurations(method), *(AXES if method == "s" else ())], 1)
    ]
    check = functools.partial(_check, engines=used, clocks=-(-clocks // len(cores)), seed=seed, directory=directory)
    found: list[_Result] = []
    interrupted = False
    try:
        with (
            _each(check, cores, jobs or os.cpu_count() or 1) as results,
            progress_bar("verifying", len(cores), "configurations") as report,
        ):
            for result in results:
                found.append(result)
                report(len(found))
    except KeyboardInterrupt:
        interrupted = True
    failed = _print(found, chosen, used, whole=not interrupted)
    if interrupted:
        click.echo(f"tachometry: interrupted after {len(found)} of {len(cores)} configurations", err=True)
    return 1 if failed else INTERRUPTED if interrupted else 0


def _listed(what: str, text: str, known: list[str]) -> list[str]:
    """Return the names of a list, in the order in which they are known."""
    names = known if text.strip() == "all" else [word.strip() for word in text.split(",")]
    for name in names:
        if name not in known:
            raise ValueError(f"--{what} must be of {', '.join(known)}, or all, not {name!r}")
    return [name for name in known if name in names]


@dataclass(frozen=True)
class _Result:
    """Holds the outcome of a configuration by engine, and the text of its failures."""

    method: str
    outcomes: dict[str, Outcome]
    failures: list[str]


def _check(core: _Configuration, *, engines: list[str], clocks: int, seed: int, directory: Path) -> _Result:
    """Verify one configuration, and save what fails."""
    spec = core_of(core.words)
    outcomes = verify_core(spec, engines, clocks, seed)
    failures = []
    for engine, outcome in outcomes.items():
        if (failure := outcome.failure) is None:
            continue
        directory.mkdir(parents=True, exist_ok=True)
        capture = directory / f"{core.name}-{engine}-{failure.seed}.sr"
        write_sr(capture, failure.trace, spec.timing.clock_hz)
        command = shlex.join(["tachometry", "replay", str(capture), *core.words, "--engine", engine])
        failures.append(
            "\n  ".join([f"{core.name}, seed {failure.seed}, {engine}:", *map(str, failure.first), command])
        )
        outcome.failure = None  # saved; it is large
    return _Result(core.method, outcomes, failures)


def _heed_only_the_pool() -> None:
    """In a process of the pool: ignore Ctrl-C, which the main process handles by ending the others; end after it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_the_parent, daemon=True).start()


def _end_with_the_parent() -> None:
    """End with the main process, which may be killed: nobody else ends this one then."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextmanager
def _each(
    check: Callable[[_Configuration], _Result], cores: list[_Configuration], n_jobs: int
) -> Iterator[Iterable[_Result]]:
    """Yield results as they come; what still runs ends with the context."""
    if n_jobs == 1:
        yield map(check, cores)
        return
    with Pool(n_jobs, _heed_only_the_pool) as pool:
        yield pool.imap_unordered(check, cores)


_HEADS = ("method", "engine", "configurations", "motions", "clocks", "ticks", "updates", "mismatches", "seconds")


def _print(found: list[_Result], methods: list[str], engines: list[str], *, whole: bool) -> bool:
    """Print the table and the verdict, if it is about the whole; whether anything differs."""
    rows = []
    total = dict.fromkeys(_HEADS[3:], 0.0)
    for method in methods:
        for engine in engines:
            outcomes = [result.outcomes[engine] for result in found if result.method == method]
            sums = {
                head: sum(getattr(outcome, head if head == "seconds" else f"n_{head}") for outcome in outcomes)
                for head in total
            }
            rows.append((method, engine, str(len(outcomes)), *(f"{value:.0f}" for value in sums.values())))
            for head, value in sums.items():
                total[head] += value
    print_table(_HEADS, rows, left=(0, 1))
    console = stdout_console()
    for failure in (failure for result in found for failure in result.failures):
        console.print(Text(f"differs: {failure}"), soft_wrap=True)
    if failed := bool(total["mismatches"]):
        verdict = f"FAIL: hardware and golden model differ in {total['mismatches']:.0f} values"
    else:
        verdict = (
            f"PASS: {', '.join(engines)} and golden models agree in every bit of {total['updates']:.0f} updates and "
            f"{total['ticks']:.0f} ticks"
        )
    if failed or whole:
        console.print(Text(verdict, style="bold red" if failed else "bold green"), soft_wrap=True)
    return failed
