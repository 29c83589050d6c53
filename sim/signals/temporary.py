"""Temporary folders and tools end with the process that has them, whatever ends it."""

import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

if sys.platform != "win32":
    import fcntl
if sys.platform == "linux":  # a browser has none
    import resource

_running: set["subprocess.Popen[str]"] = set()
# What ends a command in order. A terminal that is closed says so by SIGHUP, where there is this signal.
STOPS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
PREFIX, _SUFFIX = ".tachometry-", ".tmp"
_LONGEST = 4 * 3600.0  # seconds of a tool, of which none takes an hour on a slow computer
_ABANDONED = 24 * 3600.0  # seconds after which a folder is nobody's, where there are no locks


@contextmanager
def held_back() -> Iterator[None]:
    """Do what must not be interrupted: signals that stop a command are heard at its end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {}
    try:
        for number in STOPS:
            if callable(handler := signal.getsignal(number)):
                before[number] = handler
                signal.signal(number, lambda number, frame: came.append(number))
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number in came[:1]:
            signal.raise_signal(number)


@contextmanager
def scratch(parent: Path | None = None) -> Iterator[Path]:
    """Give a folder that is removed at the end, in `parent` or among the temporary files of the system.

    What killed processes have left there is removed, too.
    """
    parent = Path(tempfile.gettempdir()) if parent is None else parent
    claimed: list[Claim] = []
    try:
        with held_back():
            for _ in stale(parent):
                pass
            claimed.append(Claim(parent))
        yield claimed[0].folder
    finally:
        with held_back():
            for claim in claimed:
                claim.remove()


class Claim:
    """Makes a temporary folder in `parent`, which others leave alone for as long as this process lives."""

    def __init__(self, parent: Path) -> None:
        while True:
            self.folder = Path(tempfile.mkdtemp(prefix=PREFIX, suffix=_SUFFIX, dir=parent))
            self._lock = None
            with suppress(FileNotFoundError):
                self._lock = _lock(self.folder, wait=True)
            if self.folder.exists():
                return
            if self._lock is not None:  # another process or thread has just taken it for one that was left
                os.close(self._lock)

    def remove(self) -> None:
        """Remove the folder with all that is in it."""
        shutil.rmtree(self.folder, ignore_errors=True)
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def stale(parent: Path) -> Iterator[Path]:
    """Yield temporary folders that killed processes of this user have left, and remove each afterwards."""
    for folder in parent.glob(f"{PREFIX}*{_SUFFIX}"):
        try:
            status = folder.lstat()
            if sys.platform != "win32" and status.st_uid != os.getuid():
                continue
            lock = _lock(folder, wait=False)
        except OSError:
            continue
        if lock is None and (sys.platform != "win32" or time.time() - status.st_mtime < _ABANDONED):
            continue
        yield folder
        shutil.rmtree(folder, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def _lock(folder: Path, *, wait: bool) -> int | None:
    """Return a descriptor that locks a directory; None if it is locked, or cannot be."""
    if sys.platform == "win32":
        return None
    descriptor = os.open(folder, os.O_RDONLY | os.O_NOFOLLOW | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a directory, which other processes wait for; where it cannot be locked, they do not."""
    descriptor = None
    with suppress(OSError):
        descriptor = _lock(folder, wait=True)
    try:
        yield
    finally:
        if descriptor is not None:
            os.close(descriptor)


@contextmanager
def running(
    command: Sequence[str],
    folder: Path | None = None,
    seconds: float | None = None,
    memory: int | None = None,
    variables: Mapping[str, str] | None = None,
    errors: int | IO[bytes] = subprocess.PIPE,
) -> Iterator["subprocess.Popen[str]"]:
    """Give a tool that runs, with its streams, which ends with all of its processes, whatever ends the wait for it.

    Its temporary files are in `folder`, in which it runs, if that is given. A signal from the terminal does not reach
    it. It has at most `memory` bytes, by default those of the computer, where Linux keeps it to them, and these
    environment variables in addition to those of this process.

    It raises OSError if it cannot be run; subprocess.TimeoutExpired if it takes more than `seconds` of the processor,
    where Linux counts them.
    """
    ours = {} if folder is None else dict.fromkeys(("TMPDIR", "TMP", "TEMP"), str(folder))
    started: list[subprocess.Popen[str]] = []
    try:
        with held_back():
            env, pipe = {**os.environ, **ours, **(variables or {})}, subprocess.PIPE
            process = subprocess.Popen(
                command, cwd=folder, env=env, stdin=pipe, stdout=pipe, stderr=errors, process_group=0,
                encoding="utf-8", errors="replace",  # whatever the locale is
            )  # fmt: skip
            started.append(process)
        _running.update(started)
        _limit(process.pid, memory, seconds)
        yield process
        process.wait()
        if sys.platform == "linux" and process.returncode == -signal.SIGXCPU:
            raise subprocess.TimeoutExpired(command, seconds or _LONGEST)
    finally:
        with held_back():
            for process in started:
                _end(process)
        _running.difference_update(started)


def run_tool(
    command: Sequence[str],
    folder: Path | None = None,
    text: str = "",
    seconds: float | None = None,
    memory: int | None = None,
    variables: Mapping[str, str] | None = None,
) -> "subprocess.CompletedProcess[str]":
    """Run a tool, see `running`, with a text as its input.

    It also raises subprocess.TimeoutExpired if it takes four hours; without Linux, if it takes `seconds`.
    """
    with running(command, folder, seconds, memory, variables) as process:
        out, err = process.communicate(text, _LONGEST if sys.platform == "linux" else seconds or _LONGEST)
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def _limit(pid: int, memory: int | None, seconds: float | None) -> None:
    if sys.platform == "linux":
        most = memory or os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        limits = {resource.RLIMIT_DATA: most, resource.RLIMIT_CPU: math.ceil(seconds or _LONGEST)}
        for limit, wanted in limits.items():
            with suppress(OSError):  # it has ended
                _, hard = resource.prlimit(pid, limit)
                resource.prlimit(pid, limit, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard))


def end_tools() -> None:
    """Kill all tools that run in other threads of this process, which see them fail."""
    for process in [*_running]:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL) if sys.platform != "win32" else process.kill()


def _end(process: "subprocess.Popen[str]") -> None:
    """Kill a tool with all that it has started."""
    with process:  # which closes its streams, and waits
        if sys.platform == "win32":
            process.kill()
        elif process.returncode is None:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
