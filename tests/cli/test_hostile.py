"""A table of command lines and files that are wrong or hostile: each is refused in a line, and leaves nothing behind.

All rows run in one process, a child of this one, with limits of memory and time: a row that needs more, or that ends
the process, fails.
"""

import contextlib
import io
import json
import os
import resource
import select
import shlex
import signal
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from support.command import without
from support.hostile import make_files
from support.nightly import only

from tachometry.cli.main import main

TABLE = Path(__file__).with_name("hostile.txt")
CORE = "--ppr 9 --clock 1MHz --tick 10us --max-time 100us"
# What the options of a group are put behind.
BEFORE = {
    "plan": f"plan {CORE}",
    "generate": f"generate {CORE} -o out",
    "simulate": f"simulate {CORE} --motion stop:1ms --engine pysim",
    "replay": f"replay good.csv {CORE} --engine pysim",
    "compare": f"compare {CORE} --motion stop:1ms",
    "sweep": f"sweep {CORE} --motion stop:1ms --methods s",
    "loop": f"loop {CORE} --motion stop:80ms --from 40ms",
}
COMMANDS = (*BEFORE, "verify", "build", "program", "monitor", "explore")

_MEMORY = 1 << 30  # bytes beyond those of a process that has everything imported
_PROCESSOR = 900  # seconds
_PATIENCE = 120.0  # seconds without a word


class Row(NamedTuple):
    """A command line, and a part of what it must say."""

    line: str
    message: str


def table() -> dict[str, list[Row]]:
    """Return the rows by group: `[plan, generate]` has options for several commands, `[= plan]` whole command lines."""
    groups: dict[str, list[Row]] = {}
    before: list[str] = []
    group = ""
    for line in TABLE.read_text(encoding="utf-8").splitlines():
        if not line or line.startswith("#"):
            continue
        if line.startswith("["):
            group = line.strip("[]")
            names = group.split(", ")
            before = [group.removeprefix("=").strip()] if group.startswith("=") else [BEFORE[name] for name in names]
            groups[group] = []
            continue
        options, _, message = line.partition(" => ")
        starts = [" ".join(without(start.replace("CORE", CORE).split(), options.split())) for start in before]
        groups[group] += [Row(f"{start} {options}".replace("CORE", CORE).strip(), message) for start in starts]
    return groups


ROWS = table()


def test_the_table_has_rows_for_every_command() -> None:
    rows = [row for group in ROWS.values() for row in group]
    assert len(set(rows)) == len(rows) >= 300
    of_command = Counter((shlex.split(row.line) or [""])[0] for row in rows)
    assert min(of_command[command] for command in COMMANDS) >= 10
    assert all(row.message for row in rows)


def contents(folder: Path) -> dict[str, tuple[int, int]]:
    return {str(path.relative_to(folder)): (path.stat().st_size, path.stat().st_mtime_ns) for path in folder.rglob("*")}


def outcome(line: str) -> tuple[int, str, str]:
    """Return status, stdout and stderr of a command line."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2))
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = out, err
    try:
        main(shlex.split(line))
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else -1
    finally:
        sys.stdout, sys.stderr = before
    for stream in (out, err):
        stream.flush()
    return code, out.buffer.getvalue().decode(), err.buffer.getvalue().decode()


def wrong(row: Row, folder: Path, before: dict[str, tuple[int, int]]) -> str | None:
    """Return what is wrong with what a row does; `before` are the contents of the folder."""
    code, out, err = outcome(row.line)
    told = err.removesuffix("\n")
    if (code, out) != (2, "") or not told.startswith("tachometry: error: ") or not told.isprintable():
        return f"status {code}, {out[-300:]!r}, {err[-600:]!r}"
    if row.message not in told or len(told) > 3000:
        return f"must say {row.message!r}, not {told!r}"
    after = contents(folder)
    return None if after == before else f"leaves {set(after) ^ set(before) or 'other contents'}"


def limit() -> None:
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + _MEMORY, used + _MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (_PROCESSOR, _PROCESSOR))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


@contextlib.contextmanager
def in_a_child(rows: list[Row], folder: Path) -> Iterator[int]:
    """Yield a process that writes what it finds of each row as a line; the descriptor to read it from."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.chdir(folder)
            limit()
            before = contents(folder)
            for row in rows:
                os.write(write, json.dumps(wrong(row, folder, before)).encode() + b"\n")
        finally:
            os._exit(0)
    os.close(write)
    try:
        yield read
    finally:
        os.close(read)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="/proc tells how much memory is used")
# Commands of one group share an option; the first of them has each row.
@pytest.mark.parametrize("whole", only([False], [False, True]))
def test_rows_are_refused_in_a_line_and_leave_nothing(whole: bool, tmp_path: Path) -> None:
    make_files(tmp_path)
    rows = [row for group, every in ROWS.items() for row in every[:: 1 if whole else group.count(",") + 1]]
    found = b""
    with in_a_child(rows, tmp_path) as read:
        while select.select([read], [], [], _PATIENCE)[0] and (data := os.read(read, 1 << 16)):
            found += data
    results: list[str | None] = [json.loads(line) for line in found.splitlines()]
    if len(results) < len(rows):
        results.append("takes too much time or memory, or ends the process")
    failed = [f"tachometry {row.line}\n    {result}" for row, result in zip(rows, results, strict=False) if result]
    assert not failed, "\n".join(failed)
