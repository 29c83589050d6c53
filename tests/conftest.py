"""All tests share these fixtures and hooks."""

import gc
import os
import signal
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

# Compiled cores stay in the checkout.
os.environ.setdefault("TACHOMETRY_CACHE", str(Path(__file__).parent.parent / "build" / "cache"))

# A shell ignores Ctrl-C for what it runs in the background, and commands that tests begin would ignore it, too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

gc.disable()  # while tests are collected, which all stay


def pytest_collection_finish() -> None:
    """Let Python look for garbage among what tests make, seldom, and no more in what was collected."""
    gc.freeze()
    gc.set_threshold(200_000, 20, 20)
    gc.enable()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the seconds that the tests of each folder took."""
    seconds: Counter[str] = Counter()
    for report in (report for reports in terminalreporter.stats.values() for report in reports):
        folder = getattr(report, "nodeid", "").partition("::")[0].removeprefix("tests/").split("/")[0]
        seconds[folder if "." not in folder else "others"] += getattr(report, "duration", 0)
    told = (f"{folder} {time:.0f}" for folder, time in seconds.most_common(12) if time >= 1)
    terminalreporter.write_line(f"seconds: {', '.join(told)}")


@pytest.fixture(scope="session")
def local() -> Iterator[Any]:
    """Yield a scheduler of Dask with a worker, in threads of this process."""
    from distributed import LocalCluster

    ours = {"protocol": "tcp", "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, **ours) as cluster:
        yield cluster


@pytest.fixture
def scheduler(local: Any) -> list[str]:
    """Return the options that run points on that scheduler."""
    return ["--scheduler", local.scheduler_address]


@pytest.fixture
def mapped() -> None:
    """Let commands estimate sizes from what is in a core, which takes a second."""


@pytest.fixture(autouse=True)
def unmapped(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Take one size for that of every core, except in tests that ask for `mapped`."""
    if "mapped" not in request.fixturenames:
        from tachometry.sim.studies.estimate import Estimate

        monkeypatch.setattr(
            "tachometry.sim.studies.estimate._estimate",
            lambda spec, bus, family: Estimate(family, 1000, 500, 200e6, spec.tachometer.timing.clock_hz),
        )


@pytest.fixture
def generated(tmp_path: Path) -> Callable[..., Path]:
    """Return the command `tachometry generate` in this process: the folder in which it has written a core's files."""

    def generate(name: str, *words: str) -> Path:
        from support.command import run

        assert run("generate", "--name", name, "-o", tmp_path, *words) == 0
        return tmp_path

    return generate


@pytest.fixture
def described() -> Callable[[Mapping[str, str]], Any]:
    """Return what gives the manifest of a core of these options."""
    from tachometry.spec import of_options
    from tachometry.spec.registers.manifest import manifest

    return lambda words: manifest(of_options(words))


@pytest.fixture
def golden() -> Callable[..., Any]:
    """Return what gives the golden tables of a core of these options, whose lines change at some clocks or stay."""
    import numpy as np

    from tachometry.sim import golden
    from tachometry.sim.signals.recording import PinTrace
    from tachometry.spec import of_options

    def run(words: Mapping[str, str], clocks: Any, n_clocks: int, **lines: Any) -> Any:
        levels = {name: np.broadcast_to(np.array(line, np.uint8), len(clocks)) for name, line in lines.items()}
        return golden.run(of_options(words).tachometer, PinTrace.of_lines(np.array(clocks), n_clocks, levels)).tables

    return run
