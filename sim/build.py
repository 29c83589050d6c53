"""Runs the C++ compiler, and keeps what it made in a cache."""

import atexit
import ctypes
import functools
import hashlib
import importlib.util
import json
import os
import re
import shlex
import shutil
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import platformdirs

from tachometry.sim.signals.progress import at_work
from tachometry.sim.signals.temporary import run_tool, scratch
from tachometry.spec.language.tools import complaint

_FLAGS = ("-std=c++17", "-O2", "-w", "-fPIC", "-fvisibility=hidden", "-pthread")

_KEPT, _KEPT_BYTES = 1000, 1 << 30  # files, and their bytes; each compiled header has 50 to 70 MB


class NoCompiler(OSError):
    """There is no C++ compiler."""


def find_compiler() -> tuple[str, ...] | None:
    """Return the compiler that `CXX` names, or the system's, or that of the package ziglang; None if there is none.

    It raises NoCompiler if there is none by the name of `CXX`.
    """
    if given := os.environ.get("CXX", "").strip():
        try:
            words = shlex.split(given)
        except ValueError:  # an open quotation
            words = [given]
        if not shutil.which(words[0]):
            raise NoCompiler(f"CXX must name a C++ compiler that exists, not {given!r}")
        if os.path.dirname(words[0]):  # it runs in other folders
            words[0] = os.path.abspath(words[0])
        return tuple(words)
    for name in ("c++", "g++", "clang++"):
        if shutil.which(name):
            return (name,)
    return (sys.executable, "-m", "ziglang", "c++") if importlib.util.find_spec("ziglang") else None


def compiler() -> tuple[str, ...]:
    """Return the compiler that `find_compiler` finds; NoCompiler if there is none."""
    found = find_compiler()
    if found is None:
        raise NoCompiler(
            "there is no C++ compiler: install g++ or clang, or pip install 'tachometry[compiler]', or take pysim"
        )
    return found


@functools.cache
def version(command: tuple[str, ...]) -> str:
    """Return what a compiler says that it is."""
    return run_tool([*command, "--version"]).stdout


def flags() -> tuple[str, ...]:
    """Return options with which every engine is compiled."""
    found = re.search(r" (\d+)\.\d+", version(compiler()).partition("\n")[0])
    has_pass = _is_gcc() and found is not None and int(found[1]) >= 11
    # With this pass g++ 12 was seen to drop inputs that are set before CXXRTL's eval(). Engines are as fast without it.
    return (*_FLAGS, "-fno-ipa-modref") if has_pass else _FLAGS


def _is_gcc() -> bool:
    return "Free Software Foundation" in version(compiler())


def run(
    command: Sequence[str | Path],
    what: str,
    folder: Path | None = None,
    text: str = "",
    variables: Mapping[str, str] | None = None,
) -> str:
    """Run a tool on an input, with these environment variables in addition; return its output.

    It raises OSError if it fails, with the line that says why.
    """
    done = run_tool(list(map(str, command)), folder, text, variables=variables)
    if done.returncode:
        raise OSError(f"{what}: {complaint(done.stderr + done.stdout) or f'exit status {done.returncode}'}")
    return done.stdout


def digest(*parts: object) -> str:
    """Return a name for some content: different content has another name."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def precompiled(folder: Path, name: str, *more: str) -> list[str]:
    """Return options with which g++, and only that, takes a header that it has compiled before: half the time of a
    small core.

    `folder` is one of include files; what is compiled with these options needs the same ones, `more`.
    """
    header = folder / name
    command = compiler()
    if not _is_gcc():
        return []

    def make(building: Path) -> Path:
        made = building / "header.gch"
        run(
            [*command, *flags(), *more, "-x", "c++-header", f"-I{folder}", "-o", made, header],
            f"{' '.join(command)} cannot compile {name}",
        )
        return made

    made = cached(digest(header.read_text(), version(command), command, flags(), more), ".gch", make)
    return ["-include", str(made.with_suffix(""))]


def compile_library(source: str, folder: Path, *more: str | Path) -> Path:
    """Return a shared library of a C++ text, in `folder`; `more` are options, and files to be compiled with it."""
    (folder / "model.cc").write_text(source, encoding="utf-8")
    command = [*compiler(), *flags(), "-shared", "-o", "model.so", "model.cc", *more]
    run(command, f"{' '.join(compiler())} cannot compile the core", folder)
    try:
        ctypes.CDLL(str(folder / "model.so"))
    except OSError:  # it is not there, or something else
        raise OSError(f"{' '.join(compiler())} made no library of the core") from None
    return folder / "model.so"


@functools.cache
def _own_folder() -> Path:
    stack = ExitStack()
    atexit.register(stack.close)
    return stack.enter_context(scratch())


def cache_folder() -> Path:
    """Return where builds are kept: the environment variable TACHOMETRY_CACHE, or the user's cache; it is made if need
    be.

    Where there is none that can be written, a folder that ends with this process. It has code that this process runs:
    it must be the user's, and nobody else may write to it. It raises OSError if TACHOMETRY_CACHE names one that cannot
    be written; if another user owns the folder, or can write to it.
    """
    given = os.environ.get("TACHOMETRY_CACHE")
    folder = Path(given).absolute() if given else platformdirs.user_cache_path("tachometry")
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        writable = os.access(folder, os.W_OK | os.X_OK)
        status = folder.stat()
    except OSError:
        writable = False
    if writable:
        if os.name == "posix" and (status.st_uid != os.getuid() or status.st_mode & 0o022):
            raise OSError(
                f"the build cache must be a folder of yours that nobody else can write, which {folder} is not: "
                "chmod go-w, or set TACHOMETRY_CACHE to another"
            )
        return folder
    if given:
        raise OSError(f"TACHOMETRY_CACHE must be a folder that can be written, not {given!r}")
    return _own_folder()


def cached(key: str, suffix: str, make: Callable[[Path], Path]) -> Path:
    """Return the file that `make` makes in a folder that it is given, or the one that it made before for the same key.

    A file is named by its own content, and renamed into the cache when it is whole; a file `key` says which it is. So
    builds of one thing at the same time do no harm, and a file that is not whole is made anew.

    - `key`: Digest of all that decides what `make` makes.
    """
    folder = cache_folder()
    if (found := _intact(folder, key)) is not None:
        return found
    work = "computing" if suffix == ".json" else "compiling"
    try:
        with scratch(folder) as building, at_work(f"{work}, once for this core and this computer"):
            made = make(building)
            if not made.is_file():
                raise OSError(f"there is no {made.name}, although what makes it reports no error")
            target = folder / f"{hashlib.sha256(made.read_bytes()).hexdigest()}{suffix}"
            made.replace(target)
            index = building / "index"
            index.write_text(target.name, encoding="ascii")
            index.replace(folder / key)
            _prune(folder)
    except OSError as error:
        if error.errno is None or error.filename is not None:
            raise
        raise OSError(f"cannot write to the build cache {folder}: {error.strerror}") from error
    return target


def cached_value(key: str, make: Callable[[Path], Any]) -> Any:
    """Return a value of JSON, as `cached` does a file; `make` returns it, given a folder to work in."""

    def write(folder: Path) -> Path:
        made = folder / "value"
        made.write_text(json.dumps(make(folder)), encoding="utf-8")
        return made

    return json.loads(cached(key, ".json", write).read_text(encoding="utf-8"))


def _intact(folder: Path, key: str) -> Path | None:
    """Return the file of a key, if it is there and whole; a library must load."""
    try:
        name = (folder / key).read_text(errors="replace")
        if not re.fullmatch(r"[0-9a-f]{64}\.\w+", name):
            return None
        target = folder / name
        whole = hashlib.sha256(target.read_bytes()).hexdigest() == target.stem
        if whole:
            if target.suffix == ".so":
                ctypes.CDLL(str(target))
            os.utime(target)
            os.utime(folder / key)
    except OSError:
        return None
    return target if whole else None


def _prune(folder: Path) -> None:
    """Remove what has not been used for longest."""
    aged = []
    for path in folder.iterdir():
        try:
            status = path.stat()
            age = time.time() - status.st_mtime
        except OSError:  # another run has removed it
            continue
        if path.is_file():
            aged.append((age, path, status.st_size))
    n_bytes = 0
    for number, (_, path, size) in enumerate(sorted(aged)):
        n_bytes += size
        if number >= _KEPT or n_bytes > _KEPT_BYTES:
            path.unlink(missing_ok=True)
