"""The command `tachometry`, in this process."""

import threading
from collections.abc import Collection, Iterable

import pytest

from tachometry.cli.main import main
from tachometry.cli.reports import terminal

terminal.LINE_SECONDS = threading.TIMEOUT_MAX  # what a command says must not depend on how long it takes


def run(*args: object) -> int:
    """Return its exit status."""
    with pytest.raises(SystemExit) as stop:
        main([str(arg) for arg in args])
    assert isinstance(stop.value.code, int)
    return stop.value.code


def without(words: Iterable[str], names: Collection[str]) -> list[str]:
    """Return words of a command line without the options of these names, and what is behind each."""
    kept: list[str] = []
    before = ""
    for word in words:
        if not {before, word} & {name for name in names if name.startswith("-")}:
            kept.append(word)
        before = word
    return kept
