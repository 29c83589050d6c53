"""An extra is one feature beside the measurement: its option, its rules, and what it adds to the core."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, ClassVar, Self

from tachometry.spec.core.front_end import Pin
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.formats.displacement import Displacement
from tachometry.spec.language.field import Draft, Field
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import Port


@dataclass(frozen=True)
class Event:
    """Raises the interrupt of a core with registers."""

    help: str
    wires: tuple[str, ...]  # outputs of the gates; the event is in each clock in which one of them is high


@dataclass(frozen=True, kw_only=True)
class Extra:
    """A feature of a core of one axis; a subclass is a frozen dataclass whose first field is the option that adds it.

    Further fields are options that need the first. A spec holds the extras that it was asked for, in the order of
    `EXTRAS`; `OverSpeed.of(spec.extras)` is the one of a class, or None.
    """

    name: ClassVar[str]  # of the files, and of the box in the gates
    place: ClassVar[int] = 0  # its ports are behind (1) or before (-1) those of others, as drivers know them
    compared: ClassVar[bool] = False  # whether comparisons of methods show it
    exchanges: ClassVar[bool] = False  # whether a program reads and writes the offsets of a period
    settles: ClassVar[bool] = False  # whether a place that waits for a count goes to the middle of it
    texts: ClassVar[Mapping[str, Mapping[Any, str]]] = {}  # what values of its ports mean, by the names of the ports

    @classmethod
    def of(cls, extras: "Iterable[Extra]") -> Self | None:
        """Return the extra of this class among those of a core."""
        return next((one for one in extras if isinstance(one, cls)), None)

    @classmethod
    def respelled(cls, texts: Mapping[str, str]) -> Mapping[str, str]:
        """Return texts of options, with its own options in place of others that mean the same."""
        return texts

    def missing(self) -> Mapping[str, str]:
        """Return the refusals of kinds of core that cannot have it: axes, demo, loop, rio or sampled."""
        return {}

    def check(self, spec: Numbers) -> None:
        """Raise ParameterError if a core cannot have it."""

    def inputs(self, spec: Numbers) -> Iterable[tuple[str, str, Pin]]:
        """Yield inputs, each with the register and the field that take its place on a bus."""
        return ()

    def pins(self, spec: Numbers) -> Iterable[Pin]:
        """Return its inputs."""
        return (each for _, _, each in self.inputs(spec))

    def in_turn(self, slots: int) -> Self:
        """Return what an axis of many has of it, whose clock is a round of so many clocks."""
        return self

    def turn_clocks(self, spec: Numbers) -> int:
        """Return clocks from an update of an axis of many to the outputs that it adds to that."""
        return 0

    def ports(self, spec: Numbers) -> Iterable[Port]:
        """Return its outputs."""
        return ()

    def least_fine_bits(self, spec: Numbers) -> int:
        """Return fraction bits that it needs of a fine position."""
        return 0

    def displacement(self, spec: Numbers) -> Displacement | None:
        """Return the format of displacements of counts that it gives to the datapath; None: it gives none."""
        return None

    def registers(self, spec: Numbers) -> Iterable[Draft]:
        """Return registers that a program writes; a field sets the input of its gates that has the name of its port."""
        for name, rows in groupby(self.inputs(spec), lambda row: row[0]):
            fields, low = list[Field](), 0
            for _, field, one in rows:
                port, width, text = one.port.name, one.port.width, one.port.help
                fields.append(Field(field, width, low, text, writable=True, single=one.act, port=port))
                low = 1 if low + width == 1 else max(width, 8)
            yield name, fields[0].help, tuple(fields), {}

    def events(self, spec: Numbers) -> Mapping[str, Event]:
        """Return events that raise the interrupt, by their names."""
        return {}

    def latency(self, spec: Numbers) -> Mapping[str, int]:
        """Return entries of the manifest's latencies, in clocks."""
        return {}

    def entry(self, spec: Numbers) -> dict[str, Any] | None:
        """Return the entry of the manifest that has its name; None: there is none."""
        return None

    def tour(self, spec: Numbers) -> Sequence[int]:
        """Return positions between which a motion shows that it works, in the order in which it goes over them."""
        return ()

    def row(self, spec: Numbers, run: Any) -> tuple[str, str] | None:
        """Return name and value that a simulation prints of it."""
        return None


def refuse(extras: Iterable[Extra], kind: str) -> None:
    """Raise ParameterError for the first extra that a kind of core, such as `axes`, does not have."""
    for extra in extras:
        if why := extra.missing().get(kind):
            raise ParameterError(extra.name, why)
