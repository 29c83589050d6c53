"""Registers and memories as Verilog: processes, and the words that memories begin with."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from amaranth.hdl._nir import SyncReadPort, SyncWritePort, Value

from tachometry.hdl.export.expressions import Body, Case, Scope
from tachometry.hdl.export.names import Text, number, part, span

_ASCII = {
    ord(letter): text
    for letter, text in zip(
        "←⌊⌋−≤≥·²×…–π→±μµ√∞", "<- floor( ) - <= >= * ^2 x .. - pi -> +- u u sqrt inf".split(), strict=True
    )
}


class Processes(Scope):
    """The clocked half of a module."""

    def all_of(self, *kinds: type) -> list[int]:
        return [cell for cell in self.own if isinstance(self.circuit.cells[cell], kinds)]

    def clocked(self, registers: Mapping[int, str], choices: Mapping[int, int | None]) -> list[str]:
        """Return processes: those of memories, of registers with the reset, and of those without."""
        lines = [line for cell in self.all_of(SyncWritePort) for line in self._write(self.circuit.cells[cell])]
        groups: dict[Any, list[_Register]] = defaultdict(list)
        for cell, name in registers.items():
            if isinstance(self.circuit.cells[cell], SyncReadPort):
                lines += self._read(self.circuit.cells[cell], name)
            else:
                register, clock, reset = self._register(cell, name, choices[cell])
                groups[clock, reset].append(register)
        for (clock, reset), members in groups.items():
            body: Body = []
            for member in members:
                _merge(body, member.body, member)
            lines.append(f"{clock} begin")
            if reset is None:
                lines += self._statements(body, 1)
            else:
                patterns, _ = next(self.cases(reset, [[]]))
                lines.append(f"    if ({self.condition(patterns or [])}) begin")
                lines += (f"        {member.name} <= {member.level};" for member in members)
                lines += ["    end else begin", *self._statements(body, 2), "    end"]
            lines += ["end", ""]
        return lines[:-1]

    def _register(self, number_: int, name: str, choice: int | None) -> tuple[_Register, str, int | None]:
        """Return a register, the edge of its clock, and the test that resets it, which is no part of its body."""
        cell, whole = self.circuit.cells[number_], self.circuit.whole(number_)
        level = Value.from_const(cell.init, len(whole))
        body: Body = [("=", 0, cell.data)]
        reset = None
        if choice is not None:
            default = self.circuit.cells[choice].default
            body = [*[("=", 0, default)] * (default != whole), *self.tree(self.circuit.cells[choice])]
            match body[-1]:
                case ("if", int(test), [[("=", 0, value)]]) if value == level and self._is_reset(test):
                    reset, body = test, body[:-1]
        return _Register(name, len(whole), number(level), body), self._edge(cell), reset

    def _edge(self, cell: Any) -> str:
        return f"always @({cell.clk_edge}edge {self.text(Value(cell.clk))})"

    def _is_reset(self, test: int) -> bool:
        """Return whether a test is for the input rst alone."""
        cases = [patterns for patterns, _ in self.cases(test, [[]])]
        return cases != [None] and len(cases[0] or ()) == 1 and self.condition(cases[0] or []) == "rst"

    def _write(self, cell: Any) -> list[str]:
        """Return the process that writes a word, or lanes of it."""
        word = f"{self.memories[cell.memory]}[{self.text(cell.addr)}]"
        return [f"{self._edge(cell)} begin", *self._lanes(cell, word, "    "), "end", ""]

    def _lanes(self, cell: Any, word: str, pad: str, condition: Text | None = None) -> Iterator[str]:
        """Yield how lanes of a word are written to a memory, or to the register that reads it in this clock."""
        first = 0
        while first < len(cell.en):
            end = first + 1
            while end < len(cell.en) and cell.en[end] == cell.en[first]:
                end += 1
            lane = part(word, first, end - first, len(cell.en))
            tests = [
                *([] if cell.en[first] == 1 else [self.text(Value(cell.en[first]))]),
                *([condition] if condition else []),
            ]
            test = f"if ({' & '.join(test.inner for test in tests) if len(tests) > 1 else tests[0]}) " if tests else ""
            yield f"{pad}{test}{lane} <= {self.text(cell.data[first:end])};"
            first = end

    def _read(self, cell: Any, name: str) -> list[str]:
        """Return the process that reads a word, and what is written to it in the same clock if it shows that."""
        read = [f"    {name} <= {self.memories[cell.memory]}[{self.text(cell.addr)}];"]
        for port in cell.transparent_for:
            write = self.circuit.cells[port]
            same = Text.loose(f"{self.text(write.addr).inner} == {self.text(cell.addr).inner}")
            read += self._lanes(write, name, "    ", same)
        if cell.en != 1:
            read = [f"    if ({self.text(Value(cell.en))}) begin", *(f"    {line}" for line in read), "    end"]
        return [f"{self._edge(cell)} begin", *read, "end", ""]

    def _statements(self, body: Body, indent: int) -> Iterator[str]:
        pad = "    " * indent
        for kind, which, what in body:
            if kind == "=":
                register, first = which
                yield f"{pad}{part(register.name, first, len(what), register.width)} <= {self.text(what)};"
                continue
            full = [*self.cases(which, what)]
            while full and not full[-1][1]:
                full.pop()
            if len(full) > 2 and (value := _common(full)) is not None:
                yield from self._case(value, full, indent)
                continue
            word = "if"
            for patterns, inner in full:
                if patterns is not None:
                    yield f"{pad}{word} ({self.condition(patterns)}) begin"
                elif len(full) > 1:
                    yield f"{pad}end else begin"
                yield from self._statements(inner, indent + (patterns is not None or len(full) > 1))
                word = "end else if"
            if full and full[0][0] is not None:
                yield f"{pad}end"

    def _case(self, value: Any, full: list[tuple[Case, Body]], indent: int) -> Iterator[str]:
        """Yield a choice over constants."""
        pad = "    " * indent
        yield f"{pad}case ({self.text(value)})"
        for patterns, inner in full:
            levels = [self.literal(value, [level for _, level in one]) for one in patterns or ()]
            yield f"{pad}    {', '.join(levels) or 'default'}: begin"
            yield from self._statements(inner, indent + 2)
            yield f"{pad}    end"
        yield f"{pad}endcase"

    def contents(self, memory: Any, name: str, comments: Sequence[str]) -> Iterator[str]:
        """Yield the declaration of a memory, and the words that it begins with."""
        yield f"{attributes_of(memory.attributes)}reg {span(memory.width)}{name} [0:{memory.depth - 1}];"
        if not any(memory.init):
            at = self.unique(f"{name}_at", True)
            loop = f"for ({at} = 0; {at} < {memory.depth}; {at} = {at} + 1)"
            yield from (f"integer {at};", f"initial {loop} {name}[{at}] = {memory.width}'d0;")
            return
        yield "// FPGAs load these words with the bitstream; a tool that ignores `initial` needs a ROM of them here."
        yield "initial begin"
        for number_, (word, comment) in enumerate(zip_longest(memory.init, comments, fillvalue="")):
            value = f"{word & ((1 << memory.width) - 1):0{-(-memory.width // 4)}x}"
            yield f"    {name}[{number_}] = {memory.width}'h{value};{comment and f'  // {ascii_of(comment)}'}"
        yield "end"


@dataclass(frozen=True)
class _Register:
    """A register of a process."""

    name: str
    width: int
    level: Text  # with which it begins
    body: Body


def _merge(into: Body, body: Body, register: _Register) -> None:
    """Add the assignments of a register to those of others, in its order, under the tests that they share."""
    place = 0
    for kind, which, what in body:
        if kind == "=":
            while place < len(into) and into[place][0] == "=":
                place += 1
            into.insert(place, ("=", (register, which), what))
            place += 1
            continue
        found = next((at for at in range(place, len(into)) if into[at][:2] == (kind, which)), len(into))
        if found == len(into):
            into.append((kind, which, [[] for _ in what]))
        for mine, theirs in zip(into[found][2], what, strict=True):
            _merge(mine, theirs, register)
        place = found + 1


def _common(cases: Iterable[tuple[Case, Body]]) -> Any:
    """Return the value of more than a bit that all cases compare with constants, or None."""
    values = {Value(net for net, _ in one) for patterns, _ in cases for one in patterns or ()}
    value = values.pop()
    return value if not values and len(value) > 1 else None


def attributes_of(attributes: Mapping[str, Any]) -> str:
    """Return attributes as they stand before a declaration."""
    texts = {key: value if isinstance(value, int) else f'"{value}"' for key, value in attributes.items()}
    return "".join(f"(* {key} = {text} *) " for key, text in texts.items())


def ascii_of(text: str) -> str:
    """Return a text in the letters that every reader of Verilog takes."""
    return text.translate(_ASCII).encode("ascii", "replace").decode()
