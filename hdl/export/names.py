"""Names in a module, and the texts that declarations and expressions are made of."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from typing import Any

from tachometry.hdl.export.netlist import Circuit, number_of
from tachometry.spec.registers.manifest import KEYWORDS


class Text(str):
    """An expression."""

    atom = True  # needs no parentheses
    operator = ""

    @classmethod
    def loose(cls, text: str, operator: str = "") -> Text:
        """Return an expression that needs parentheses within another."""
        made = cls(text)
        made.atom, made.operator = False, operator
        return made

    @property
    def inner(self) -> str:
        """The expression as an operand."""
        return str(self) if self.atom else f"({self})"


def number(value: Sequence[int]) -> Text:
    """Return constant nets as a number."""
    width, made = len(value), number_of(value)
    if width == 1:
        return Text(f"1'b{made}")
    return Text(f"{width}'d{made}" if made < 1 << 16 else f"{width}'h{made:x}")


def span(width: int) -> str:
    """Return the range of a declaration, with a blank behind it; empty for one bit."""
    return f"[{width - 1}:0] " if width > 1 else ""


def part(name: str, first: int, count: int, width: int) -> Text:
    """Return some bits of a vector of `width`."""
    if count == width:
        return Text(name)
    return Text(f"{name}[{first}]" if count == 1 else f"{name}[{first + count - 1}:{first}]")


def plain(name: str) -> str:
    """Return a name as an identifier that needs no backslash."""
    made = re.sub(r"\W+", "_", re.sub(r"\$\d+", "", name)).strip("_") or "unnamed"
    made = f"_{made}" if made[0].isdigit() else made
    return f"{made}_" if made in KEYWORDS else made


class Names:
    """Names of a module: each net has one, which is that of its signal, or says what it is for."""

    def __init__(self, circuit: Circuit, index: int) -> None:
        self.circuit, self.index = circuit, index
        self.module = circuit.modules[index]
        self.own = [cell for cell in self.module.cells if cell in circuit.live]
        self.taken: set[str] = set()
        self.home: dict[Any, tuple[str, int, int]] = {}  # net -> name, bit of it, its width
        self.called: dict[Any, list[str]] = defaultdict(list)  # value -> names of its signals
        self.attributes: dict[Any, dict[str, Any]] = defaultdict(dict)
        self.kinds: dict[Any, tuple[str, dict[int, str]]] = {}  # value -> its enumeration, and names in it
        for signal, name in self.module.signal_names.items():
            value = circuit.netlist.signals[signal]
            if value and not value.is_const:
                self.called[value].append(name)
                self.attributes[value] |= signal.attrs
                shape = circuit.netlist.signal_fields[signal][()]
                if shape.enum_variants:
                    self.kinds[value] = shape.enum_name or name, shape.enum_variants
        for each in self.called.values():
            each.sort(key=lambda name: "$" in name)
        self._signals = {plain(name) for each in self.called.values() for name in each}

    def unique(self, name: str, made_up: bool = False) -> str:
        """Return a name that nothing else has; one that is made up is that of no signal either."""
        made = base = plain(name)
        count = 2
        while made in self.taken or (made_up and made in self._signals):
            made, count = f"{base}_{count}", count + 1
        self.taken.add(made)
        return made

    def place(self, name: str, value: Any) -> None:
        """Have a value read by a name."""
        for bit, net in enumerate(value):
            self.home[net] = (name, bit, len(value))

    def near(self, value: Any) -> str | None:
        """Return the name of the narrowest signal that has a value in it, with the bits."""
        found = [(len(of), names[0], of) for of, names in self.called.items() if value[0] in of and value[-1] in of]
        if not found:
            return None
        width, name, of = min(found)
        low = of.index(value[0])
        if len(value) == width:
            return name
        return f"{name}_{low}" if len(value) == 1 else f"{name}_{low + len(value) - 1}_{low}"
