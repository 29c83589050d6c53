"""A simulation may skip clocks in which only registers move whose way is known, and nothing else happens."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol, Self, runtime_checkable


@dataclass(frozen=True)
class Idle:
    """Stands for registers on whose values nothing depends but at their stops.

    In clocks in which all else stands still, a simulation may move them on to the next stop at once. All texts are
    names of signals, behind those of the boxes around them: `sampling_clock.left`.
    """

    @property
    def paths(self) -> tuple[str, ...]:
        """Signals that it moves on."""
        raise NotImplementedError

    def within(self, box: str) -> Self:
        """Return the same from outside of a box."""

        def outside(value: object) -> object:
            if isinstance(value, tuple):
                return tuple(map(outside, value))
            return f"{box}.{value}" if value and isinstance(value, str) else value

        return replace(self, **{name: outside(value) for name, value in vars(self).items()})


@dataclass(frozen=True)
class IdleRegister(Idle):
    """Stands for a single register."""

    path: str

    @property
    def paths(self) -> tuple[str, ...]:
        return (self.path,)


@dataclass(frozen=True)
class IdleCounter(IdleRegister):
    """A counter."""

    step: int = 0  # what it counts by, −1 or 1
    stops: tuple[int, ...] = ()  # values at which something else may follow from it
    # instead of these two: its values, each after the one before, if it does not count. The last is the stop.
    order: tuple[int, ...] = ()


@dataclass(frozen=True)
class IdleSum(IdleRegister):
    """Stands for a sum to which every clock adds the same as long as all else stands still; it wraps."""


@dataclass(frozen=True)
class IdleEcho(IdleRegister):
    """A register that is made anew in every clock of what moves, and that is not moved on.

    Nothing reads it in clocks that are skipped, nor in the one behind them.
    """


@dataclass(frozen=True)
class IdleProduct(Idle):
    """A product of `hdl.control.product.SerialProduct`, on whose steps nothing depends until the last two."""

    # total, factor, left and word: `word` stands still as long as the product goes on
    total: str
    factor: str
    left: str
    word: str

    @property
    def paths(self) -> tuple[str, ...]:
        return (self.total, self.factor, self.left)


@dataclass(frozen=True)
class IdleDivision(Idle):
    """A division of `spec.formats.reciprocal.DividedReciprocal`, on whose steps nothing depends until it is done."""

    # digits, less_one and m: m stands still as long as the division goes on
    digits: str
    less_one: str
    m: str
    steps: int  # at most 62

    @property
    def paths(self) -> tuple[str, ...]:
        return (self.digits, self.less_one)


@dataclass(frozen=True)
class IdleBox(Idle):
    """A box that goes on by itself while all else stands still: nothing outside depends on it but at a stop.

    One that others in the box around it wait for names what is not 0 as long as they do.
    """

    box: str
    busy: tuple[str, ...] = ()  # registers in it

    @property
    def paths(self) -> tuple[str, ...]:
        """None, as it goes on clock by clock."""
        return ()


@dataclass(frozen=True)
class IdleRounds(Idle):
    """A core that goes round its slots; rounds are alike as long as no pin, strobe or word of a memory changes."""

    slot: str  # register that is 0 at the beginning of a round
    clocks: int  # of a round
    moving: tuple[Idle, ...]  # what moves from round to round, as the others do from clock to clock

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(path for one in self.moving for path in one.paths)


@runtime_checkable
class HasIdle(Protocol):
    """A box with such registers."""

    @property
    def idle(self) -> tuple[Idle, ...]:
        """Registers that a simulation may move on, with names within the box."""


def idle_of(boxes: Mapping[str, object]) -> tuple[Idle, ...]:
    """Return the counters that may be skipped in boxes within a box, by the names of the boxes."""
    return tuple(one.within(name) for name, box in boxes.items() if isinstance(box, HasIdle) for one in box.idle)
