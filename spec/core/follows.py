"""Small objects find what follows from the parameters of a core, one for each question."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, Self, TypeVar

if TYPE_CHECKING:
    from tachometry.spec.core.tachometer import TachometerSpec

A = TypeVar("A", covariant=True)  # a core of any kind
S = TypeVar("S", bound="TachometerSpec", covariant=True)  # of one axis


class Follows(Generic[A]):
    """Answers one question about a core, from what was asked for and from the answers to other questions."""

    def __init__(self, spec: A) -> None:
        self.spec = spec

    def __reduce__(self) -> tuple[type[Self], tuple[A]]:
        return type(self), (self.spec,)  # what it has found is found again in another process
