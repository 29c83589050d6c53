"""Amaranth's netlist of a core, made smaller without a change of its meaning.

The netlist is a private interface of Amaranth: an unknown kind of cell is an error that names it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any

from amaranth.hdl import _ir
from amaranth.hdl import _nir as nir

OPERATORS = set("b r| r& r^ ~ - + * & | ^ << u>> s>> == != u< u> u<= u>= s< s> s<= s>= m".split())
_LOW = set("+ - * & | ^ ~ << m".split())  # whose low bits need only low bits
_SHARED = nir.Operator | nir.Matches | nir.PriorityMatch  # those of a module that are equal are written once
_FORMS = nir.Top | nir.Matches | nir.PriorityMatch | nir.AssignmentList | nir.Memory | nir.AsyncReadPort
_FORMS |= nir.Operator | nir.FlipFlop | nir.Part | nir.SyncReadPort | nir.SyncWritePort
_LONGEST_INDEX = 9  # bits of an index into a vector


class Unwritten(ValueError):
    """A cell of the netlist that has no legible form."""


def number_of(value: Iterable[int]) -> int:
    """Return the number that constant nets are."""
    return sum(net << place for place, net in enumerate(value))


def runs(value: Any) -> Iterator[tuple[Any, int]]:
    """Yield the first net and the length of each piece of a cell that is in a value, from bit 0 on."""
    for _, placed in groupby(enumerate(value), lambda one: one[1] - one[0] if one[1].is_cell else None):
        nets = [net for _, net in placed if net.is_cell]
        yield from [(nets[0], len(nets))] if nets else []


def lanes(port: Any) -> Iterator[tuple[Any, int, int]]:
    """Yield the enables of a port that writes, each with the first bit that it enables and the one behind the last."""
    for _, bits in groupby(range(len(port.en)), port.en.__getitem__):
        first, *rest = bits
        yield nir.Value(port.en[first]), first, first + len(rest) + 1


def operator_of(cell: Any) -> str:
    """Return the operator of a cell; "" of others."""
    return cell.operator if isinstance(cell, nir.Operator) else ""


class Circuit(nir.Netlist):
    """A netlist whose equal operators stand once, without the bits that nobody reads."""

    def __init__(self, design: Any) -> None:
        self.__dict__ |= vars(_ir.build_netlist(design))
        for cell in self.cells:
            self._check(cell)
        self.whole = {cell: nir.Value(sorted(made.output_nets(cell))) for cell, made in enumerate(self.cells)}
        self.connections: dict[Any, Any] = {}  # nets, by those in whose place they are read
        while self._simplify():
            self.resolve_all_nets()
        self._follow()
        while self._widen() or self._trim():
            self._follow()
        self.flow: list[dict[Any, str]] = [{} for _ in self.modules]  # nets that cross the boundary of a module
        for number, reads in self.reads.items():
            for reader, first, count in reads:
                for bit in range(first, first + count):
                    self._lead(nir.Net.from_cell(number, bit), self.cells[reader].module_idx)

    def _check(self, cell: Any) -> None:
        kind = type(cell).__name__
        match cell:
            case nir.Operator() if cell.operator not in OPERATORS:
                kind += f" {cell.operator}"
            case nir.Instance():
                kind += f" {cell.type} ({cell.name})"
            case nir.FlipFlop() if cell.arst != 0:
                kind += " with an asynchronous reset"
            case nir.Part() if len(cell.offset) > _LONGEST_INDEX:
                kind += f" with {len(cell.offset)} bits of index"
            case _ if isinstance(cell, _FORMS):
                return
        where = ".".join(self.modules[cell.module_idx].name)
        raise Unwritten(f"--writer must be yosys for {kind} in {where}: legible Verilog has no form for it")

    def resolve_net(self, net: Any) -> Any:
        while net in self.connections:  # Amaranth's cells ask for the net that is read in the place of another
            net = self.connections[net]
        return net

    def resolve_value(self, value: Any) -> Any:
        return value if self.connections.keys().isdisjoint(value) else nir.Value(map(self.resolve_net, value))

    def source(self, net: Any) -> Any:
        """Return the cell that makes a net."""
        return self.cells[net.cell]

    def tests(self, condition: Any) -> list[Any]:
        """Return the cases in which an assignment is made, the innermost first."""
        return [condition, *self.tests(self.source(condition).en)] if condition.is_cell else []

    def inputs(self, cell: Any) -> Iterator[Any]:
        """Yield all values that a cell reads; of assignments, also those that choose between them."""
        match cell:
            case nir.Top():
                yield from cell.ports_o.values()
            case nir.Operator():
                yield from cell.inputs
            case nir.Part():
                yield from (cell.value, cell.offset)
            case nir.AssignmentList():
                yield cell.default
                yield from (each.value for each in cell.assignments)
                tests = (net.cell for each in cell.assignments for net in self.tests(each.cond))
                for test in dict.fromkeys(tests):
                    cases = [net for net in self.cells[test].inputs if net.is_cell]
                    yield from dict.fromkeys(self.source(net).value for net in cases)
            case nir.FlipFlop():
                yield from (cell.data, nir.Value(cell.clk))
            case nir.AsyncReadPort():
                yield cell.addr
            case nir.SyncReadPort():
                yield from (cell.addr, nir.Value(cell.en), nir.Value(cell.clk))
                yield from (value for port in cell.transparent_for for value in self.inputs(self.cells[port]))
            case nir.SyncWritePort():
                yield from (cell.addr, nir.Value(cell.clk))
                yield from (value for enable, first, last in lanes(cell) for value in (enable, cell.data[first:last]))

    def _simplify(self) -> bool:
        """Find wires for cells that only lead bits on, and for all but one of equal ones of a module."""
        before, first = len(self.connections), dict[Any, int]()
        for number, cell in enumerate(self.cells):
            whole = self.whole[number]
            if not whole or whole[0] in self.connections:
                continue
            cell.resolve_nets(self)  # cells are mostly behind those that they read
            match isinstance(cell, nir.Operator) and (cell.operator, *cell.inputs):
                case "b" | "r|", a:
                    cell.operator, cell.inputs = "!=", (a, nir.Value.zeros(len(a)))
                case "m", test, (0,), (1,):
                    cell.operator, cell.inputs = "~", (test,)
            value = _led(cell)
            if value is None and isinstance(cell, _SHARED):
                key = type(cell), *(vars(cell) | {"src_loc": None}).values()
                value = self.whole[first.setdefault(key, number)]
            self.connections |= {bit: net for bit, net in zip(whole, value or (), strict=False) if bit != net}
        return len(self.connections) > before

    def _widen(self) -> bool:
        """Extend the terms of a sum that another extends, as tools join sums of one width; return whether any is."""
        changed = False
        for number, reads in self.reads.items():
            term, whole, outer = self.cells[number], self.whole[number], self.cells[reads[0][0]]
            if {reader for reader, *_ in reads} != {reads[0][0]} or not {*map(operator_of, (term, outer))} <= {*"+-"}:
                continue
            for value in outer.inputs:
                exact = all(each[-2:-1] == each[-1:] for each in term.inputs)  # without a carry into the sign
                if exact and value == extended(whole, len(value)) != whole:
                    term.inputs = tuple(extended(each, len(value)) for each in term.inputs)
                    self.whole[number] = nir.Value(nir.Net.from_cell(number, bit) for bit in range(len(value)))
                    outer.inputs = tuple(self.whole[number] if each == value else each for each in outer.inputs)
                    changed = True
        return changed

    def _trim(self) -> bool:
        """Take bits away from sums and the like that nothing reads; return whether there were any."""
        changed = False
        for number, reads in self.reads.items():
            cell, width = self.cells[number], max(first + count for _, first, count in reads)
            if width == len(self.whole[number]):
                continue
            if operator_of(cell) in _LOW:
                keep = {"m": (1, width, width), "<<": (width, 1 << 16)}.get(cell.operator, (width, width))
                cell.inputs = tuple(value[:most] for value, most in zip(cell.inputs, keep, strict=False))
            elif isinstance(cell, nir.AssignmentList):
                cell.default = cell.default[:width]
                cell.assignments = tuple(each for each in cell.assignments if each.start < width)
                for each in cell.assignments:
                    each.value = each.value[: width - each.start]
            else:
                continue
            self.whole[number], changed = self.whole[number][:width], True
        return changed

    def _follow(self) -> None:
        """Note the cells on which an output depends, and by what and in what pieces each is read."""
        self.live: set[int] = set()
        self.reads: dict[int, list[tuple[int, int, int]]] = defaultdict(list)  # by cell: reader, first bit, length
        todo = [0]
        while todo:
            number = todo.pop()
            if number in self.live:
                continue
            self.live.add(number)
            cell = self.cells[number]
            if isinstance(cell, (nir.AsyncReadPort, nir.SyncReadPort)):
                writes = (port for port, each in enumerate(self.cells) if isinstance(each, nir.SyncWritePort))
                todo += [cell.memory, *(port for port in writes if self.cells[port].memory == cell.memory)]
            for first, count in (run for value in self.inputs(cell) for run in runs(value)):
                self.reads[first.cell].append((number, first.bit, count))
                todo.append(first.cell)

    def _lead(self, net: Any, to: int) -> None:
        """Lead a net from the module that has its cell to another, through those between them."""
        source = self.source(net).module_idx
        while source != to:
            if len(self.modules[source].name) >= len(self.modules[to].name):
                self.flow[source][net] = "output"
                source = self.modules[source].parent
            else:
                self.flow[to].setdefault(net, "input")
                to = self.modules[to].parent


def extended(value: Any, width: int) -> Any:
    """Return a value with its last bit repeated to a width."""
    return nir.Value([*value, *value[-1:] * (width - len(value))])


def _led(cell: Any) -> Iterable[Any] | None:
    """Return the nets that a cell leads on; None if it computes."""
    if isinstance(cell, nir.AssignmentList) and all(each.cond == 1 for each in cell.assignments):
        made = list(cell.default)
        for each in cell.assignments:
            made[each.start : each.start + len(each.value)] = each.value
        return made
    if not isinstance(cell, nir.Operator):
        return None
    zero = nir.Net.from_const(0)
    match cell.operator, *cell.inputs:
        case "m", test, yes, no if test.is_const or yes == no:
            return yes if test[0] == 1 else no
        case "r&" | "r^", (net,):
            return [net]
        case "!=", a, b if len(a) == 1 and not any(b):
            return a
        case "~", a if a.is_const:
            return nir.Value.from_const(~number_of(a), len(a))
        case "==" | "!=" as operator, a, b if a == b:
            return [nir.Net.from_const(int(operator == "=="))]
        case "<<", a, b if b.is_const:
            return [*[zero] * min(number_of(b), len(a)), *a][: len(a)]
        case "u>>" | "s>>" as operator, a, b if b.is_const:
            places = min(number_of(b), len(a))
            return [*a[places:], *[a[-1] if operator == "s>>" else zero] * places]
        case "&" | "|" as operator, a, b if a.is_const or b.is_const or a == b:
            rest = nir.Net.from_const(int(operator == "|"))
            value, mask = (b, a) if a.is_const else (a, b)
            return [rest if net == rest else one for one, net in zip(value, mask, strict=True)]
        case "+" | "-" | "^", a, b if not any(b):
            return a
        case "+" | "^", a, b if not any(a):
            return b
    return None
