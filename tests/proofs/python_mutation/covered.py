"""Which tests run which lines, and how long each takes: one run of the tests, of which every test is a context."""

import ast
import hashlib
import json
import os
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import coverage
import pytest

_NEXT_TO_NO_TIME = 0.05  # seconds
Covered = dict[str, dict[str, Any]]  # by the name of a test: "seconds", and "lines" by file


class Contexts:
    """A plugin of pytest: notes the lines of the test that runs, and its time."""

    def __init__(self, root: Path, files: Sequence[str]) -> None:
        self._cov = coverage.Coverage(data_file=None, include=[str(root / file) for file in files], config_file=False)
        self._paths = {str((root / file).resolve()): file for file in files}
        self.found: Covered = {}
        self._cov.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self._cov.switch_context(item.nodeid)
        start = time.monotonic()
        result = yield
        self.found[item.nodeid] = {"seconds": round(time.monotonic() - start, 3), "lines": {}}
        return result

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.found.pop(report.nodeid, None)

    def lines(self) -> Covered:
        """Return what every test ran; "" is what ran when modules were imported."""
        self._cov.stop()
        data = self._cov.get_data()
        self.found[""] = {"seconds": 0.0, "lines": {}}
        for path in data.measured_files():
            file = self._paths.get(str(Path(path).resolve()))
            if file is None:
                continue
            for line, contexts in data.contexts_by_lineno(path).items():
                for context in contexts:
                    if context in self.found:
                        self.found[context]["lines"].setdefault(file, []).append(line)
        return self.found


def covered(root: Path, files: Sequence[str], tests: Sequence[str], folder: Path) -> Covered:
    """Return what the tests cover; a file in the folder keeps it as long as no source and no test changes."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = [path.read_bytes() for path in sorted([*(root / "tests").rglob("*.py"), *(root / file for file in files)])]
    key = hashlib.sha256(b"\0".join([*texts, repr(tests).encode()])).hexdigest()[:16]
    kept = folder / f"covered-{key}.json"
    if not kept.exists():
        child = os.fork()
        if not child:  # this process must not import what is to be mutated
            plugin = Contexts(root, files)
            words = ["-q", "-m", "not nightly", "-p", "no:cacheprovider", f"--basetemp={folder / 'baseline'}", *tests]
            status = pytest.main(words, plugins=[plugin])
            kept.write_text(json.dumps(plugin.lines()))
            os._exit(int(status))
        if os.waitpid(child, 0)[1]:
            kept.unlink(missing_ok=True)
            raise SystemExit("the tests must pass before there are mutants")
    found: Covered = json.loads(kept.read_text())
    return found


def with_imports(root: Path, found: Covered) -> Covered:
    """Return also the files that the file of a test imports: it may use what was computed when they were imported.

    Who imports a package as a whole looks at all of its files.
    """
    imported: dict[str, set[str]] = {}
    ours = {name for entry in found.values() for name in entry["lines"]}
    for test, entry in found.items():
        file = test.split("::")[0]
        if file and file not in imported:
            nodes = [*ast.walk(ast.parse((root / file).read_text(encoding="utf-8")))]
            froms = [node for node in nodes if isinstance(node, ast.ImportFrom)]
            names = {f"{node.module}.{name}" for node in froms for name in ("", *(alias.name for alias in node.names))}
            paths = {name.removeprefix("tachometry.").strip(".").replace(".", "/") for name in names}
            whole = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
            rooms = tuple(f"{name.removeprefix('tachometry.')}/" for name in whole if name.startswith("tachometry."))
            imported[file] = {name for name in ours if name.removesuffix(".py") in paths or name.startswith(rooms)}
        for name in imported.get(file, ()):
            entry["lines"].setdefault(name, [])
    return found


def chosen_for(found: Covered, file: str, line: int, budget: float) -> list[str]:
    """Return tests that run a line or its file, as many as take `budget` seconds.

    What is computed once, by an import or by another test, is not run again where it matters. So the tests of the file
    that take next to no time come first, then the others of the line, then those of the file. Of every test function
    the fastest test is taken, then the next of each, so that all that is asked is asked soon.
    """
    running = [test for test, entry in found.items() if test and file in entry["lines"]]
    rounds: list[tuple[bool, bool, int, float, str]] = []
    met = Counter[tuple[bool, bool, str]]()
    for test in sorted(running, key=lambda test: found[test]["seconds"]):
        seconds = found[test]["seconds"]
        function = seconds > _NEXT_TO_NO_TIME, line not in found[test]["lines"][file], test.split("[")[0]
        rounds.append((*function[:2], met[function], seconds, test))
        met[function] += 1
    spent, taken = 0.0, list[str]()
    for *_, seconds, test in sorted(rounds):
        if spent + seconds <= budget or not taken:
            spent += seconds
            taken.append(test)
    return taken
