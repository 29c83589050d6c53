"""A signal at any moment of any command leaves nothing behind, and gives no traceback.

A moment is the call of a function, counted, not a time: its number follows from a seed, and a failure comes again.
"""

import importlib
import os
import random
import shlex
import shutil
import signal
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import distributed
import pytest
from support.nightly import nightly

from tachometry.cli.commands import COMMANDS as NAMES
from tachometry.cli.commands import load
from tachometry.cli.main import main
from tachometry.sim.signals.temporary import STOPS
from tachometry.sim.studies import verify as study
from tachometry.sim.studies.pairs import configurations

CORE = "--ppr 9 --clock 1MHz --tick 100us --max-time 1ms"
MOTION = "--motion constant:3000rpm:1ms"
RUN = f"{CORE} --trace t.csv --plot p.png --vcd v.vcd"
SWEEP = f"{CORE} {MOTION} --methods s,m --vary seed=1,2 --jobs 1"
LOOP = f"loop {CORE} --motion constant:3000rpm:80ms --from 40ms --seeds 2"
# What each command writes.
COMMANDS = {
    f"generate {CORE} -o new/out --for litex": "new/out/tachometer.v new/out/tachometer_litex.py",
    f"simulate {RUN} {MOTION} --engine pysim --save-capture s.sr": "t.csv p.png v.vcd v.gtkw s.sr",
    f"simulate {CORE} {MOTION} --engine cxxrtl --trace new/t.csv": "new/t.csv",
    f"replay in.csv {RUN} --engine pysim": "t.csv p.png v.vcd v.gtkw",
    f"compare {CORE} --motion constant:3000rpm:3ms --methods s,difference --csv c.csv --plot p.pdf": "c.csv p.pdf",
    f"plan {CORE} --methods s,m --csv c.csv --plot p.pdf": "c.csv p.pdf",
    f"{LOOP} --csv c.csv --log l.csv --plot p.png": "c.csv l.csv p.png",
    f"sweep {SWEEP} --results r.parquet --plot p.png": "r.parquet p.png",
    "verify --methods m --engines cxxrtl --jobs 1": "",
    "verify --methods m --engines cxxrtl --jobs 2": "",
    "build arty-a7-35 --ppr 9 -o out": "out/tachometer.zip out/tachometer.json out/tachometer.v",
    "monitor sim:icebreaker --ppr 9 --max-speed 100rad/s --duration 20ms --plain --record r.csv": "r.csv",
    "--help": "",
}
_MOMENTS = 300  # over all commands
_PATIENCE = 60.0  # seconds


class Outcome(NamedTuple):
    """Holds what a command has done; its status is negative if a signal has ended it."""

    status: int
    out: str
    err: str
    calls: int


def run_in_a_child(line: str, folder: Path, moment: int, stop: int) -> Outcome:
    """Run a command in a session of its own, to which a signal is sent at a call; 0 is none."""
    for name in ("work", "tmp"):
        (folder / name).mkdir()
    (folder / "work" / "in.csv").write_text("time,a,b\n0,0,0\n0.0005,1,0\n0.001,1,1\n0.002,0,1\n")
    child = os.fork()
    if child == 0:
        try:
            _child(line, folder, moment, stop)
        finally:
            os._exit(99)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    said = [(folder / name).read_text() if (folder / name).exists() else "" for name in ("out", "err", "calls")]
    until = time.monotonic() + _PATIENCE
    while (left := living(child)) and time.monotonic() < until:  # they end when they see that it has
        time.sleep(0.01)
    assert not left, f"processes are left: {left}"
    return Outcome(status, said[0], said[1], int(said[2] or 0))


def _child(line: str, folder: Path, moment: int, stop: int) -> None:
    os.setsid()
    os.chdir(folder / "work")
    os.environ.update(TMPDIR=str(folder / "tmp"))
    distributed.utils._offload_executor = ThreadPoolExecutor(
        1
    )  # a test before may have given ours a thread, left behind
    import tempfile

    tempfile.tempdir = None
    for descriptor, name in ((1, "out"), (2, "err")):
        file = os.open(folder / name, os.O_WRONLY | os.O_CREAT)
        os.dup2(file, descriptor)
    sys.stdout, sys.stderr = (os.fdopen(descriptor, "w", closefd=False) for descriptor in (1, 2))
    for number in STOPS:
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    calls, begun, ours = 0, False, os.getpid()

    def count(frame: Any, event: str, argument: object) -> None:
        nonlocal calls, begun
        begun = begun or frame.f_code.co_name == "_run"
        calls += begun
        if calls == moment and os.getpid() == ours:  # not in a process of a pool
            signal.raise_signal(stop)

    sys.setprofile(count)
    try:
        sys.argv[1:] = shlex.split(line)
        main()
    except SystemExit as end:
        sys.setprofile(None)
        (folder / "calls").write_text(str(calls))
        sys.stdout.flush()
        os._exit(end.code if isinstance(end.code, int) else 98)
    except BaseException:
        sys.setprofile(None)
        sys.excepthook(*sys.exc_info())
        sys.stderr.flush()


def living(session: int) -> list[str]:
    """Return processes of a session that have not ended."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, rest = stat.read_text().rpartition(")")
        except OSError:
            continue
        state, _, _, of = rest.split()[:4]
        if int(of) == session and state not in "ZX":
            found.append(name)
    return found


def wrong(line: str, folder: Path, outcome: Outcome) -> str | None:
    """Return the faults of the files that a command has left."""
    told = [text for text in outcome.err.splitlines() if not text.startswith("tachometry: connected to ")]
    if outcome.status not in (0, 130) or len(told) > 1 or (told and not told[0].startswith("tachometry: interrupted")):
        return f"status {outcome.status}, {outcome.err[-2000:]!r}"
    work = folder / "work"
    there = {str(path.relative_to(work)) for path in work.rglob("*") if path.is_file()} - {"in.csv"}
    wanted = set(COMMANDS[line].split())
    if "v.part.vcd" in there:  # a simulation was interrupted, whose save file is not kept
        there |= {"v.part.gtkw"}
    there = {name.replace(".part.", ".") for name in there}
    if there and not (there <= wanted if line.startswith("sweep") else wanted <= there):
        return f"leaves {there}, not {wanted}"
    hidden = [path for path in work.rglob("*") if path.name.startswith(".")]
    folders = [path for path in work.rglob("*") if path.is_dir() and not any(path.iterdir())]
    left = [*hidden, *folders, *(folder / "tmp").iterdir(), *folder.glob("cache/.tachometry-*")]
    return f"leaves {[str(path.relative_to(folder)) for path in left]}" if left else None


@pytest.fixture(scope="module", autouse=True)
def imported() -> Iterator[None]:
    """Import what commands import, so that moments are those of their work; tests/cli/test_main.py stops imports."""
    for name in NAMES:
        load(name)
    for name in ("run", "compare", "plan", "loop", "sweep"):
        importlib.import_module(f"tachometry.sim.plots.{name}")
    for name in ("amaranth.back.verilog", "amaranth_boards", "matplotlib.backends.backend_pdf"):
        importlib.import_module(name)
    with pytest.MonkeyPatch.context() as patch:
        few = configurations("m")[:1]
        patch.setattr(study, "configurations", lambda method: few)
        yield


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="/proc tells which processes there are")
@nightly  # tests/cli/test_main.py has two moments of two commands
@pytest.mark.parametrize("line", COMMANDS)
def test_a_signal_at_any_moment_leaves_nothing(line: str, tmp_path: Path) -> None:
    folder = tmp_path / "whole"
    folder.mkdir()
    whole = run_in_a_child(line, folder, 0, 0)
    assert (whole.status, wrong(line, folder, whole)) == (0, None), whole
    dice = random.Random(line)
    failed = {}
    for _ in range(-(-_MOMENTS // len(COMMANDS))):
        moment, stop = dice.randrange(1, whole.calls), dice.choice(STOPS)
        (folder := tmp_path / "stopped").mkdir()
        outcome = run_in_a_child(line, folder, moment, stop)
        if (fault := wrong(line, folder, outcome)) is not None:
            failed[f"{stop.name} at call {moment} of {whole.calls}"] = fault
        shutil.rmtree(folder)
    assert not failed, f"tachometry {line}\n" + "\n".join(f"{when}: {fault}" for when, fault in failed.items())
