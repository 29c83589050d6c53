"""Tests against mutants: a warm process forks for each, puts the changed module in place, and runs the tests."""

import ast
import importlib.machinery
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

_STARTED = 30.0  # seconds that a fork may take before its first test
_MEMORY = 8 << 30  # bytes that a mutant may ask for
_SLOWER = 20.0  # times as long as the tests took without a mutant


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
        """See importlib."""
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
    """What came of a mutant: `killed`, `timeout`, `survived`, or `untested` if no test runs its line."""

    mutant: Mutant
    what: str
    tests: int
    seconds: float


def _child(root: Path, mutant: Mutant, tests: Sequence[str], scratch: Path) -> int:
    """Exit status of pytest in this process, which ends with it."""
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
    """Verdicts of all mutants, each with its tests and the seconds that these take without a mutant.

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
            nth, (mutant, tests, _) = waiting.pop()
            begun = time.monotonic()
            if not tests:
                done(nth, "untested", begun)
                continue
            child = os.fork()
            if not child:
                status = 1
                try:
                    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
                    status = _child(root, mutant, tests, folder / f"tmp-{nth}")
                finally:
                    os._exit(status)
            running[child] = nth, begun
        time.sleep(0.02)
        for child, (nth, begun) in list(running.items()):
            ended, status = os.waitpid(child, os.WNOHANG)
            late = time.monotonic() - begun > _STARTED + _SLOWER * jobs[nth][2]
            if not ended and not late:
                continue
            if not ended:
                os.killpg(child, signal.SIGKILL)
                os.waitpid(child, 0)
            del running[child]
            done(nth, "survived" if ended and status == 0 else "killed" if ended else "timeout", begun)
    return verdicts
