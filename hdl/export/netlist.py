"""Amaranth's netlist of a core, made smaller without a change of its meaning.

The netlist is a private interface of Amaranth: an unknown kind of cell is an error that names it.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from amaranth.hdl import _ir
from amaranth.hdl._nir import (
    AssignmentList,
    AsyncReadPort,
    FlipFlop,
    Instance,
    Matches,
    Memory,
    Net,
    Operator,
    Part,
    PriorityMatch,
    SyncReadPort,
    SyncWritePort,
    Top,
    Value,
)

OPERATORS = set("b r| r& r^ ~ - + * & | ^ << u>> s>> == != u< u> u<= u>= s< s> s<= s>= m".split())
_LOW = {"+", "-", "*", "&", "|", "^", "~", "<<", "m"}  # whose low bits need only low bits
_OTHERS = (Top, Part, Matches, PriorityMatch, AssignmentList, Memory, AsyncReadPort, SyncReadPort, SyncWritePort)
_VALUED = (Operator, Part, AssignmentList, FlipFlop, AsyncReadPort, SyncReadPort)  # those with bits of a text


class Unwritten(ValueError):
    """A cell of the netlist that has no legible form."""


def bits_of(cell: int, width: int) -> Any:
    """Return the nets of a cell, the lowest first."""
    return Value(Net.from_cell(cell, bit) for bit in range(width))


def number_of(value: Iterable[int]) -> int:
    """Return the number that constant nets are."""
    return sum(net << place for place, net in enumerate(value))


def runs(value: Any) -> Iterator[tuple[Any, int]]:
    """Yield the first net and the length of each piece of a value, from bit 0 on; constants are pieces of one bit."""
    place = 0
    while place < len(value):
        end = place + 1
        while end < len(value) and value[place].is_cell and value[end] == value[place] + end - place:
            end += 1
        yield value[place], end - place
        place = end


@dataclass(frozen=True)
class _Wiring:
    """Other nets in place of some; Amaranth's cells take it where they resolve their nets."""

    to: dict[int, Any]

    def resolve_net(self, net: Any) -> Any:
        while net in self.to:
            net = self.to[net]
        return net

    def resolve_value(self, value: Any) -> Any:
        return value if self.to.keys().isdisjoint(value) else Value(map(self.resolve_net, value))


class Circuit:
    """A netlist whose equal operators stand once, without the bits that nobody reads."""

    def __init__(self, design: Any) -> None:
        self.netlist = _ir.build_netlist(design)
        self.cells, self.modules = self.netlist.cells, self.netlist.modules
        for cell in self.cells:
            self._check(cell)
        self.width = {number: _width(cell) for number, cell in enumerate(self.cells) if isinstance(cell, _VALUED)}
        self._gone: set[int] = set()  # cells that are read no more
        while self._fold() or self._share():
            pass
        while self._trim():
            pass
        self.live = self._live()
        self._follow()

    def _check(self, cell: Any) -> None:
        kind = type(cell).__name__
        if isinstance(cell, Operator) and cell.operator not in OPERATORS:
            kind = f"Operator {cell.operator}"
        elif isinstance(cell, Instance):
            kind = f"Instance {cell.type} ({cell.name})"
        elif isinstance(cell, FlipFlop) and cell.arst != 0:
            kind = "FlipFlop with an asynchronous reset"
        elif isinstance(cell, (Operator, FlipFlop, *_OTHERS)):
            return
        where = ".".join(self.modules[cell.module_idx].name)
        raise Unwritten(f"--writer must be yosys for {kind} in {where}: legible Verilog has no form for it")

    def whole(self, number: int) -> Any:
        """Return all nets of a cell that are left."""
        return bits_of(number, self.width.get(number, 0))

    def source(self, net: Any) -> Any:
        """Return the cell that makes a net."""
        return self.cells[net.cell]

    def tests(self, cell: Any) -> list[int]:
        """Return the choices between cases on which the assignments of a cell depend."""
        found: dict[int, None] = {}
        for each in cell.assignments:
            condition = each.cond
            while condition.is_cell:
                found[condition.cell] = None
                condition = self.source(condition).en
        return [*found]

    def inputs(self, cell: Any) -> Iterator[Any]:
        """Yield all values that a cell reads; of assignments, also those that choose between them."""
        match cell:
            case Top():
                yield from cell.ports_o.values()
            case Operator():
                yield from cell.inputs
            case Part():
                yield from (cell.value, cell.offset)
            case AssignmentList():
                yield cell.default
                yield from (each.value for each in cell.assignments)
                for test in self.tests(cell):
                    cases = [net for net in self.cells[test].inputs if net.is_cell]
                    yield from dict.fromkeys(self.source(net).value for net in cases)
            case FlipFlop():
                yield from (cell.data, Value(cell.clk))
            case AsyncReadPort():
                yield cell.addr
            case SyncReadPort():
                yield from (cell.addr, Value(cell.en), Value(cell.clk))
            case SyncWritePort():
                yield from (cell.data, cell.addr, Value(dict.fromkeys(cell.en)), Value(cell.clk))

    def _replace(self, to: dict[int, Any]) -> bool:
        """Have everything read other nets; return whether there are any."""
        wiring = _Wiring(to)
        for cell in self.cells if to else ():
            cell.resolve_nets(wiring)
        signals, fields = self.netlist.signals, self.netlist.signal_fields
        for signal in signals if to else ():
            signals[signal] = wiring.resolve_value(signals[signal])
            for field in fields[signal].values():
                field.value = wiring.resolve_value(field.value)
        return bool(to)

    def _share(self) -> bool:
        """Have one of equal operators of a module, and of equal tests."""
        first: dict[Any, int] = {}
        to: dict[int, Any] = {}
        for number, cell in enumerate(self.cells):
            if number in self._gone or (key := _key(cell)) is None:
                continue
            one = first.setdefault((cell.module_idx, type(cell), key), number)
            if one != number:
                width = self.width.pop(number, len(key[1]))
                to |= zip(bits_of(number, width), bits_of(one, width), strict=True)
                self._gone.add(number)
        return self._replace(to)

    def _fold(self) -> bool:
        """Have wires for cells that only lead bits on, such as assignments without a test and shifts by constants."""
        to: dict[int, Any] = {}
        for number, cell in enumerate(self.cells):
            if number not in self.width:
                continue
            value: Iterable[Any] | None = None
            if isinstance(cell, AssignmentList) and all(each.cond == 1 for each in cell.assignments):
                value = _assigned(cell)
            elif isinstance(cell, Operator):
                value = _led(cell)
            if value is not None:
                to |= {bit: net for bit, net in zip(self.whole(number), value, strict=True) if bit != net}
                del self.width[number]
                self._gone.add(number)
        return self._replace(to)

    def _trim(self) -> bool:
        """Take bits away from sums and the like that nothing reads; return whether there were any."""
        used: dict[int, int] = defaultdict(int)
        for number in self._live():
            for value in self.inputs(self.cells[number]):
                for net in value:
                    if net.is_cell:
                        used[net.cell] = max(used[net.cell], net.bit + 1)
        changed = False
        for number, width in used.items():
            cell = self.cells[number]
            if not width < self.width.get(number, 0):
                continue
            if isinstance(cell, Operator) and cell.operator in _LOW:
                keep = {"m": (1, width, width), "<<": (width, 1 << 16)}.get(cell.operator, (width, width))
                cell.inputs = tuple(value[:most] for value, most in zip(cell.inputs, keep, strict=False))
            elif isinstance(cell, AssignmentList):
                cell.default = cell.default[:width]
                cell.assignments = tuple(each for each in cell.assignments if each.start < width)
                for each in cell.assignments:
                    each.value = each.value[: width - each.start]
            else:
                continue
            self.width[number], changed = width, True
        return changed

    def _live(self) -> set[int]:
        """Return the cells on which an output depends."""
        writers = defaultdict(list)
        for number, cell in enumerate(self.cells):
            if isinstance(cell, SyncWritePort):
                writers[cell.memory].append(number)
        live: set[int] = set()
        todo = [0]
        while todo:
            number = todo.pop()
            if number in live:
                continue
            live.add(number)
            cell = self.cells[number]
            if isinstance(cell, (AsyncReadPort, SyncReadPort)):
                todo += [cell.memory, *writers[cell.memory]]
            todo += [net.cell for value in self.inputs(cell) for net in value if net.is_cell]
        return live

    def _follow(self) -> None:
        """Note how often, by what and in what pieces each cell is read, and which nets cross a module's boundary."""
        self.uses: Counter[int] = Counter()
        self.pieces: dict[int, set[tuple[int, int]]] = defaultdict(set)
        self.readers: dict[int, set[int]] = defaultdict(set)
        self.flow: list[dict[Any, str]] = [{} for _ in self.modules]
        depth = [len(module.name) for module in self.modules]
        for number in sorted(self.live):
            cell = self.cells[number]
            for value in self.inputs(cell):
                for first, count in runs(value):
                    if first.is_cell:
                        self.uses[first.cell] += 1
                        self.readers[first.cell].add(number)
                        self.pieces[first.cell].add((first.bit, count))
                        for bit in range(count):
                            self._lead(Net(first + bit), cell.module_idx, depth)

    def _lead(self, net: Any, to: int, depth: list[int]) -> None:
        """Lead a net from the module that has its cell to another, through those between them."""
        source = self.source(net).module_idx
        while source != to:
            if depth[source] >= depth[to]:
                self.flow[source][net] = "output"
                source = self.modules[source].parent
            else:
                self.flow[to].setdefault(net, "input")
                to = self.modules[to].parent


def _width(cell: Any) -> int:
    if isinstance(cell, AssignmentList):
        return len(cell.default)
    return len(cell.data) if isinstance(cell, FlipFlop) else int(cell.width)


def _key(cell: Any) -> tuple[Any, Any] | None:
    """Return what two cells of a kind have in common that compute the same; the second is as long as a test is wide."""
    match cell:
        case Operator():
            return cell.operator, cell.inputs
        case Matches():
            return cell.value, (cell.patterns,)
        case PriorityMatch():
            return cell.en, cell.inputs
    return None


def _assigned(cell: Any) -> list[Any]:
    made = list(cell.default)
    for each in cell.assignments:
        made[each.start : each.start + len(each.value)] = each.value
    return made


def _led(cell: Any) -> Iterable[Any] | None:
    """Return the nets that an operator leads on; None if it computes."""
    operator, (a, *more) = cell.operator, cell.inputs
    zero = Net.from_const(0)
    if operator == "m":
        yes, no = more
        return yes if a[0] == 1 or yes == no else no if a[0] == 0 else None
    if not more:
        if operator in ("b", "r|", "r^") and not any(a):  # of zeros, or of nothing
            return [zero]
        return a if operator in ("b", "r|", "r&", "r^") and len(a) == 1 else None
    b = more[0]
    if operator in ("==", "!=") and a == b:
        return [Net.from_const(int(operator == "=="))]
    number = number_of(b) if b.is_const else None
    if operator in ("<<", "u>>", "s>>") and number is not None:
        places = min(number, len(a))
        fill = [a[-1] if operator == "s>>" else zero] * places
        return [*fill, *a[: len(a) - places]] if operator == "<<" else [*a[places:], *fill]
    if operator in ("|", "&"):
        return _masked(operator, a, b)
    return a if operator in ("+", "-", "^") and number == 0 else None


def _masked(operator: str, a: Any, b: Any) -> Iterable[Any] | None:
    """Return the nets of a disjunction or conjunction with a constant, or with itself."""
    if a == b:
        return list(a)
    if not b.is_const:
        return None
    rest = Net.from_const(int(operator == "|"))
    return [rest if net == rest else one for one, net in zip(a, b, strict=True)]
