"""Tests against mutants: a warm process forks for each, puts the changed module in place, and runs the tests."""

import ast
import importlib.machinery
import math
import os
import resource
import signal
import sys
import time
import types
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.abc import MetaPathFinder
from pathlib import Path

import pytest
from proofs.python_mutation.mutants import Mutant, mutated

_STARTED = 30.0  # seconds of its processor that a fork may take before its first test
_SLOWER = 5.0  # times as long as the tests took without a mutant, of its processor too
_WAITED = 3600.0  # seconds after which a fork waits for what never comes
_MEMORY = 8 << 30  # bytes that a mutant may ask for


def module_of(file: str) -> str:
    """Name of the module in a file."""
    return ".".join(["tachometry", *Path(file).with_suffix("").parts])


class Changed(MetaPathFinder):
    """Finds one module as its mutant."""

    def __init__(self, name: str, tree: ast.Module) -> None:
        self._name, self._tree = name, tree

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: types.ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Find the module, as importlib says."""
        if fullname != self._name:
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path)
        assert spec is not None
        assert spec.origin is not None
        tree = self._tree

        class Loader(importlib.machinery.SourceFileLoader):
            def get_code(self, fullname: str) -> types.CodeType:
                return compile(tree, self.path, "exec")

        spec.loader = Loader(fullname, spec.origin)
        return spec


@dataclass(frozen=True)
class Verdict:
    """Holds the fate of a mutant: `killed`, `timeout`, `survived`, or `untested` if no test runs its line."""

    mutant: Mutant
    what: str
    tests: int
    seconds: float


def _child(root: Path, mutant: Mutant, tests: Sequence[str], scratch: Path) -> int:
    """Return exit status of pytest in this process, which ends with it."""
    os.setsid()
    quiet = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1, 2):
        os.dup2(quiet, number)
    sys.meta_path.insert(0, Changed(module_of(mutant.file), mutated(root, mutant)))
    words = ["-q", "-x", "-p", "no:cacheprovider", "--no-header", "--tb=no", f"--basetemp={scratch}"]
    return int(pytest.main([*words, *tests]))


def judge_all(
    root: Path,
    jobs: Sequence[tuple[Mutant, Sequence[str], float]],
    processes: int,
    folder: Path,
    told: Callable[[Verdict], None],
) -> list[Verdict]:
    """Return verdicts of all mutants, each with its tests and the seconds that these take without a mutant.

    Whatever is imported is shared by all forks, so the caller must not have imported what is mutated.
    """
    assert not any(name.startswith("tachometry.") for name in sys.modules)
    verdicts: list[Verdict] = []
    running: dict[int, tuple[int, float]] = {}
    waiting = list(enumerate(jobs))[::-1]

    def done(nth: int, what: str, begun: float) -> None:
        mutant, tests, _ = jobs[nth]
        verdicts.append(Verdict(mutant, what, len(tests), time.monotonic() - begun))
        told(verdicts[-1])

    while waiting or running:
        while waiting and len(running) < processes:
            nth, (mutant, tests, took) = waiting.pop()
            begun = time.monotonic()
            if not tests:
                done(nth, "untested", begun)
                continue
            child = os.fork()
            if not child:
                status = 1
                try:
                    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
                    seconds = math.ceil(_STARTED + _SLOWER * took)
                    resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.RLIM_INFINITY))
                    status = _child(root, mutant, tests, folder / f"tmp-{nth}")
                finally:
                    os._exit(status)
            running[child] = nth, begun
        time.sleep(0.02)
        for child, (nth, begun) in list(running.items()):
            ended, status = os.waitpid(child, os.WNOHANG)
            if not ended and time.monotonic() - begun <= _WAITED:
                continue
            if not ended:
                os.killpg(child, signal.SIGKILL)
                os.waitpid(child, 0)
            late = not ended or (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGXCPU)
            del running[child]
            done(nth, "timeout" if late else "killed" if status else "survived", begun)
    return verdicts
