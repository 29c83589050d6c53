"""A table of command lines and files that are wrong or hostile: each is refused in a line, and leaves nothing behind.

All rows run in one process, a child of this one, with limits of memory and time: a row that needs more, or that ends
the process, fails.
"""

import contextlib
import gzip
import io
import json
import os
import random
import resource
import select
import shlex
import signal
import sys
import zipfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from support.captures import make_sr
from support.command import without
from support.nightly import only

from tachometry.cli.main import main

_NOISE = random.Random(1).randbytes(5000)
_MOTION = "time,angle_rad\n"
_CAPTURE = "time,a,b\n"
_LOG = "time [ms],n\n0,0\n5,9\n"
_VARIABLES = '$var wire 1 ! a $end\n$var wire 1 "! b $end\n$var wire 1 " c $end\n'
_HEAD = f"$timescale 1 us $end\n{_VARIABLES}$enddefinitions $end\n"
_BEGIN = '#0\n0!\n0"!\n0"\n#1000\n1!\n'

_TEXTS = {
    "huge-angle.csv": _MOTION + "0,0\n1,1e300\n",
    "huge-time.csv": _MOTION + "0,0\n1e300,1\n",
    "tiny-time.csv": _MOTION + "0,0\n1e-300,1\n1,2\n",
    "negative-time.csv": _MOTION + "-1e308,0\n1e308,1\n",
    "steep.csv": _MOTION + "0,0\n1e-29,1e29\n1,1e29\n",
    "far.csv": _MOTION + "0,1e15\n1,1e15\n",
    "backwards.csv": _MOTION + "0,0\n2,1\n1,1\n",
    "nan.csv": _MOTION + "0,0\n1,nan\n",
    "quoted.csv": _MOTION + '0,0\n"1","1"\n',
    "control.csv": _MOTION + "0,0\n1,\x1b]0;title\x07\x9b31m\n",
    "one-row.csv": _MOTION + "0,0\n",
    "good.csv": _CAPTURE + "0,0,0\n0.0001,1,0\n0.0002,1,1\n0.0005,1,1\n",
    "slow.csv": _CAPTURE + "0,0,0\n0.5,1,0\n1.0,1,1\n1.5,0,1\n",
    "whole.csv": _CAPTURE + "0,0,0\n1,1,0\n2,1,1\n3,0,1\n",
    "overflow.csv": _CAPTURE + "-1e308,0,0\n1e308,1,0\n",
    "late.csv": _CAPTURE + "0,0,0\n1e29,1,0\n",
    "nan-time.csv": _CAPTURE + "0,0,0\nnan,1,0\n",
    "backwards-time.csv": _CAPTURE + "1,0,0\n0,1,0\n",
    "level.csv": _CAPTURE + "0,0,0\n1,1e300,0\n",
    "fields.csv": _CAPTURE + "0,0,0\n1" + "," * 100_000 + "\n",
    "control-names.csv": "time,\x1b[31ma,\x9b2Jb\n0,0,0\n1,1\x1b[31m,0\n",
    "no-time.csv": "a,b\n0,0\n1,0\n",
    "quotes.csv": 'time,"a,b"\n0,0\n',
    "comments.csv": "; only\n# comments\n" * 50_000,
    "unit.csv": "Time [fortnights],Channel 0,Channel 1\n0,0,0\n1,1,0\n",
    "same-names.csv": "time,a,a\n0,0,0\n",
    "cut-time.vcd": _HEAD + _BEGIN + "#200",
    "cut-value.vcd": _HEAD + _BEGIN + "#2000\n1",
    "cut-variable.vcd": _HEAD + _BEGIN + '#2000\n1"',
    "vector.vcd": _HEAD + _BEGIN + "#2000\nb10 !\n",
    "undefined.vcd": _HEAD + "#2000\nx!\n",
    "no-scale.vcd": f"{_VARIABLES}$enddefinitions $end\n{_BEGIN}",
    "late.vcd": _HEAD + _BEGIN + f"#1{'0' * 19}\n0!\n",
    "long-time.vcd": _HEAD + _BEGIN + f"#{'9' * 5000}\n0!\n",
    "endless.vcd": f"$comment {'x' * (9 << 20)}\n",
    "scopes.vcd": "$scope module m $end\n" * 5000 + _HEAD,
    "log.csv": _LOG + "10,20\n",
    "cut-log.csv": _LOG + "10,2",
    "nan-log.csv": _LOG.replace("9", "nan"),
    "far-log.csv": _LOG + f"10,{1 << 53}\n15,-{1 << 53}\n",
    "late-log.csv": _LOG + "1e29,10\n",
    "deep.toml": "ppr = " + "[" * 100_000,
    "deep-table.toml": "ppr = " + "{a = " * 5_000,
    "good.toml": 'ppr = 100\nclock = "1MHz"\nmax-time = "20ms"\nmotion = "constant:{speed}:100ms"\n'
    '[vary]\nspeed = ["5rad/s", "50rad/s"]\ntick = ["100us", "1ms"]\n',
    "broken.toml": "ppr = \n",
    "unknown-key.toml": "revolutions = 9\n",
    "list.toml": "ppr = [9, 10]\n",
    "nested-list.toml": "ppr = 9\n[vary]\ntick = [[1]]\n",
    "many.toml": 'ppr = 9\nmotion = "stop:1ms"\n[vary]\n'
    'seed = "1..101:101"\njitter = "0..0.1:101"\nlost = "0..0.1:101"\n',
    "control.toml": '"\\u001b[31m" = 9\n',
    "date.toml": "ppr = 9\ntick = 1979-05-27\n",
}


def _cut(path: Path, keep: float) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * keep)])


def make_files(folder: Path) -> None:
    """Put all of them into a folder."""
    (folder / "folder").mkdir()
    for name, text in _TEXTS.items():
        (folder / name).write_text(text, encoding="utf-8")
    for name in ("empty", "empty.csv", "empty.sr", "empty.vcd", "empty.fst"):
        (folder / name).touch()
    for name in ("noise", "noise.csv", "noise.sr", "noise.vcd", "noise.fst", "noise.parquet", "binary.toml"):
        (folder / name).write_bytes(_NOISE)
    (folder / "board").mkdir()
    (folder / "board" / "x.bin").touch()
    zeros = ("csv", "toml", "sr", "vcd", "txt", "csv.gz", "json", "parquet")
    for name in (*(f"zero.{suffix}" for suffix in zeros), "board/x.json"):
        (folder / name).symlink_to("/dev/zero")
    (folder / "endless.csv").write_text("time,a,b\n" + "0" * (9 << 20), encoding="ascii")
    (folder / "endless.csv.gz").write_bytes(gzip.compress((folder / "endless.csv").read_bytes()))
    make_sr(folder / "blanks.sr", [bytes(4)], comment="x" + " " * 900_000 + "y", probe9="X")
    (folder / "utf16.csv").write_text(_MOTION + "0,0\n1,1\n", encoding="utf-16")

    levels = bytes([0, 1, 3, 2] * 100)
    make_sr(folder / "good.sr", [levels])
    make_sr(folder / "cut.sr", [levels])
    _cut(folder / "cut.sr", 0.7)
    with zipfile.ZipFile(folder / "no-metadata.sr", "w") as archive:
        archive.writestr("version", "2")
    make_sr(folder / "metadata-bomb.sr", [levels], comment="x" * (32 << 20))
    make_sr(folder / "edges-bomb.sr", [bytes([0, 1]) * (8 << 20)] * 2)
    make_sr(folder / "quiet-bomb.sr", [bytes(16 << 20)] * 2, samplerate="1 Hz")
    make_sr(folder / "rate.sr", [levels], samplerate="9" * 400)
    make_sr(folder / "slow.sr", [levels], samplerate="0.000000001")
    make_sr(folder / "probe.sr", [levels], {1: "A", 999: "B"})
    make_sr(folder / "unit.sr", [levels], unitsize="9")
    with zipfile.ZipFile(make_sr(folder / "members-bomb.sr", [levels]), "a") as archive:
        for number in range(260):
            member = zipfile.ZipInfo(f"m{number}")
            member.comment = bytes(65_535)  # in the list of members only
            archive.writestr(member, "")
    content = bytearray(make_sr(folder / "encrypted.sr", levels).read_bytes())
    for magic, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        at = -1
        while (at := content.find(magic, at + 1)) >= 0:
            content[at + flags] |= 1
    (folder / "encrypted.sr").write_bytes(content)


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
COMMANDS = (*BEFORE, "calibrate", "verify", "build", "program", "monitor", "explore")

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
        if "--method " in options:  # others have --methods
            starts = [start for start in starts if start.split()[0] not in ("compare", "sweep")]
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
    """Return the fault in the outcome of a row; `before` are the contents of the folder."""
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
