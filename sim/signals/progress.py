"""Work that takes long shows how much of it is done, on whatever the caller has."""

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
