"""Work that takes long shows how much of it is done, on whatever the caller has."""

import multiprocessing
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

Progress = Callable[[float], None]


class Bar(Protocol):
    """Shows a progress bar while its context lasts; what it yields is called with how much of the total is done."""

    def __call__(
        self, verb: str, total: float, unit: str = "", *, rate: bool = False
    ) -> AbstractContextManager[Progress]: ...


@contextmanager
def no_bar(verb: str, total: float, unit: str = "", *, rate: bool = False) -> Iterator[Progress]:
    """Show nothing."""
    yield lambda done: None


Working = Callable[[str], AbstractContextManager[None]]
_shown: list[Working] = []


def show_work(working: Working) -> None:
    """Let what is long and told by nobody else, such as a compilation, be shown by `working`, in this process."""
    _shown[:] = [working]


@contextmanager
def at_work(what: str) -> Iterator[None]:
    """Show what is being done while the context lasts; what is done within it is not shown."""
    if not _shown or multiprocessing.parent_process() is not None:
        yield
        return
    working = _shown.pop()
    try:
        with working(what):
            yield
    finally:
        _shown.append(working)
