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
        while self._trim():
            pass
        self.live = self._live()
        self.reads: dict[int, list[tuple[int, int, int]]] = defaultdict(list)  # by cell: reader, first bit, length
        self.flow: list[dict[Any, str]] = [{} for _ in self.modules]  # nets that cross the boundary of a module
        self._follow()

    def _check(self, cell: Any) -> None:
        kind = type(cell).__name__
        match cell:
            case nir.Operator() if cell.operator not in OPERATORS:
                kind += f" {cell.operator}"
            case nir.Instance():
                kind += f" {cell.type} ({cell.name})"
            case nir.FlipFlop() if cell.arst != 0:
                kind += " with an asynchronous reset"
            case nir.Part() if cell.stride & (cell.stride - 1) or len(cell.offset) > _LONGEST_INDEX:
                kind += f" with {len(cell.offset)} bits of index in steps of {cell.stride}"
            case nir.SyncReadPort() if cell.transparent_for:
                kind += " with transparency"
            case nir.SyncWritePort() if len({*cell.en}) > 1:
                kind += " with enables of lanes"
            case _ if isinstance(cell, _FORMS):
                return
        where = ".".join(self.modules[cell.module_idx].name)
        raise Unwritten(f"--writer must be yosys for {kind} in {where}: legible Verilog has no form for it")

    def resolve_net(self, net: Any) -> Any:
        """Return the net that is read in the place of another; Amaranth's cells ask for it."""
        while net in self.connections:
            net = self.connections[net]
        return net

    def resolve_value(self, value: Any) -> Any:
        """Return the nets that are read in the place of others."""
        return value if self.connections.keys().isdisjoint(value) else nir.Value(map(self.resolve_net, value))

    def source(self, net: Any) -> Any:
        """Return the cell that makes a net."""
        return self.cells[net.cell]

    def tests(self, condition: Any) -> list[Any]:
        """Return the cases in which an assignment is made, the innermost first."""
        found = []
        while condition.is_cell:
            found.append(condition)
            condition = self.source(condition).en
        return found

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
            case nir.SyncWritePort():
                yield from (cell.data, cell.addr, nir.Value(dict.fromkeys(cell.en)), nir.Value(cell.clk))

    def _simplify(self) -> bool:
        """Find wires for cells that only lead bits on, and for all but one of equal ones of a module."""
        before, first = len(self.connections), dict[Any, int]()
        for number, cell in enumerate(self.cells):
            whole = self.whole[number]
            if not whole or whole[0] in self.connections:
                continue
            match isinstance(cell, nir.Operator) and (cell.operator, *cell.inputs):
                case "b" | "r|", a:
                    cell.operator, cell.inputs = "!=", (a, nir.Value.zeros(len(a)))
                case "m", test, (0,), (1,):
                    cell.operator, cell.inputs = "~", (test,)
            value, key = _led(cell), _key(cell)
            if value is None and key:
                value = self.whole[first.setdefault((cell.module_idx, *key), number)]
            self.connections |= {bit: net for bit, net in zip(whole, value or (), strict=False) if bit != net}
        return len(self.connections) > before

    def _trim(self) -> bool:
        """Take bits away from sums and the like that nothing reads; return whether there were any."""
        used: dict[int, int] = defaultdict(int)
        for number in self._live():
            for net in (net for value in self.inputs(self.cells[number]) for net in value if net.is_cell):
                used[net.cell] = max(used[net.cell], net.bit + 1)
        changed = False
        for number, width in used.items():
            cell = self.cells[number]
            if width == len(self.whole[number]):
                continue
            if isinstance(cell, nir.Operator) and cell.operator in _LOW:
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

    def _live(self) -> set[int]:
        """Return the cells on which an output depends."""
        live, todo = set[int](), [0]
        while todo:
            number = todo.pop()
            if number in live:
                continue
            live.add(number)
            cell = self.cells[number]
            if isinstance(cell, (nir.AsyncReadPort, nir.SyncReadPort)):
                writes = (port for port, each in enumerate(self.cells) if isinstance(each, nir.SyncWritePort))
                todo += [cell.memory, *(port for port in writes if self.cells[port].memory == cell.memory)]
            todo += [net.cell for value in self.inputs(cell) for net in value if net.is_cell]
        return live

    def _follow(self) -> None:
        """Note by what and in what pieces each cell is read, and lead nets through modules."""
        for number in sorted(self.live):
            cell = self.cells[number]
            for value in self.inputs(cell):
                for first, count in runs(value):
                    self.reads[first.cell].append((number, first.bit, count))
                    for bit in range(count):
                        self._lead(nir.Net(first + bit), cell.module_idx)

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


def _key(cell: Any) -> tuple[Any, ...]:
    """Return what cells that compute the same have in common; nothing of registers and memories."""
    match cell:
        case nir.Operator():
            return cell.operator, cell.inputs
        case nir.Matches():
            return cell.value, cell.patterns
        case nir.PriorityMatch():
            return "priority", cell.en, cell.inputs
    return ()


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
        case "m", test, (1,), (0,):
            return test
        case "m", test, yes, no if test.is_const or yes == no:
            return yes if test[0] == 1 else no
        case "r&" | "r^", a if len(a) == 1:
            return a
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
