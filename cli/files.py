"""Outputs appear whole and all together, or not at all; caches have a folder that can be written."""

import errno
import itertools
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from tachometry.sim.signals.temporary import Claim, held_back, locked, scratch, stale

# What the system says of a disk that takes no more.
DISK = frozenset((errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO))
_NEW, _OLD = "new", "old"


class Outputs:
    """Holds the files that a command writes, as a context manager.

    Every file is written under its own name into a temporary directory beside its target. When the block has
    succeeded all are renamed onto their targets, existing files included; after an error or Ctrl-C nothing is left:
    no temporary, no directory that was made for a target, and every target is as it was before. What a process that
    was killed has left is removed by the next one that writes to the same place.

    - `targets`: Where each output goes; None: it is not wanted. The keys are what messages call it, such as `--plot`.
    - `inputs`: Files that the command reads; no target may be one of them.

    It raises ValueError if two targets are one file, or one is an input or no regular file; OSError on entering and
    leaving, if a target cannot be written; also for a full disk in the block, with the target.
    """

    def __init__(self, targets: Mapping[str, Path | None], inputs: Iterable[Path] = ()) -> None:
        self._targets = {what: _real(path) for what, path in targets.items() if path is not None}
        self._made: list[Path] = []
        self._staging: dict[Path, Claim] = {}
        self._current: Path | None = None
        self._inputs = {_real(path) for path in inputs}
        self._check()

    def __getitem__(self, what: str) -> Path:
        """Where to write the output `what` for now."""
        self._current = target = self._targets[what]
        return self._staging[target.parent].folder / _NEW / target.name

    def get(self, what: str) -> Path | None:
        """Return where to write the output `what` for now, or None if it is not wanted."""
        return self[what] if what in self._targets else None

    def __enter__(self) -> Self:
        try:
            self._stage()
        except BaseException:
            self._discard()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if error is not None:
            self._discard()
            self._name_the_target(error)
            return
        with held_back():
            try:
                with ExitStack() as locks:
                    for parent in sorted(self._staging):  # one process at a time puts files there
                        locks.enter_context(locked(parent))
                    self._commit()
            except BaseException:
                self._discard()
                raise
            self._remove_staging()

    def add(self, targets: Mapping[str, Path]) -> None:
        """Take more targets, whose names follow only from what is written; errors are those of the others."""
        self._targets |= {what: _real(path) for what, path in targets.items()}
        self._check()
        self._stage()

    def keep(self, what: str, part: Path) -> Path:
        """Put a part of the output `what` beside its target, which stays as it was; its path, at which nothing was."""
        target = self._targets.pop(what)
        names = (f"{target.stem}.part{number or ''}{part.suffix}" for number in itertools.count())
        kept = next(path for path in map(target.with_name, names) if not path.exists())
        part.replace(kept)
        return kept

    def keep_all(self) -> list[Path]:
        """Put a part of every output beside its target, but a save file, which names the whole waveform."""
        with held_back():
            parts = {what: self[what] for what in [*self._targets]}
            kept = [self.keep(what, part) for what, part in parts.items() if part.suffix != ".gtkw"]
            self._targets.clear()
            return kept

    def _check(self) -> None:
        taken: dict[str, str] = {}
        for what, target in self._targets.items():
            other = taken.setdefault(os.path.normcase(target), what)
            if other != what:
                raise ValueError(f"{other} and {what} must be different files, not both {target}")
            if target in self._inputs:
                raise ValueError(f"{what} must be another file than the input {target}")
            if target.exists() and not target.is_file():
                raise ValueError(f"{what} must be a file, which {target} is not")

    def _stage(self) -> None:
        for target in self._targets.values():
            parent = target.parent
            if parent in self._staging:
                continue
            try:
                with held_back():
                    missing = [directory for directory in (parent, *parent.parents) if not directory.exists()]
                    for directory in reversed(missing):
                        with suppress(FileExistsError):  # another process has just made it
                            directory.mkdir()
                            self._made.append(directory)
                    _clear_stale(parent)
                    self._staging[parent] = Claim(parent)
                for name in (_NEW, _OLD):
                    (self._staging[parent].folder / name).mkdir()
            except OSError as error:
                raise _unwritable(target, error) from error

    def _commit(self) -> None:
        """Rename every file onto its target, or none."""
        begun: list[tuple[Path, Path | None]] = []
        try:
            for what, target in self._targets.items():
                old = self._staging[target.parent].folder / _OLD / target.name if target.exists() else None
                begun.append((target, old))
                try:
                    if old is not None:
                        target.replace(old)
                    self[what].replace(target)
                except OSError as error:
                    raise _unwritable(target, error) from error
        except BaseException:
            for target, old in reversed(begun):
                if old is None:
                    target.unlink(missing_ok=True)
                elif old.exists():
                    old.replace(target)
            raise

    def _discard(self) -> None:
        with held_back():
            self._remove_staging()
            for directory in reversed(self._made):
                with suppress(OSError):  # others use it
                    directory.rmdir()

    def _remove_staging(self) -> None:
        for claim in self._staging.values():
            claim.remove()

    def _name_the_target(self, error: BaseException) -> None:
        """Raise what the system says of a file here with the name of its target."""
        of_system = error if isinstance(error, OSError) else error.__cause__
        if not isinstance(of_system, OSError):
            return
        staged = Path(os.fsdecode(of_system.filename or ""))
        for parent, claim in self._staging.items():
            if staged.is_relative_to(claim.folder):
                raise _unwritable(parent / staged.name, of_system) from error
        # A write knows no name: it is of the output that was asked for last.
        if of_system.filename is None and of_system.errno in DISK and self._current is not None:
            raise _unwritable(self._current, of_system) from error


def _clear_stale(parent: Path) -> None:
    """Remove what killed processes have left in a directory; files that they had put aside go back to their places."""
    for folder in stale(parent):
        for old in (folder / _OLD).glob("*"):
            if not (parent / old.name).exists():
                old.replace(parent / old.name)


def _real(path: Path) -> Path:
    """Return the same file by its only name; a link is a file of its own, which a rename replaces."""
    if path.name in ("", ".."):  # a directory, by no name of its own
        return Path(os.path.realpath(path))
    return Path(os.path.realpath(path.parent)) / path.name


def _unwritable(target: Path, error: OSError) -> OSError:
    return OSError(f"cannot write {target}: {error.strerror or error}")


@contextmanager
def writable_caches() -> Iterator[None]:
    """Check that the tools find a cache that can be written: where the user's cannot, a folder that ends with this.

    Yosys, Matplotlib and compilers have caches of their own there.
    """
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    try:
        os.makedirs(cache, exist_ok=True)
        writable = os.access(cache, os.W_OK | os.X_OK)
    except OSError:
        writable = False
    if writable:
        yield
        return
    names = ("HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR")
    before = {name: os.environ.get(name) for name in names}
    with scratch() as folder:
        os.environ.update(dict.fromkeys(names, str(folder)))
        try:
            yield
        finally:
            for name, value in before.items():
                os.environ.pop(name) if value is None else os.environ.update({name: value})
