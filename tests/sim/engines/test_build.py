"""The cache of compiled cores."""

import errno
import os
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tachometry.sim import build
from tachometry.sim.build import cached, compile_library, digest, find_compiler


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TACHOMETRY_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


class Maker:
    """Writes a content, and counts how often."""

    def __init__(self, content: bytes = b"made") -> None:
        self.content = content
        self.calls = 0

    def __call__(self, folder: Path) -> Path:
        self.calls += 1
        (folder / "x").write_bytes(self.content)
        return folder / "x"


def test_a_thing_is_made_once_for_a_key(folder: Path) -> None:
    make = Maker()
    first = cached("one", ".bin", make)
    assert cached("one", ".bin", make) == first
    assert (first.read_bytes(), first.suffix, make.calls) == (b"made", ".bin", 1)
    cached("two", ".bin", make)
    assert make.calls == 2
    assert sorted(path.name for path in folder.iterdir()) == sorted(["one", "two", first.name])


@pytest.mark.parametrize("half", ["file", "no file", "index", "empty index", "index elsewhere"])
def test_what_is_not_whole_is_made_anew(half: str, folder: Path) -> None:
    make = Maker()
    target = cached("one", ".bin", make)
    index = folder / "one"
    if half == "file":
        target.write_bytes(b"ma")
    elif half == "no file":
        target.unlink()
    else:
        index.write_text({"index": index.read_text()[:20], "empty index": "", "index elsewhere": "../x"}[half])
    assert cached("one", ".bin", make).read_bytes() == b"made"
    assert make.calls == 2


def test_a_build_that_fails_leaves_nothing(folder: Path) -> None:
    with pytest.raises(OSError, match=r"cannot compile the core: .*error.*wrong"):
        cached("one", ".so", lambda inside: compile_library("wrong", inside))
    assert not list(folder.iterdir())


def test_the_cache_is_the_users_alone(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cached("one", ".bin", Maker())
    assert folder.stat().st_mode & 0o777 == 0o700
    for mode in (0o720, 0o702, 0o777):
        folder.chmod(mode)
        with pytest.raises(OSError, match=f"must be a folder of yours that nobody else can write, which {folder} is"):
            cached("one", ".bin", Maker())
    folder.chmod(0o755)
    cached("one", ".bin", Maker())
    monkeypatch.setattr("os.getuid", lambda: folder.stat().st_uid + 1)
    with pytest.raises(OSError, match="must be a folder of yours"):
        cached("one", ".bin", Maker())


def test_a_full_disk_names_the_cache(folder: Path) -> None:
    def full(_: Path) -> Path:
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match=f"^cannot write to the build cache {folder}: No space left on device$"):
        cached("one", ".bin", full)


def test_a_cache_named_from_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compilers run in folders of their own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TACHOMETRY_CACHE", "here")
    assert cached("one", ".bin", Maker()).parent == tmp_path / "here"


def test_without_a_cache_that_can_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a container with a read-only home."""
    monkeypatch.setenv("TACHOMETRY_CACHE", "/proc/cache")
    with pytest.raises(OSError, match="TACHOMETRY_CACHE must be a folder that can be written, not '/proc/cache'"):
        cached("one", ".bin", Maker())
    monkeypatch.delenv("TACHOMETRY_CACHE")
    monkeypatch.setattr("platformdirs.user_cache_path", lambda name: Path("/proc/cache"))
    make = Maker()
    assert cached("one", ".bin", make) == cached("one", ".bin", make)
    assert make.calls == 1


@pytest.mark.parametrize(
    ("compiler", "message"),
    [
        ("/nonexistent", r"CXX must name a C\+\+ compiler that exists, not '/nonexistent'"),
        ("c++ 'x", 'CXX must name a C\\+\\+ compiler that exists, not "c\\+\\+ \'x"'),
        ("true -x", "true -x made no library"),
        ("c++ -bogus", r"c\+\+ -bogus cannot compile the core: .*bogus"),
    ],
)
def test_compilers_that_are_none(compiler: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CXX", compiler)
    with pytest.raises(OSError, match=message):
        compile_library("int x;", tmp_path)


@pytest.mark.parametrize(
    ("version", "without"),
    [
        ("g++ (Debian 12.2.0-14) 12.2.0\nFree Software Foundation", True),
        ("g++ (GCC) 11.1.0\nFree Software Foundation", True),
        ("c++ (GCC) 10.2.1\nFree Software Foundation", False),
        ("clang version 19.1.7", False),
    ],
)
def test_a_pass_that_drops_inputs_is_off(version: str, without: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "version", lambda command: version)
    assert ("-fno-ipa-modref" in build.flags()) == without


def test_builds_at_the_same_time(folder: Path) -> None:
    """Each is given a whole file, whoever is first, and other processes find it."""
    together = threading.Barrier(4, timeout=60)  # one that fails must not leave the others waiting

    def work(k: int) -> bytes:
        def make(inside: Path) -> Path:
            together.wait()
            (inside / "x").write_bytes(b"made by %d" % k * 100_000)
            return inside / "x"

        return cached("one", ".bin", make).read_bytes()

    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(work, range(4)))
    assert sorted(found) == [b"made by %d" % k * 100_000 for k in range(4)]
    make = Maker()
    assert cached("one", ".bin", make).read_bytes() in found
    assert make.calls == 0


def test_processes_that_build_one_library_at_the_same_time(folder: Path) -> None:
    program = """
import ctypes
from tachometry.sim.build import cached, compile_library
text = 'extern "C" __attribute__((visibility("default"))) int seven() { return 7; }'
assert ctypes.CDLL(str(cached("seven", ".so", lambda inside: compile_library(text, inside)))).seven() == 7
"""
    runs = [subprocess.Popen([sys.executable, "-c", program]) for _ in range(2)]
    assert [run.wait(300) for run in runs] == [0, 0]
    assert not list(folder.glob(".tachometry-*"))
    # A run of which only half a library was left makes it anew.
    for library in folder.glob("*.so"):
        library.write_bytes(library.read_bytes()[:1000])
    assert subprocess.run([sys.executable, "-c", program], timeout=300).returncode == 0


def test_what_was_not_used_for_longest_goes_first(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "_KEPT", 6)
    make = {name: Maker(name.encode()) for name in "abcd"}
    for age, name in enumerate("dcb"):
        target = cached(name, ".bin", make[name])
        then = time.time() - 1000 + 100 * age
        for path in (target, folder / name):
            os.utime(path, (then, then))
    (abandoned := folder / ".tachometry-x.tmp").mkdir()
    cached("d", ".bin", make["d"])  # used again
    monkeypatch.setattr(build, "_KEPT", 4)
    cached("a", ".bin", make["a"])
    assert not abandoned.exists()
    for name in "da":
        cached(name, ".bin", make[name])
    assert [make[name].calls for name in "abcd"] == [1, 1, 1, 1]
    cached("c", ".bin", make["c"])
    assert make["c"].calls == 2


def test_the_cache_is_bounded_by_bytes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "_KEPT_BYTES", 5000)
    for name in "abcdef":
        kept = cached(name, ".bin", Maker(name.encode() * 2000))
    assert kept.exists()
    assert sum(path.stat().st_size for path in folder.iterdir()) <= 5000


def test_a_library_that_does_not_load_is_made_anew() -> None:
    make = Maker(b"no library")
    assert cached("one", ".so", make) == cached("one", ".so", make)
    assert make.calls == 2


def test_a_compiler_that_writes_garbage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cc").write_text("#!/bin/sh\n[ $1 = --version ] || echo garbage > model.so\n")
    (tmp_path / "cc").chmod(0o755)
    monkeypatch.setenv("CXX", str(tmp_path / "cc"))
    with pytest.raises(OSError, match=r"/cc made no library of the core$"):
        compile_library("int x;", tmp_path)
    monkeypatch.chdir(tmp_path)  # a path from here, although it runs elsewhere
    monkeypatch.setenv("CXX", "./cc")
    assert find_compiler() == (str(tmp_path / "cc"),)


def test_a_tool_that_makes_nothing(folder: Path) -> None:
    with pytest.raises(OSError, match=r"^there is no header.gch, although what makes it reports no error$"):
        cached("one", ".gch", lambda inside: inside / "header.gch")
    assert not list(folder.iterdir())


def test_any_difference_gives_another_name() -> None:
    assert len({digest("a", "bc"), digest("ab", "c"), digest("abc"), digest(("a", "bc"))}) == 4
