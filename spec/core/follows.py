"""Small objects find what follows from the parameters of a core, one for each question."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, Self, TypeVar

if TYPE_CHECKING:
    from tachometry.spec.core.tachometer import TachometerSpec

S = TypeVar("S", bound="TachometerSpec", covariant=True)


class Follows(Generic[S]):
    """Answers one question about a core, from what was asked for and from the answers to other questions."""

    def __init__(self, spec: S) -> None:
        self.spec = spec

    def __reduce__(self) -> tuple[type[Self], tuple[S]]:
        return type(self), (self.spec,)  # what it has found is found again in another process
