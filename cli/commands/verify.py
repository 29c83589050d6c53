"""`tachometry verify`: every method on every engine, in many configurations, against the golden models."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from tachometry.cli.files import Outputs
from tachometry.cli.options.option import command, option, output_folder
from tachometry.cli.reports.terminal import progress_bar
from tachometry.cli.reports.verify import print_verification
from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.engines.pick import NAMES, present
from tachometry.sim.studies.verify import Configuration, Failure, verification
from tachometry.spec import METHODS

_VERIFICATION = "Verification"

_ENGINES = """Engines to verify: all, or names with commas between. pysim, cxxrtl, verilator; all are those of this \
machine. cxxrtl-every-clock, not among all, is CXXRTL that skips no clock."""
_CLOCKS = """Clocks to simulate on each engine. They are spread over the configurations; pysim simulates a thousandth \
of them. Every configuration runs at least one motion."""
_JOBS = "Number of processes. [default: one for each core of the computer]"


@command("""\b
Examples:
  tachometry verify
  tachometry verify --methods s,rairan --engines cxxrtl --clocks 1000000000

The first run builds every core for every engine, which takes most of the time;
later ones find them in the cache.""")
@option(
    _VERIFICATION,
    "--methods LIST",
    default="all",
    help=lambda: f"Methods to verify: all, or names with commas between. They are {', '.join(METHODS)}.",
)
@option(_VERIFICATION, "--engines LIST", default="all", help=_ENGINES)
@option(_VERIFICATION, "--clocks N", type=click.IntRange(min=0), default=0, help=_CLOCKS)
@option(_VERIFICATION, "--seed N", type=click.IntRange(min=0), default=1, help="Seed of the first motion.")
@option(_VERIFICATION, "--jobs N", type=click.IntRange(min=1), help=_JOBS)
@output_folder("build/verify", help="Folder of the captures of failing motions.")
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
    differences: list[str] = []

    def save(core: Configuration, engine: str, failure: Failure) -> None:
        capture = directory / f"{core.name}-{engine}-{failure.seed}.sr"
        with Outputs({"capture": capture}) as outputs:
            write_sr(outputs["capture"], failure.trace, core.spec.timing.clock_hz)
        command = shlex.join(["tachometry", "replay", str(capture), *core.words, "--engine", engine])
        lines = [f"{core.name}, seed {failure.seed}, {engine}:", *map(str, failure.first), command]
        differences.append("\n  ".join(lines))

    result = verification(chosen, used, clocks, seed, jobs, progress_bar, save)
    return print_verification(result, chosen, used, differences)


def _listed(what: str, text: str, known: list[str]) -> list[str]:
    """Return the names of a list, in the order in which they are known."""
    names = known if text.strip() == "all" else [word.strip() for word in text.split(",")]
    for name in names:
        if name not in known:
            raise ValueError(f"--{what} must be of {', '.join(known)}, or all, not {name!r}")
    return [name for name in known if name in names]
