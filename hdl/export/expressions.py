"""Values of a module as Verilog expressions, and the names of what they read.

Every expression has exactly the width of its context, so no rule of Verilog extends anything.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any

from amaranth.hdl._nir import AssignmentList, AsyncReadPort, FlipFlop, Net, Operator, Part, SyncReadPort, Value

from tachometry.hdl.export.names import Names, Text, number, part, plain, span
from tachometry.hdl.export.netlist import Circuit, number_of, runs

_KINDS = {
    "+": "sum",
    "-": "difference",
    "*": "product",
    "m": "choice",
    "<<": "shifted",
    "u>>": "shifted",
    "s>>": "shifted",
}
_WORDS = {"==": "is", "!=": "is_not", "u<": "below", "u>=": "from", "u>": "above", "u<=": "to", "&": "and", "|": "or"}
_WORDS |= {"^": "xor", "+": "plus", "-": "minus", "s<": "below", "s>=": "from"}
_OPPOSITE = {"==": "!=", "!=": "=="}
_REDUCED = {"r&": "&", "r^": "^"}
_LONGEST_INDEX = 9  # bits of an index into a vector; beyond, the vector is shifted
_LONGEST_NAME = 32  # of a name that is made of operands

# Patterns of a test: nets with their levels. A case of a choice: its patterns, or None if it is met otherwise.
Pattern = list[tuple[Any, int]]
Case = list[Pattern] | None
# Assignments of a choice: ("=", first bit, value), or ("if", number of the test, bodies of its cases).
Body = list[Any]


class Scope(Names):
    """A module in which values are expressions."""

    def __init__(self, circuit: Circuit, index: int) -> None:
        super().__init__(circuit, index)
        self.inline: dict[int, Text | None] = {}  # cells that are written where they are read
        self.memories: dict[int, str] = {}
        self.constants: dict[str, tuple[int, Text]] = {}  # names of enumerations: width and number

    def text(self, value: Any) -> Text:
        """Return a value as an expression of its width."""
        pieces: list[Text] = []
        place = 0
        while place < len(value):
            made, count = self._piece(value, place)
            pieces.append(made)
            place += count
        return pieces[0] if len(pieces) == 1 else Text(f"{{{', '.join(reversed(pieces))}}}")

    def _piece(self, value: Any, place: int) -> tuple[Text, int]:
        """Return the expression of the bits from a place on that stand together, and their number."""
        net, end = value[place], place + 1
        if net.is_const:
            while end < len(value) and value[end].is_const:
                end += 1
            return number(value[place:end]), end - place
        if value[place : place + 2] == (net, net):
            while end < len(value) and value[end] == net:
                end += 1
            return Text(f"{{{end - place}{{{self.text(Value(net))}}}}}"), end - place
        if net.cell in self.inline:
            return self._inlined(net.cell), self.circuit.width[net.cell]
        name, bit, width = self.home[net]
        while end < len(value) and self.home.get(value[end], ("", 0))[:2] == (name, bit + end - place):
            end += 1
        return part(name, bit, end - place, width), end - place

    def _inlined(self, cell: int) -> Text:
        made = self.inline[cell]
        if made is None:
            made = self.inline[cell] = self.made(cell)
        return made

    def made(self, number_: int) -> Text:
        """Return the expression of a cell."""
        cell = self.circuit.cells[number_]
        match cell:
            case AssignmentList():
                return self._chosen(cell)
            case AsyncReadPort():
                return Text(f"{self.memories[cell.memory]}[{self.text(cell.addr)}]")
        operator, (a, *more) = cell.operator, cell.inputs
        if operator == "m":
            yes, no = (self.text(value) for value in more)
            return Text.loose(f"{self.text(a).inner} ? {yes.inner} : {no.inner}")
        return self._binary(operator, a, more[0]) if more else self._unary(operator, a)

    def _unary(self, operator: str, a: Any) -> Text:
        zero = number(Value.zeros(len(a)))
        if operator in ("b", "r|"):
            return Text.loose(f"{self.text(a).inner} != {zero}")
        if operator == "~" and len(a) == 1 and a[0].is_cell and a[0].cell in self.inline:
            inner = self.circuit.source(a[0])
            kind = inner.operator if isinstance(inner, Operator) else ""
            if kind in _OPPOSITE:
                return self._binary(_OPPOSITE[kind], *inner.inputs)
            if kind == "~":
                return self.text(inner.inputs[0])
            if kind in ("b", "r|"):
                return Text.loose(f"{self.text(inner.inputs[0]).inner} == {number(Value.zeros(len(inner.inputs[0])))}")
        made = f"{_REDUCED.get(operator, operator)}{self.text(a).inner}"
        return Text(made) if operator == "~" else Text.loose(made)

    def _binary(self, operator: str, a: Any, b: Any) -> Text:
        if operator == "*":
            return self._product(a, b)
        if operator == "s>>":
            return Text.loose(f"$signed({self.text(a)}) >>> {self.text(b).inner}")
        if operator[0] == "s":
            if operator == "s<" and not any(b):
                return self.text(a[-1:])
            return Text.loose(f"$signed({self.text(a)}) {operator[1:]} $signed({self.text(b)})")
        if operator == "+" and b.is_const and b[-1] == 1 and len(b) > 1:
            operator, b = "-", Value.from_const(-number_of(b), len(b))
        left = self.text(a)
        right = self.literal(a, b) if operator in _OPPOSITE and b.is_const else self.text(b)
        first = str(left) if left.operator == operator and operator in "&|^" else left.inner
        return Text.loose(f"{first} {operator.removeprefix('u')} {right.inner}", operator)

    def _product(self, a: Any, b: Any) -> Text:
        """Return a product whose factors have no bits that only extend them."""
        signed = any(len(value) > 1 and value[-1] == value[-2] and value[-1].is_cell for value in (a, b))
        factors = []
        for value in (a, b):
            bits = list(value)
            while len(bits) > 1 and bits[-1] == (bits[-2] if signed else 0):
                bits.pop()
            text = self.text(Value(bits))
            factors.append(f"$signed({text})" if signed else text.inner)
        return Text.loose(" * ".join(factors))

    def literal(self, value: Any, constant: Any) -> Text:
        """Return a constant that a value is compared with: of an enumeration, its name."""
        kind, names = self.kinds.get(value, ("", {}))
        if (level := number_of(constant)) not in names:
            return number(constant)
        name = plain(f"{kind}_{names[level]}").upper()
        if self.constants.get(name, (len(constant), number(constant))) != (len(constant), number(constant)):
            return number(constant)  # of another enumeration
        self.taken.add(name)
        self.constants[name] = len(constant), number(constant)
        return Text(name)

    def indexed(self, cell: Any, name: str) -> tuple[list[str], Text]:
        """Return lines above the definition of a part that a value chooses, and its expression.

        A constant becomes a vector, as wide as the index reaches, which tools compare.
        """
        step, offset, value, width = cell.stride, cell.offset, cell.value, cell.width
        fill = value[-1] if cell.value_signed else Net.from_const(0)
        reach = (step << len(offset)) - step + width
        short = len(offset) <= _LONGEST_INDEX
        value = Value([*value, *[fill] * max(0, (reach if short else width) - len(value))])[: reach if short else None]
        lines, vector = [], self.text(value)
        if not vector.isidentifier():
            vector = Text(self.unique(f"{name}_{'table' if value.is_const else 'from'}", True))
            digits = f"{len(value)}'h{number_of(value):0{-(-len(value) // 4)}x}" if value.is_const else ""
            lines.append(f"wire {span(len(value))}{vector} = {digits or self.text(value)};")
        zeros, bits = step.bit_length() - 1, (len(value) - 1).bit_length()
        place = [*Value.zeros(zeros), *offset]
        at = self.text(Value([*place, *Value.zeros(bits - len(place) if short else 0)]))
        if step != 1 << zeros:
            bits = max(bits, (reach - width).bit_length())
            factors = Value([*offset, *Value.zeros(bits - len(offset))]), Value.from_const(step, bits)
            at = Text(self.unique(f"{name}_at", True))
            lines.append(f"wire {span(bits)}{at} = {' * '.join(map(self.text, factors))};")
        if short:
            return lines, Text(f"{vector}[{at}]" if width == 1 else f"{vector}[{at} +: {width}]")
        shifted = self.unique(f"{name}_shifted", True)
        shift = f"$signed({vector}) >>> {at}" if cell.value_signed else f"{vector} >> {at}"
        return [*lines, f"wire {span(len(value))}{shifted} = {shift};"], part(shifted, 0, width, len(value))

    def tree(self, cell: Any, low: int = 0, high: int = 1 << 16) -> Body:
        """Return the assignments of a choice as nested lists, as far as they set bits from `low` below `high`."""
        root: Body = []
        for each in cell.assignments:
            path, condition = [], each.cond
            while condition.is_cell:
                path.append(condition)
                condition = self.circuit.source(condition).en
            body = root
            for condition in reversed(path):
                if not (body and body[-1][:2] == ("if", condition.cell)):
                    cases = self.circuit.source(condition).inputs
                    body.append(("if", condition.cell, [[] for _ in cases]))
                body = body[-1][2][condition.bit]
            first, last = max(each.start, low), min(each.start + len(each.value), high)
            if first < last:
                body.append(("=", first - low, each.value[first - each.start : last - each.start]))
        return root

    def cases(self, test: int, bodies: Iterable[Body]) -> Iterator[tuple[Case, Body]]:
        """Yield the cases of a choice that can be, with their bodies; the last may be the one without a pattern."""
        for net, body in zip(self.circuit.cells[test].inputs, bodies, strict=True):
            patterns: Case = None
            if net.is_cell:
                cell = self.circuit.source(net)
                made = [list(zip(cell.value, reversed(pattern), strict=True)) for pattern in cell.patterns]
                levels = [[(bit, int(level)) for bit, level in one if level != "-"] for one in made]
                able = [one for one in levels if all(bit == level for bit, level in one if bit.is_const)]
                patterns = [[(bit, level) for bit, level in one if bit.is_cell] for one in able]
            if patterns is None or [] in patterns:
                yield None, body
                return
            if patterns:
                yield patterns, body

    def condition(self, patterns: list[Pattern]) -> Text:
        """Return whether a value has one of the patterns."""
        made = []
        for pattern in patterns:
            nets, levels = Value(net for net, _ in pattern), [level for _, level in pattern]
            text = self.text(nets)
            if levels in ([0], [1]):
                made.append(text if levels[0] else Text(f"~{text.inner}"))
            else:
                made.append(Text.loose(f"{text.inner} == {self.literal(nets, levels)}"))
        return made[0] if len(made) == 1 else Text.loose(" | ".join(one.inner for one in made))

    def _chosen(self, cell: Any) -> Text:
        """Return a choice as an expression; the bits between two cuts are chosen together."""
        width = len(cell.default)
        starts = {each.start for each in cell.assignments} | {each.start + len(each.value) for each in cell.assignments}
        cuts = sorted({0, width, *starts})
        pieces = [
            self._evaluated(self.tree(cell, low, high), self.text(cell.default[low:high]))
            for low, high in pairwise(cuts)
        ]
        return pieces[0] if len(pieces) == 1 else Text(f"{{{', '.join(reversed(pieces))}}}")

    def _evaluated(self, body: Body, now: Text) -> Text:
        """Return a value after some assignments; `now` is what it was before."""
        for kind, which, what in body:
            if kind == "=":
                now = self.text(what)
                continue
            branches: list[tuple[Text, Text]] = []
            last = now
            for patterns, inner in self.cases(which, what):
                if patterns is None:
                    last = self._evaluated(inner, now)
                else:
                    branches.append((self.condition(patterns), self._evaluated(inner, now)))
            while branches and branches[-1][1] == last:
                branches.pop()
            for condition, then in reversed(branches):
                last = Text.loose(f"{condition.inner} ? {then.inner} : {last}")
            now = last
        return now

    def meaning(self, number_: int) -> str:
        """Return a name for a cell that has none: of its low bits, its reader, or its operands."""
        circuit, whole = self.circuit, self.circuit.whole(number_)
        cell = circuit.cells[number_]
        for value, names in self.called.items():
            if len(value) < len(whole) and value == whole[: len(value)]:
                return f"{names[0]}_wide"
        kind = "next" if isinstance(cell, AssignmentList) else _KINDS.get(_operator(cell), "")
        for register in self.own:
            other = circuit.cells[register]
            if isinstance(other, FlipFlop) and any(net in whole for net in other.data):
                name, *_ = self.home.get(circuit.whole(register)[0], ("",))
                if name:
                    return f"{name}_{kind or 'next'}"
        return self._of_operands(cell) or self._of_readers(number_, kind) or self.near(whole) or kind or "term"

    def _of_operands(self, cell: Any) -> str | None:
        word = _WORDS.get(_operator(cell))
        if word is None or not all(net.is_const or net in self.home for value in cell.inputs for net in value):
            return None
        made = f"_{word}_".join(plain(self.text(value)) for value in cell.inputs)
        return made if len(made) <= _LONGEST_NAME and made[0].isalpha() else None

    def _of_readers(self, number_: int, kind: str) -> str | None:
        """Return a name after the nearest signal that is made of a cell."""
        circuit, todo = self.circuit, [number_]
        for at in todo:
            for reader in sorted(circuit.readers[at]):
                if circuit.cells[reader].module_idx != self.index or reader in todo:
                    continue
                names = self.called.get(circuit.whole(reader))
                if names:
                    one_bit = circuit.width[number_] == 1
                    end = {"": "if" if one_bit else "part", "next": "first"}.get(kind, kind)
                    return f"{names[0]}_{end}"
                todo.append(reader)
        return None

    def folded(self, number_: int) -> int | None:
        """Return the choice that is the next value of a register, and read by nothing else."""
        circuit, cell = self.circuit, self.circuit.cells[number_]
        pieces = [*runs(cell.data)]
        if len(pieces) != 1 or not pieces[0][0].is_cell:
            return None
        choice = pieces[0][0].cell
        alone = circuit.uses[choice] == 1 and circuit.whole(choice) == cell.data
        other = circuit.cells[choice]
        return choice if alone and isinstance(other, AssignmentList) and other.module_idx == self.index else None

    def is_inline(self, number_: int) -> bool:
        """Return whether a cell is written where it is read: it has no name, and is read once and as a whole."""
        circuit, cell = self.circuit, self.circuit.cells[number_]
        whole = circuit.whole(number_)
        if isinstance(cell, (Part, AsyncReadPort)) or _operator(cell) in ("*", "s>>"):
            return False
        if whole in self.called or any(net in circuit.flow[self.index] for net in whole):
            return False
        trivial = _operator(cell) == "~" and len(whole) == 1
        return circuit.pieces[number_] <= {(0, len(whole))} and (circuit.uses[number_] == 1 or trivial)


def is_clocked(cell: Any) -> bool:
    """Return whether a cell is a register, or has one."""
    return isinstance(cell, (FlipFlop, SyncReadPort))


def _operator(cell: Any) -> str:
    return cell.operator if isinstance(cell, Operator) else ""
