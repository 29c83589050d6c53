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

from tachometry.hdl.export.netlist import Circuit, extended, number_of, operator_of
from tachometry.hdl.export.render import span
from tachometry.spec.registers.manifest import KEYWORDS

_KINDS = dict(zip(["+", "-", "*", "m"], ["sum", "difference", "product", "choice"], strict=True))
_KINDS |= dict.fromkeys(["<<", "u>>", "s>>"], "shifted")
_WORDS = {"==": "is", "!=": "is_not", "u<": "below", "u>=": "from", "u>": "above", "u<=": "to", "&": "and", "|": "or"}
_WORDS |= {"^": "xor", "+": "plus", "-": "minus", "s<": "below", "s>=": "from"}
_OPPOSITE = {"==": "!=", "!=": "==", "~": ""}
_CHAINS = {"+": "+-", "-": "+-", "&": "&", "|": "|", "^": "^"}  # operators of one precedence, whose order is free
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


def operand(text: str, chain: str = "") -> str:
    """Return an expression as it stands within another; operators of a chain need no brackets."""
    bare = text
    while (less := _BRACKETS.sub("_", bare)) != bare:
        bare = less
    bound = all(each in chain for each in bare.split()[1::2])
    return text if bound and not bare.startswith(("&", "|", "^", "-")) else f"({text})"


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
        """Return a value as an expression of its width; none has the address in a memory of one word."""
        pieces = []
        for (name, shift, width), placed in groupby(enumerate(value), self._source):
            place, *more = (place for place, _ in placed)
            if value[place].is_const:
                pieces.append(number(value[place : place + 1 + len(more)]))
            else:
                pieces.append(
                    part(name, place + shift, 1 + len(more), width) if width else self.made(value[place].cell)
                )
        counted = [(text, len([*equal])) for text, equal in groupby(pieces)]
        return _joined([text if count == 1 else f"{{{count}{{{text}}}}}" for text, count in counted] or ["1'd0"])

    def _source(self, placed: tuple[int, Any]) -> tuple[Any, int, int]:
        """Return what the bits of a value have in common that are written together: name, shift and width."""
        place, net = placed
        name, bit, width = ("", place, 0) if net.is_const else self.home.get(net, (net.cell, net.bit, 0))
        return name, bit - place, width

    def made(self, cell_number: int) -> str:
        """Return the expression of a cell."""
        cell = self.circuit.cells[cell_number]
        if isinstance(cell, nir.AssignmentList):
            return self._chosen(cell)
        if isinstance(cell, nir.AsyncReadPort):
            return f"{self.memories[cell.memory]}[{self.text(cell.addr)}]"
        operator, inputs = self._meant(cell)
        if len(inputs) == 1:
            return f"{operator.removeprefix('r')}{operand(self.text(*inputs))}"
        if operator != "m":
            return self._binary(operator, *inputs)
        test, yes, no = (operand(self.text(value)) for value in inputs)
        return f"{test} ? {yes} : {no}"

    def _meant(self, cell: Any) -> tuple[str, Any]:
        """Return the operator and the operands of a cell; of one that negates another, those of its opposite."""
        operator, inputs = operator_of(cell), [*self.circuit.inputs(cell)]
        inner: Any = self.circuit.source(inputs[0][0]) if operator == "~" and inputs[0][0].is_cell else None
        if operator_of(inner) in _OPPOSITE and self.is_inline(inputs[0][0].cell):
            return _OPPOSITE[inner.operator], inner.inputs
        return operator, inputs

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
        left, chain = self.text(a), _CHAINS.get(operator, "")
        if operator == "==" and len(a) == 1 and b.is_const:
            return left if b[0] == 1 else f"~{operand(left)}"
        compared = operator in _OPPOSITE and b.is_const
        right = self.literal(a, b) if compared else operand(self.text(b), chain if operator != "-" else "")
        return f"{operand(left, chain)} {operator.removeprefix('u')} {right}"

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
        name = plain(f"{kind}_{names.get(number_of(constant))}").upper()
        if number_of(constant) not in names or self.constants.setdefault(name, made) != made:
            return made[1]  # of no enumeration, or of another one
        self.taken.add(name)
        return name

    def indexed(self, cell: Any, name: str) -> tuple[list[str], str]:
        """Return the vector, as wide as its index reaches, above a part that a value chooses, and the expression."""
        width, reach = cell.width, (cell.stride << len(cell.offset)) - cell.stride + cell.width
        value = extended(cell.value if cell.value_signed else [*cell.value, *nir.Value.zeros(1)], reach)[:reach]
        lines, vector = [], self.text(value)
        if not vector.isidentifier():
            digits = f"{reach}'h{number_of(value):0{-(-reach // 4)}x}" if value.is_const else vector
            vector = self.unique(f"{name}_{'table' if value.is_const else 'from'}", True)
            lines.append(f"wire {span(reach)}{vector} = {digits};")
        bits = (reach - 1).bit_length()
        at = self.text(nir.Value([*cell.offset, *nir.Value.zeros(bits - len(cell.offset))]))
        at += f" * {bits}'d{cell.stride}" if cell.stride > 1 else ""
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
        """Yield the possible cases of a choice: patterns (values and levels), or None for all others, and bodies."""
        for net, body in zip(self.circuit.cells[test].inputs, bodies, strict=True):
            patterns = []
            for pattern in self.circuit.source(net).patterns if net.is_cell else ():
                levels = zip(self.circuit.source(net).value, reversed(pattern), strict=True)
                tests = [(bit, nir.Net.from_const(int(level))) for bit, level in levels if level != "-"]
                if all(bit == level for bit, level in tests if bit.is_const):
                    patterns.append([*map(nir.Value, zip(*(test for test in tests if test[0].is_cell), strict=True))])
            if net.is_const or [] in patterns:
                yield None, body
                return
            if patterns:
                yield patterns, body

    def compared(self, full: Iterable[tuple[Any, Body]]) -> Any:
        """Return the value that all cases compare with different numbers; empty if there is none."""
        tests = [(value, levels) for patterns, _ in full for value, levels in patterns or ()]
        values = {value for value, _ in tests}
        return values.pop() if len(values) == 1 and len(tests) == len({*tests}) else ()

    def condition(self, patterns: Any) -> str:
        """Return whether a value has one of the patterns."""
        made = [self._binary("==", *pattern) for pattern in patterns or ()]
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
                    bits = [test if to == "1'b1" else f"{{{width}{{{test}}}}} & {operand(to)}" for test, to in branches]
                    tests, terms = (" | ".join(map(operand, each)) for each in ([one[0] for one in branches], bits))
                    branches, last = ([], terms) if last in ("1'b0", f"{width}'d0") else ([(tests, terms)], last)
            for condition, then in reversed(branches):
                if then != last:
                    chosen = f"{operand(condition)} ? {operand(then)} : {last}"
                    last = condition if (then, last) == ("1'b1", "1'b0") else chosen
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
            if len(full) > 2 and len(value := self.compared(full)) > 1:
                yield f"{pad}case ({self.text(value)})"
                for patterns, inner in full:
                    levels = [self.literal(value, level) for _, level in patterns or ()]
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
        operator, inputs = self._meant(cell)
        if operator in _WORDS and all(net.is_const or net in self.home for value in inputs for net in value):
            texts = [self.literal(inputs[0], value) if value.is_const else self.text(value) for value in inputs]
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
        long = isinstance(cell, nir.AssignmentList) and len(cell.assignments) > _LONGEST_CHOICE
        alone = long or isinstance(cell, (nir.Part, nir.AsyncReadPort)) or operator_of(cell) in ("*", "s>>")
        if alone or whole in self.called or not circuit.flow[self.index].keys().isdisjoint(whole):
            return False
        trivial = self._meant(cell)[0] == "~" and len(whole) == 1
        return (len(reads) == 1 or trivial) and {(first, count) for _, first, count in reads} <= {(0, len(whole))}


def merge(into: Body, body: Body, register: tuple[str, int]) -> None:
    """Add the assignments of a register to those of others, in its order, under the tests that they share."""
    place = 0
    for count, (kind, which, what) in enumerate(body):
        if kind == "=":
            while place < len(into) and into[place][0] == "=":
                place += 1
            into.insert(place, ("=", (register, which), what))
        else:
            tests = [each[:2] for each in into]
            shared = (tests.index(each[:2], place) for each in body[count:] if each[:2] in tests[place:])
            place = next(shared, len(into))  # before the next test that is there already
            if (kind, which) not in tests[place:][:1]:
                into.insert(place, (kind, which, [[] for _ in what]))
            for mine, theirs in zip(into[place][2], what, strict=True):
                merge(mine, theirs, register)
        place += 1
