"""Outputs that appear whole and all together, or not at all."""

import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Self


class Outputs:
    """The files that a command writes; use as a context manager.

    Every file is written under its own name into a temporary directory beside its target. When the block has
    succeeded all are renamed onto their targets, existing files included; after an error or Ctrl-C nothing is left:
    no temporary, no directory that was made for a target, and every target is as it was before.

    Parameters
    ----------
    targets : mapping of str to path
        Where each output goes. The keys are what messages call it, such as `--plot`.
    inputs : iterable of path
        Files that the command reads; no target may be one of them.

    Raises
    ------
    ValueError
        If two targets are one file, or one is an input or no regular file.
    OSError
        On entering and leaving, if a target cannot be written.
    """

    def __init__(self, targets: Mapping[str, Path], inputs: Iterable[Path] = ()) -> None:
        self._targets = {what: _real(path) for what, path in targets.items()}
        self._made: list[Path] = []
        self._staging: dict[Path, Path] = {}
        self._check({_real(path) for path in inputs})

    def __getitem__(self, what: str) -> Path:
        """Where to write the output `what` for now."""
        target = self._targets[what]
        return self._staging[target.parent] / "new" / target.name

    def get(self, what: str) -> Path | None:
        """Where to write the output `what` for now, or None if it is not wanted."""
        return self[what] if what in self._targets else None

    def __enter__(self) -> Self:
        try:
            for target in self._targets.values():
                self._stage(target)
        except BaseException:
            self._discard()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if error is not None:
            self._discard()
            return
        try:
            self._commit()
        except BaseException:
            self._discard()
            raise
        self._remove_staging()

    def _check(self, inputs: set[Path]) -> None:
        taken: dict[str, str] = {}
        for what, target in self._targets.items():
            other = taken.setdefault(os.path.normcase(target), what)
            if other != what:
                raise ValueError(f"{other} and {what} must be different files, not both {target}")
            if target in inputs:
                raise ValueError(f"{what} must be another file than the input {target}")
            if target.exists() and not target.is_file():
                raise ValueError(f"{what} must be a file, which {target} is not")

    def _stage(self, target: Path) -> None:
        parent = target.parent
        if parent in self._staging:
            return
        try:
            missing = [directory for directory in (parent, *parent.parents) if not directory.exists()]
            for directory in reversed(missing):
                self._made.append(directory)
                directory.mkdir()
            staging = self._staging[parent] = Path(tempfile.mkdtemp(prefix=".tachometry-", dir=parent))
            (staging / "new").mkdir()
            (staging / "old").mkdir()
        except OSError as error:
            raise _unwritable(target, error) from error

    def _commit(self) -> None:
        """Rename every file onto its target, or none."""
        begun: list[tuple[Path, Path | None]] = []
        try:
            for what, target in self._targets.items():
                old = self._staging[target.parent] / "old" / target.name if target.exists() else None
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
        self._remove_staging()
        for directory in reversed(self._made):
            if directory.is_dir() and not any(directory.iterdir()):
                directory.rmdir()

    def _remove_staging(self) -> None:
        for directory in self._staging.values():
            shutil.rmtree(directory, ignore_errors=True)


def _real(path: Path) -> Path:
    """The same file by its only name; a link is a file of its own, which a rename replaces."""
    if path.name in ("", ".."):  # a directory, by no name of its own
        return Path(os.path.realpath(path))
    return Path(os.path.realpath(path.parent)) / path.name


def _unwritable(target: Path, error: OSError) -> OSError:
    return OSError(f"cannot write {target}: {error.strerror or error}")
