"""Values of a module as Verilog expressions and statements, and the names of what they read.

Every expression has exactly the width of its context, so no rule of Verilog extends anything.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby, pairwise
from typing import Any

from amaranth.hdl import _nir as nir

from tachometry.hdl.export.netlist import Circuit, number_of
from tachometry.spec.registers.manifest import KEYWORDS

_KINDS = dict(zip(["+", "-", "*", "m"], ["sum", "difference", "product", "choice"], strict=True))
_KINDS |= dict.fromkeys(["<<", "u>>", "s>>"], "shifted")
_WORDS = {"==": "is", "!=": "is_not", "u<": "below", "u>=": "from", "u>": "above", "u<=": "to", "&": "and", "|": "or"}
_WORDS |= {"^": "xor", "+": "plus", "-": "minus", "s<": "below", "s>=": "from"}
_OPPOSITE = {"==": "!=", "!=": "=="}
_BRACKETS = re.compile(r"[\[({][^\[\](){}]*[\])}]")
_LONGEST_NAME = 32  # of a name that is made of operands
_LONGEST_CHAIN = 3  # tests of one value, each with a value that `?:` chooses
_LONGEST_CHOICE = 2  # assignments of one that is written where it is read

# Assignments of a choice: ("=", first bit, value), or ("if", number of the test, bodies of its cases).
Body = list[Any]


def number(value: Sequence[int]) -> str:
    """Return constant nets as a number."""
    width, made = len(value), number_of(value)
    digits = f"b{made}" if width == 1 else f"d{made}" if made < 1 << 16 else f"h{made:x}"
    return f"{width}'{digits}"


def span(width: int) -> str:
    """Return the range of a declaration, with a blank behind it; empty for one bit."""
    return f"[{width - 1}:0] " if width > 1 else ""


def part(name: str, first: int, count: int, width: int) -> str:
    """Return some bits of a vector of `width`."""
    bits = f"{first}" if count == 1 else f"{first + count - 1}:{first}"
    return name if count == width else f"{name}[{bits}]"


def plain(name: str) -> str:
    """Return a name as an identifier that needs no backslash."""
    made = re.sub(r"\W+", "_", re.sub(r"\$\d+", "", name)).strip("_") or "unnamed"
    made = f"_{made}" if made[0].isdigit() else made
    return f"{made}_" if made in KEYWORDS else made


def _joined(pieces: Sequence[str]) -> str:
    """Return expressions as one, the lowest bits first."""
    return pieces[0] if len(pieces) == 1 else f"{{{', '.join(reversed(pieces))}}}"


def _outside(text: str) -> str:
    """Return an expression with a line for what it has in brackets."""
    while (less := _BRACKETS.sub("_", text)) != text:
        text = less
    return text


def operand(text: str) -> str:
    """Return an expression as it stands within another."""
    bare = _outside(text) if " " in text else text
    return f"({text})" if " " in bare or bare.startswith(("&", "|", "^", "-")) else text


class Scope:
    """A module in which values are expressions: each net has the name of its signal, or one that says what it is."""

    def __init__(self, circuit: Circuit, index: int) -> None:
        self.circuit, self.index = circuit, index
        self.module = circuit.modules[index]
        self.own = [cell for cell in self.module.cells if cell in circuit.live]
        self.taken: set[str] = set()
        self.home: dict[Any, tuple[str, int, int]] = {}  # net -> name, bit of it, its width
        self.called: dict[Any, list[str]] = defaultdict(list)  # value -> names of its signals
        self.attributes: dict[Any, dict[str, Any]] = defaultdict(dict)
        self.kinds: dict[Any, tuple[str, dict[int, str]]] = {}  # value -> its enumeration, and names in it
        self.inline: set[int] = set()  # cells that are written where they are read
        self.memories: dict[int, str] = {}
        self.constants: dict[str, tuple[int, str]] = {}  # names of enumerations: width and number
        for signal, name in self.module.signal_names.items():
            value = circuit.signals[signal]
            if value and not value.is_const:
                self.called[value].append(name)
                self.attributes[value] |= signal.attrs
                shape = circuit.signal_fields[signal][()]
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
        self.home |= {net: (name, bit, len(value)) for bit, net in enumerate(value)}

    def near(self, value: Any) -> str:
        """Return the name of the narrowest signal that has a value in it, with the bits."""
        holders = [of for of in self.called if value[0] in of and value[-1] in of]
        if not holders:
            return ""
        whole = min(holders, key=lambda of: (len(of), self.called[of][0]))
        bits = part("", whole.index(value[0]), len(value), len(whole))
        return f"{self.called[whole][0]}{re.sub('[^0-9]+', '_', bits).rstrip('_')}"

    def text(self, value: Any) -> str:
        """Return a value as an expression of its width."""
        pieces = [self._piece([net for _, net in nets]) for _, nets in groupby(enumerate(value), self._together)]
        counted = [(text, len([*equal])) for text, equal in groupby(pieces)]
        return _joined([text if count == 1 else f"{{{count}{{{text}}}}}" for text, count in counted])

    def _together(self, placed: tuple[int, Any]) -> Any:
        """Return what the bits of a value have in common that are written together."""
        place, net = placed
        if net.is_const:
            return None
        name, bit, _ = self.home.get(net, (net.cell, net.bit, 0))
        return name, bit - place

    def _piece(self, nets: list[Any]) -> str:
        if nets[0].is_const:
            return number(nets)
        if nets[0].cell in self.inline:
            return self.made(nets[0].cell)
        name, bit, width = self.home[nets[0]]
        return part(name, bit, len(nets), width)

    def made(self, cell_number: int) -> str:
        """Return the expression of a cell."""
        cell = self.circuit.cells[cell_number]
        if isinstance(cell, nir.AssignmentList):
            return self._chosen(cell)
        if isinstance(cell, nir.AsyncReadPort):
            return f"{self.memories[cell.memory]}[{self.text(cell.addr)}]"
        if len(cell.inputs) == 1:
            return self._unary(cell.operator, *cell.inputs)
        if cell.operator != "m":
            return self._binary(cell.operator, *cell.inputs)
        test, yes, no = (operand(self.text(value)) for value in cell.inputs)
        return f"{test} ? {yes} : {no}"

    def _unary(self, operator: str, a: Any) -> str:
        inner = self.circuit.source(a[0]) if a[0].is_cell and a[0].cell in self.inline else None
        if operator == "~" and isinstance(inner, nir.Operator) and a == self.circuit.whole[a[0].cell]:
            if inner.operator in _OPPOSITE:
                return self._binary(_OPPOSITE[inner.operator], *inner.inputs)
            if inner.operator == "~":
                return self.text(inner.inputs[0])
        return f"{operator.removeprefix('r')}{operand(self.text(a))}"

    def _binary(self, operator: str, a: Any, b: Any) -> str:
        if operator == "*":
            return self._product(a, b)
        if operator == "s>>":
            return f"$signed({self.text(a)}) >>> {operand(self.text(b))}"
        if operator == "s<" and not any(b):
            return self.text(a[-1:])
        if operator[0] == "s":
            return f"$signed({self.text(a)}) {operator[1:]} $signed({self.text(b)})"
        if operator == "+" and b.is_const and b[-1] == 1 and len(b) > 1:
            operator, b = "-", nir.Value.from_const(-number_of(b), len(b))
        left = self.text(a)
        if operator == "==" and len(a) == 1 and b.is_const:
            return left if b[0] == 1 else f"~{operand(left)}"
        right = self.literal(a, b) if operator in _OPPOSITE and b.is_const else operand(self.text(b))
        same = operator in "&|^" and _outside(left).split()[1:2] == [operator]
        return f"{left if same else operand(left)} {operator.removeprefix('u')} {right}"

    def _product(self, a: Any, b: Any) -> str:
        """Return a product whose factors have no bits that only extend them."""
        signed = any(len(value) > 1 and value[-1] == value[-2] and value[-1].is_cell for value in (a, b))
        factors = []
        for value in (a, b):
            while len(value) > 1 and value[-1] == (value[-2] if signed else 0):
                value = value[:-1]
            factors.append(f"$signed({self.text(value)})" if signed else operand(self.text(value)))
        return " * ".join(factors)

    def literal(self, value: Any, constant: Any) -> str:
        """Return a constant that a value is compared with: of an enumeration, its name."""
        kind, names = self.kinds.get(value, ("", {}))
        made = len(constant), number(constant)
        if number_of(constant) not in names:
            return made[1]
        name = plain(f"{kind}_{names[number_of(constant)]}").upper()
        if self.constants.setdefault(name, made) != made:
            return made[1]  # of another enumeration
        self.taken.add(name)
        return name

    def indexed(self, cell: Any, name: str) -> tuple[list[str], str]:
        """Return lines above the definition of a part that a value chooses, and its expression.

        What is no name becomes a vector; it is as wide as the index reaches, which tools compare.
        """
        width, value = cell.width, cell.value
        fill = value[-1] if cell.value_signed else nir.Net.from_const(0)
        reach = (cell.stride << len(cell.offset)) - cell.stride + width
        value = nir.Value([*value, *[fill] * (reach - len(value))])[:reach]
        lines, vector = [], self.text(value)
        if not vector.isidentifier():
            digits = f"{reach}'h{number_of(value):0{-(-reach // 4)}x}" if value.is_const else vector
            vector = self.unique(f"{name}_{'table' if value.is_const else 'from'}", True)
            lines.append(f"wire {span(reach)}{vector} = {digits};")
        place = [*nir.Value.zeros(cell.stride.bit_length() - 1), *cell.offset]
        at = self.text(nir.Value([*place, *nir.Value.zeros((reach - 1).bit_length() - len(place))]))
        return lines, f"{vector}[{at}]" if width == 1 else f"{vector}[{at} +: {width}]"

    def tree(self, cell: Any, low: int = 0, high: int = 1 << 16) -> Body:
        """Return the assignments of a choice as nested lists, as far as they set bits from `low` below `high`."""
        root: Body = []
        for each in cell.assignments:
            body = root
            for net in reversed(self.circuit.tests(each.cond)):
                if not (body and body[-1][:2] == ("if", net.cell)):
                    body.append(("if", net.cell, [[] for _ in self.circuit.source(net).inputs]))
                body = body[-1][2][net.bit]
            first, last = max(each.start, low), min(each.start + len(each.value), high)
            if first < last:
                body.append(("=", first - low, each.value[first - each.start : last - each.start]))
        return root

    def cases(self, test: int, bodies: Iterable[Body]) -> Iterator[tuple[Any, Body]]:
        """Yield the cases of a choice that can be, with their bodies; the last may be None, which is met otherwise.

        Others are lists of patterns, which are lists of nets with their levels.
        """
        for net, body in zip(self.circuit.cells[test].inputs, bodies, strict=True):
            patterns = []
            for pattern in self.circuit.source(net).patterns if net.is_cell else ():
                placed = zip(self.circuit.source(net).value, reversed(pattern), strict=True)
                levels = [(bit, int(level)) for bit, level in placed if level != "-"]
                if all(bit == level for bit, level in levels if bit.is_const):
                    patterns.append([(bit, level) for bit, level in levels if bit.is_cell])
            if net.is_const or [] in patterns:
                yield None, body
                return
            if patterns:
                yield patterns, body

    def compared(self, full: Iterable[tuple[Any, Body]]) -> Any:
        """Return the value that all cases compare with different numbers; empty if there is none."""
        levels = [tuple(level) for patterns, _ in full for level in patterns or ()]
        compared = {nir.Value(net for net, _ in one) for one in levels}
        return compared.pop() if len(compared) == 1 and len(levels) == len({*levels}) else ()

    def condition(self, patterns: Any) -> str:
        """Return whether a value has one of the patterns."""
        made = []
        for pattern in patterns or ():
            nets, levels = nir.Value(net for net, _ in pattern), [level for _, level in pattern]
            made.append(self._binary("==", nets, nir.Value(map(nir.Net.from_const, levels))))
        return made[0] if len(made) == 1 else " | ".join(map(operand, made))

    def _chosen(self, cell: Any) -> str:
        """Return a choice as an expression; the bits between two cuts are chosen together."""
        ends = ((each.start, each.start + len(each.value)) for each in cell.assignments)
        cuts = sorted({0, len(cell.default)}.union(*ends))
        pieces = [(self.tree(cell, low, high), cell.default[low:high]) for low, high in pairwise(cuts)]
        return _joined([self._evaluated(tree, self.text(default), len(default)) for tree, default in pieces])

    def _evaluated(self, body: Body, now: str, width: int) -> str:
        """Return a value after some assignments; `now` is the value before them."""
        for kind, which, what in body:
            if kind == "=":
                now = self.text(what)
                continue
            full = [*self.cases(which, what)]
            branches = [(self.condition(patterns), self._evaluated(inner, now, width)) for patterns, inner in full]
            last = branches.pop()[1] if full and full[-1][0] is None else now
            if self.compared(full):
                branches = [one for one in branches if one[1] != last]
                if len(branches) > _LONGEST_CHAIN:  # synthesis takes fewer cells for a sum of products
                    terms = " | ".join(f"({{{width}{{{test}}}}} & {operand(then)})" for test, then in branches)
                    branches = [(" | ".join(operand(test) for test, _ in branches), terms)]
            while branches and branches[-1][1] == last:
                branches.pop()
            for condition, then in reversed(branches):
                test, bits = operand(condition), (then, last)
                last = f"{test} ? {operand(then)} : {last}" if bits != ("1'b1", "1'b0") else condition
            now = last
        return now

    def statements(self, body: Body, indent: int) -> Iterator[str]:
        """Yield the assignments of registers, each with the register and its first bit in the place of the bit."""
        pad = "    " * indent
        for kind, which, what in body:
            if kind == "=":
                (name, width), first = which
                yield f"{pad}{part(name, first, len(what), width)} <= {self.text(what)};"
                continue
            full = [*self.cases(which, what)]
            while full and not full[-1][1]:
                full.pop()
            if len(full) > 2 and len(value := self.compared(full)) > 1:
                yield f"{pad}case ({self.text(value)})"
                for patterns, inner in full:
                    levels = [self.literal(value, [level for _, level in one]) for one in patterns or ()]
                    yield f"{pad}    {', '.join(levels) or 'default'}: begin"
                    yield from self.statements(inner, indent + 2)
                    yield f"{pad}    end"
                yield f"{pad}endcase"
                continue
            word = "if"
            for patterns, inner in full:
                if patterns is not None:
                    yield f"{pad}{word} ({self.condition(patterns)}) begin"
                elif len(full) > 1:
                    yield f"{pad}end else begin"
                yield from self.statements(inner, indent + (patterns is not None or len(full) > 1))
                word = "end else if"
            if full and full[0][0] is not None:
                yield f"{pad}end"

    def meaning(self, cell_number: int) -> str:
        """Return a name for a cell that has none: of its low bits, its reader, or its operands."""
        circuit, whole = self.circuit, self.circuit.whole[cell_number]
        cell = circuit.cells[cell_number]
        for value, names in self.called.items():
            if len(value) < len(whole) and value == whole[: len(value)]:
                return f"{names[0]}_wide"
        operator = _operator(cell)
        if operator in _WORDS and all(net.is_const or net in self.home for value in cell.inputs for net in value):
            a = cell.inputs[0]
            texts = [self.literal(a, value) if value.is_const else self.text(value) for value in cell.inputs]
            bare = (plain(re.sub(r"^\d+'[bdh]", "", text)).strip("_").lower() for text in texts)
            made = f"_{_WORDS[operator]}_".join(bare)
            if len(made) <= _LONGEST_NAME and made[0].isalpha():
                return made
        kind = "next" if isinstance(cell, nir.AssignmentList) else _KINDS.get(operator, "")
        todo = [cell_number]
        for at in todo:
            for reader in sorted({reader for reader, *_ in circuit.reads[at]} - {*todo}):
                if reader in self.own and circuit.whole[reader] in self.called:
                    return f"{self.called[circuit.whole[reader]][0]}_{kind or ('if' if len(whole) == 1 else 'part')}"
                todo += [reader] * (reader in self.own)
        return self.near(whole) or kind or "term"

    def folded(self, cell_number: int) -> int | None:
        """Return the choice that is the next value of a register, and read by nothing else."""
        circuit, data = self.circuit, self.circuit.cells[cell_number].data
        choice = data[0].cell
        other = circuit.cells[choice]
        alone = data == circuit.whole.get(choice) and len(circuit.reads[choice]) == 1
        return choice if alone and isinstance(other, nir.AssignmentList) and other.module_idx == self.index else None

    def is_inline(self, cell_number: int) -> bool:
        """Return whether a cell is written where it is read: it has no name, and is read once and as a whole."""
        circuit, whole = self.circuit, self.circuit.whole[cell_number]
        cell, reads = circuit.cells[cell_number], circuit.reads[cell_number]
        if isinstance(cell, nir.AssignmentList) and len(cell.assignments) > _LONGEST_CHOICE:
            return False
        alone = isinstance(cell, (nir.Part, nir.AsyncReadPort)) or _operator(cell) in ("*", "s>>")
        if alone or whole in self.called or not circuit.flow[self.index].keys().isdisjoint(whole):
            return False
        trivial = _operator(cell) == "~" and len(whole) == 1
        return (len(reads) == 1 or trivial) and {(first, count) for _, first, count in reads} <= {(0, len(whole))}


def _operator(cell: Any) -> str:
    return cell.operator if isinstance(cell, nir.Operator) else ""


def merge(into: Body, body: Body, register: tuple[str, int]) -> None:
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
            merge(mine, theirs, register)
        place = found + 1
