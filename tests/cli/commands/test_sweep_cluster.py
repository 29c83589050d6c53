"""`tachometry sweep` on processes that are killed, workers or itself: nothing is lost, nothing is there twice."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from support.nightly import nightly, only

COMMAND = [sys.executable, "-c", "from tachometry.cli.main import main; main()", "sweep"]
SWEEP = [
    *"--ppr 100 --clock 1MHz --tick 1ms --max-time 20ms --jitter 0.1 --motion constant:{speed}:50ms".split(),
    *"--methods s,m --vary speed=1rad/s..100rad/s:50".split(),
]
POINTS = 100

# Read by every worker, twice: what it runs it writes down, and waits until the test lets a point run. A worker that is
# told to end does not wait.
TRACE = """
import os, select
from distributed import Status, get_worker
from tachometry.sim.studies.sweeping import sweep
if not hasattr(sweep, "traced"):
    sweep.traced = sweep.run_point
    gate = os.open({gate!r}, os.O_RDWR | os.O_NONBLOCK)
    def allowed():
        try:
            return os.read(gate, 1)
        except BlockingIOError:  # another worker was first
            return b""
    def run_point(point):
        with open(os.path.join({folder!r}, str(os.getpid())), "a") as file:
            file.write(point.digest + "\\n")
        while not (select.select([gate], [], [], 0.05)[0] and allowed()):
            if get_worker().status != Status.running:
                raise RuntimeError("ended")
        return sweep.traced(point)
    sweep.run_point = run_point
"""


class Trace:
    """Holds the points that workers have run, and how many they may."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "trace"
        self.folder.mkdir(parents=True)
        os.mkfifo(folder / "gate")
        self._gate = os.open(folder / "gate", os.O_RDWR)
        self.script = folder / "trace.py"
        self.script.write_text(TRACE.format(folder=str(self.folder), gate=str(folder / "gate")))

    def let(self, points: int) -> None:
        """Let so many more points run."""
        os.write(self._gate, bytes(points))

    def of(self, worker: str) -> list[str]:
        return (self.folder / worker).read_text().split()

    def all(self) -> Counter[str]:
        return Counter(point for file in self.folder.iterdir() for point in self.of(file.name))


def begun(result: Path, *options: str, trace: Trace | None = None) -> subprocess.Popen[str]:
    """Return the command, in a process group of its own, as a shell has it."""
    preload = {} if trace is None else {"DASK_DISTRIBUTED__WORKER__PRELOAD": f'["{trace.script}"]'}
    return subprocess.Popen(
        [*COMMAND, *SWEEP, "--results", str(result), *options],
        env=os.environ | preload,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def kept(result: Path) -> list[str]:
    """Return rows of the journal: the line of each that is whole."""
    journal = result.with_name(f".{result.name}.new")
    return journal.read_text().split("\n")[1:-1] if journal.exists() else []


def wait_for(rows: int, result: Path, sweep: subprocess.Popen[str]) -> None:
    """Until so many are kept; the sweep has not ended by then."""
    while len(kept(result)) < rows:
        assert sweep.poll() is None, sweep.communicate(timeout=600)
        time.sleep(0.01)


def points_in(rows: list[str]) -> list[str]:
    return [row.split('"point": "')[1].split('"')[0] for row in rows]


# They are held back in one place.
@pytest.mark.parametrize("end", only([signal.SIGTERM], [signal.SIGTERM, signal.SIGHUP, signal.SIGINT]))
def test_the_sweep_is_interrupted_while_its_processes_start(end: signal.Signals, tmp_path: Path) -> None:
    """It heeds the signal when they are there, and ends them; nothing is said but this, and nothing is left."""
    with begun(tmp_path / "r.parquet") as sweep:
        children = Path(f"/proc/{sweep.pid}/task")
        while not any(file.read_text() for file in children.glob("*/children")):
            assert sweep.poll() is None
            time.sleep(0.001)
        os.killpg(sweep.pid, end)
        out, err = sweep.communicate(timeout=600)
    assert (sweep.returncode, out, err) == (130, "", f"tachometry: interrupted after 0 of {POINTS} points\n")
    assert not list(tmp_path.iterdir())


@nightly
def test_the_sweep_is_interrupted_and_killed_and_goes_on(tmp_path: Path) -> None:
    result = tmp_path / "r.parquet"
    traces = [Trace(tmp_path / name) for name in "123"]
    sweep = begun(result, trace=traces[0])
    traces[0].let(10)
    wait_for(10, result, sweep)
    os.killpg(sweep.pid, signal.SIGINT)
    out, err = sweep.communicate(timeout=600)
    first = pq.read_table(result)["point"].to_pylist()
    assert len(first) == 10
    told = f"tachometry: interrupted after 10 of {POINTS} points, kept in {result}\n"
    assert (sweep.returncode, out, err) == (130, "", told)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1", "2", "3", "r.parquet"]

    sweep = begun(result, trace=traces[1])
    traces[1].let(10)
    wait_for(10, result, sweep)
    os.kill(sweep.pid, signal.SIGKILL)
    sweep.communicate(timeout=600)
    second = points_in(kept(result))
    assert pq.read_table(result)["point"].to_pylist() == first
    with result.with_name(".r.parquet.new").open("a") as file:
        file.write('{"point": "half a li')  # as a kill might leave it

    sweep = begun(result, trace=traces[2])
    traces[2].let(POINTS)
    out, err = sweep.communicate(timeout=600)
    assert (sweep.returncode, err) == (0, "")
    assert len(second) == 10
    assert f"{POINTS} points, {POINTS - 20} of them run in " in out
    points = pq.read_table(result)["point"].to_pylist()
    assert len(points) == len(set(points)) == POINTS
    ran = [trace.all() for trace in traces]
    assert set(ran[0]) >= set(first)
    assert set(ran[1]) >= set(second)
    assert not set(ran[1]) & set(first)
    assert ran[2] == Counter(set(points) - set(first) - set(second))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1", "2", "3", "r.parquet"]

    # The same, but for nothing in between.
    whole = tmp_path / "whole.parquet"
    begun(whole, "--jobs", "1").communicate(timeout=600)
    assert whole.read_bytes() == result.read_bytes()


def test_a_point_that_no_worker_outlives(tmp_path: Path) -> None:
    """It is lost with its task of three points, and perhaps with the task that waited on the same worker."""
    script, result = tmp_path / "die.py", tmp_path / "r.parquet"
    script.write_text(
        "import os\nfrom tachometry.sim.studies.sweeping import sweep\n"
        "sweep.run = vars(sweep).get('run', sweep.run_point)\n"
        "sweep.run_point = lambda point: os._exit(1) if point.values['speed'] == 7 else sweep.run(point)\n"
    )
    more = {"DASK_DISTRIBUTED__WORKER__PRELOAD": f'["{script}"]', "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    vary = ["--methods", "m", "--vary", "speed=1rad/s..300rad/s:300", "--results", str(result), "--jobs", "1"]
    done = subprocess.run([*COMMAND, *SWEEP[:-4], *vary], env=os.environ | more, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    lost = {*range(1, 301)} - {*pq.read_table(result)["speed"].to_pylist()}
    assert 7 in lost
    assert len(lost) in (3, 6)
    error = done.stderr.splitlines()[-1]
    assert error.startswith("tachometry: error: every worker died at one of 3 points, the first that of m on ")
    assert error.endswith(f"; {len(lost)} of 300 points could not be run")
