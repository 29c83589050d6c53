"""Modules as Verilog-2001 that an engineer can review: ports, registers, memories, and comments."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from amaranth import Module
from amaranth.hdl import _ast, _ir
from amaranth.hdl._nir import (
    AssignmentList,
    AsyncReadPort,
    FlipFlop,
    Memory,
    Net,
    Operator,
    Part,
    SyncReadPort,
    Value,
)
from amaranth.lib import wiring

from tachometry.hdl.export.expressions import is_clocked
from tachometry.hdl.export.names import number, plain, span
from tachometry.hdl.export.netlist import Circuit, runs
from tachometry.hdl.export.processes import Processes, ascii_of, attributes_of
from tachometry.hdl.wires.commented_memory import CommentedMemory
from tachometry.spec.language.port import Port

_COLUMNS = 118
_COMBINATIONAL = (Operator, Part, AssignmentList, AsyncReadPort)
_BOX = re.compile("\0(\\d+)\0")
_SENTENCE = re.compile(r"(?<=[.;])(?<!Sec\.)(?<!eqs\.)(?<!eq\.)(?<!Fig\.)(?<!p\.)\s")


@dataclass(frozen=True)
class Written:
    """The text of a core, and the names in it of what has other names in Amaranth."""

    text: str
    names: Mapping[str, str]  # paths of registers and memories, by those that Amaranth gives


class Link(NamedTuple):
    """A port of a module."""

    name: str
    way: str  # input or output
    value: Any


@dataclass
class Origin:
    """The component from which a module is."""

    kind: str = ""
    comment: str = ""
    members: dict[Any, str] = field(default_factory=lambda: _ast.SignalDict())  # names of its signals
    ports: Mapping[str, str] = field(default_factory=dict)  # of the top: comments by name, in order
    words: dict[str, Sequence[str]] = field(default_factory=dict)  # by name of a memory: comments of its words


class ModuleWriter(Processes):
    """Writes one module."""

    def __init__(self, circuit: Circuit, index: int, origin: Origin) -> None:
        super().__init__(circuit, index)
        self.origin = origin
        self.renamed: dict[str, str] = {}  # by names of Amaranth
        self.instances: list[tuple[ModuleWriter, str, str]] = []  # with their names in Amaranth, and their own
        found = self._top_ports() if index == 0 else self._boundary()
        self.ports = [Link(name if index == 0 else self.unique(name), way, value) for name, way, value in found]
        self.taken |= {port.name for port in self.ports}
        self.outputs: dict[Any, str] = {}
        for port in self.ports:
            if port.way == "input":
                self.place(port.name, port.value)
            else:
                self.outputs.setdefault(port.value, port.name)
        self.driven: set[str] = set()  # outputs that are no copies of another
        self.started: dict[str, tuple[dict[str, Any], str]] = {}  # outputs that are registers: attributes, first level
        self.declared: list[str] = []

    def _top_ports(self) -> list[Link]:
        top = self.circuit.netlist.top
        found = {
            name: Link(name, "input", Value(Net.from_cell(0, first + bit) for bit in range(width)))
            for name, (first, width) in top.ports_i.items()
        }
        found |= {name: Link(name, "output", value) for name, value in top.ports_o.items()}
        order = [*self.origin.ports, *found]
        names = sorted(dict.fromkeys(order), key=lambda name: (name != "clk", name != "rst"))
        links = [found[name] for name in names if name in found]
        return sorted(links, key=lambda link: link.way)

    def _boundary(self) -> list[Link]:
        """Return the ports that the component declares; what is led through has the name of its signal."""
        left = dict(self.circuit.flow[self.index])
        links: list[tuple[int, Link]] = []
        for place, name, value in self._fields():
            ways = {left.get(net, "") for net in value}
            if value and len(set(value)) == len(value) and len(ways) == 1 and "" not in ways:
                cell = self.circuit.source(value[0])
                own = isinstance(cell, FlipFlop) and cell.module_idx == self.index and value in self.called
                links.append((place, Link(self.called[value][0] if own else name, ways.pop(), value)))
                for net in value:
                    del left[net]
        pieces = [(Value(Net(first + bit) for bit in range(count))) for first, count in runs(sorted(left))]
        for way in ("input", "output"):
            for piece in pieces:
                value = Value(net for net in piece if left[net] == way)
                if value:
                    links.append((1 << 16, Link(self.near(value) or f"{self.module.name[-1]}_{way}", way, value)))
        key = lambda one: (one[1].way, one[1].name != "clk", one[1].name != "rst", one[0], one[1].value)  # noqa: E731
        return [link for _, link in sorted(links, key=key)]

    def _fields(self) -> list[tuple[int, str, Any]]:
        """Return names and values of signals and their fields, with the places of declared ones, which come first."""
        found, members = [], self.origin.members
        order = {name: place for place, name in enumerate(members.values())}
        for signal, name in self.module.signal_names.items():
            inner = {path: one.value for path, one in self.circuit.netlist.signal_fields[signal].items() if path}
            leaves = [path for path in inner if not any(longer[: len(path)] == path != longer for longer in inner)]
            base = members.get(signal, name)
            place = order.get(members.get(signal, ""), 1 << 16)
            found += [
                (place, "_".join([base.removesuffix("__payload"), *map(str, path)]), inner[path]) for path in leaves
            ]
            found += [(place, base, self.circuit.netlist.signals[signal])] * (not leaves)
        return sorted(found, key=lambda one: (one[0] == 1 << 16, -len(one[2]), "$" in one[1]))

    def _carrier(self, value: Any, fallback: Callable[[], str]) -> str:
        """Name a value that this module makes: the output that it is, its signal, or what it is for."""
        names = self.called.get(value, ())
        if value in self.outputs and value[0] not in self.home:
            name = self.outputs[value]
            self.driven.add(name)
        else:
            name = self.unique(names[0]) if names else self.unique(fallback(), True)
        self.renamed |= {old: name for old in names if old not in self.renamed}
        self.place(name, value)
        return name

    def lines(self, instances: Iterable[tuple[ModuleWriter, str]]) -> list[str]:
        """Return the lines of the module behind its name; `instances` have their names in Amaranth."""
        cells = self.circuit.cells
        registers = {cell: self._register_name(cell) for cell in self.own if is_clocked(cells[cell])}
        for writer, name in instances:
            self._add_instance(writer, name)
        self.memories = {cell: self.unique(cells[cell].name) for cell in self.all_of(Memory)}
        self.renamed |= {cells[cell].name: name for cell, name in self.memories.items()}
        choices = {cell: self.folded(cell) for cell in registers if isinstance(cells[cell], FlipFlop)}
        wires = self._wires({choice for choice in choices.values() if choice is not None})
        clocked = self.clocked(registers, choices)
        for cell, name in registers.items():
            self._declare(cell, name)
        words = self.origin.words
        memories = [
            line
            for cell, name in self.memories.items()
            for line in self.contents(cells[cell], name, words.get(cells[cell].name, ()))
        ]
        boxes = [line for writer, _, own in self.instances for line in self._instance(writer, own)]
        ends = [
            f"assign {port.name} = {self.text(port.value)};"
            for port in self.ports
            if port.way == "output" and port.name not in self.driven
        ]
        constants = [
            f"localparam {span(width)}{name} = {value};"
            for name, (width, value) in self.constants.items()
            if any(re.search(rf"\b{name}\b", line) for line in (*wires, *clocked))  # not in what was left out
        ]
        groups = [[*constants, *self.declared], memories, wires, clocked, boxes, ends]
        body = [line for group in groups if group for line in ("", *group)][1:]
        body = [part for line in body for part in _wrapped(f"    {line}" if line else "")]
        return [*self._port_lines(), ");", *body, "endmodule"]

    def _register_name(self, cell: int) -> str:
        kind = "data" if isinstance(self.circuit.cells[cell], SyncReadPort) else "state"
        return self._carrier(self.circuit.whole(cell), lambda: kind)

    def _add_instance(self, writer: ModuleWriter, name: str) -> None:
        """Name an instance, and declare what it drives."""
        for port in writer.ports:
            if port.way == "output" and port.value[0] not in self.home:
                wire = self._carrier(port.value, lambda port=port: f"{name}_{port.name}")  # type: ignore[misc]
                if wire not in self.driven:
                    self.declared.append(f"wire {span(len(port.value))}{wire};")
        own = plain(name)
        own = self.unique(f"{own}_unit" if own in self.taken else own)
        self.instances.append((writer, name, own))

    def _instance(self, writer: ModuleWriter, name: str) -> Iterator[str]:
        """Yield an instance; a blank line is before all but the first."""
        yield from [""] * (name != self.instances[0][2])
        yield f"{_box(writer.index)} {name} ("
        links = [f"    .{port.name}({self.text(port.value)})" for port in writer.ports]
        yield from (f"{link}," for link in links[:-1])
        yield from (links[-1], ");")

    def _wires(self, choices: set[int]) -> list[str]:
        """Return definitions of what is computed between registers, each before its use."""
        cells = self.circuit.cells
        computed = [cell for cell in self.all_of(*_COMBINATIONAL) if cell not in choices]
        for cell in computed:
            if self.circuit.whole(cell) not in self.outputs and self.is_inline(cell):
                self.inline[cell] = None
        named = [cell for cell in computed if cell not in self.inline]
        has_name = {
            cell: self.circuit.whole(cell) in self.called or self.circuit.whole(cell) in self.outputs for cell in named
        }
        for cell in sorted(named, key=lambda cell: (not has_name[cell], cell)):
            self._carrier(self.circuit.whole(cell), lambda cell=cell: self.meaning(cell))  # type: ignore[misc]
        done: set[int] = set()
        lines: list[str] = []

        def define(cell: int) -> None:
            done.add(cell)
            for net in (net for value in self.circuit.inputs(cells[cell]) for net in value if net.is_cell):
                if net.cell not in done and net.cell in computed_set:
                    define(net.cell)
            if cell not in self.inline:
                lines.extend(self._definition(cell))

        computed_set = set(computed)
        for cell in named:
            if cell not in done:
                define(cell)
        return lines

    def _definition(self, number_: int) -> list[str]:
        cell, width = self.circuit.cells[number_], self.circuit.width[number_]
        name = self.home[self.circuit.whole(number_)[0]][0]
        above, text = self.indexed(cell, name) if isinstance(cell, Part) else ([], self.made(number_))
        start = f"assign {name}" if name in self.driven else f"wire {span(width)}{name}"
        return [*above, f"{start} = {text};"]

    def _declare(self, number_: int, name: str) -> None:
        """Declare a register, here or among the ports."""
        cell, whole = self.circuit.cells[number_], self.circuit.whole(number_)
        is_register = isinstance(cell, FlipFlop)
        attributes = {**(cell.attributes if is_register else {}), **self.attributes[whole]}
        level = f" = {number(Value.from_const(cell.init, len(whole)))}" if is_register else ""
        if name in self.driven:
            self.started[name] = attributes, level
        else:
            self.declared.append(f"{attributes_of(attributes)}reg {span(len(whole))}{name}{level};")

    def _port_lines(self) -> Iterator[str]:
        for place, port in enumerate(self.ports):
            attributes, level = self.started.get(port.name, ({}, ""))
            attributes = attributes or (self.attributes[port.value] if port.way == "input" or self.index == 0 else {})
            kind = "reg " if port.name in self.started else "wire"
            yield from _commented(self.origin.ports.get(port.name, ""), "    ")
            if attributes:
                yield f"    {attributes_of(attributes)}".rstrip()
            comma = "," if place + 1 < len(self.ports) else ""
            yield f"    {port.way:6} {kind} {span(len(port.value)):8}{port.name}{level}{comma}"


def _commented(text: str, pad: str = "") -> list[str]:
    return textwrap.wrap(text, 110, initial_indent=f"{pad}// ", subsequent_indent=f"{pad}// ")


def _wrapped(line: str) -> list[str]:
    """Break a long line behind an operator, a colon or a comma."""
    pad = " " * (len(line) - len(line.lstrip()) + 4)
    least = len(pad) + 20
    if len(line) <= _COLUMNS or "//" in line:
        return [line]
    cut = max(line.rfind(mark, least, _COLUMNS) + len(mark) - 1 for mark in (" : ", " | ", " & ", ", ", " ^ ", " + "))
    return [line] if cut <= least else [line[:cut].rstrip(), *_wrapped(pad + line[cut:].lstrip())]


def _box(index: int) -> str:
    """Return what stands for the name of a module until all modules are written."""
    return f"\0{index}\0"


def _sentence(text: str) -> str:
    """Return the first sentence of a text."""
    first = _SENTENCE.split(" ".join(text.split()))[0]
    return ascii_of(first.rstrip(".;") + "." if first else "")


def _comment(port: Port) -> str:
    """Return the comment of a port of the top: its first sentence, unit and strobe."""
    unit = f"; in {port.unit}" if port.unit else ""
    strobe = f"; read with {port.held_by}" if port.held_by not in ("", port.name) else ""
    return _sentence(port.help).rstrip(".") + ascii_of(unit) + strobe


def _origin(thing: Any) -> Origin:
    """Return what the component of a module says of it: its first sentence, and names of its signals."""
    if thing is None:
        return Origin()
    kind = re.sub(r"(?<!^)(?=[A-Z])", "_", type(thing).__name__).lower()
    doc = "" if type(thing).__module__.startswith("amaranth") else inspect.getdoc(type(thing)) or ""
    origin = Origin(kind, _sentence(doc))
    if isinstance(thing, wiring.Component):
        members = {"__".join(map(str, path)): value for path, _, value in thing.signature.flatten(thing)}
    else:
        members = {name: value for name, value in vars(thing).items() if not name.startswith("_")}
    for name, member in members.items():
        value = member.as_value() if isinstance(member, _ast.ValueCastable) else member
        if isinstance(value, _ast.Signal):
            origin.members[value] = name
    return origin


def write(top: wiring.Component, name: str, ports: Iterable[Port] = ()) -> Written:
    """Return a component as Verilog; `ports` gives the order and the comments of the ports of the top.

    Raises
    ------
    Unwritten
        If there is an unknown kind of cell, or an instance of a foreign module.
    """
    ways = {wiring.In: _ir.PortDirection.Input, wiring.Out: _ir.PortDirection.Output}
    members = {
        "__".join(map(str, path)): (_ast.Value.cast(value), ways[member.flow])
        for path, member, value in top.signature.flatten(top)
    }
    design = _ir.Fragment.get(top, None).prepare(ports=members, hierarchy=(name,))
    things = {
        design.fragments[fragment].name: thing
        for thing, fragment in design.elaboratables.items()
        if not isinstance(thing, Module)  # of which components are made
    }
    circuit = Circuit(design)
    origins = {module.name: _origin(things.get(module.name)) for module in circuit.modules}
    origins[name,].ports = {port.name: _comment(port) for port in ports}
    for path, thing in things.items():
        if isinstance(thing, CommentedMemory):
            origins[path[:-1]].words[path[-1]] = thing.comments
    return _joined(circuit, origins)


def _joined(circuit: Circuit, origins: Mapping[tuple[str, ...], Origin]) -> Written:
    """Return the modules as one text, equal ones once."""
    writers: dict[int, ModuleWriter] = {}
    first: dict[tuple[str, ...], int] = {}  # by its text: the module that has it
    same: dict[int, int] = {}
    for index in reversed(range(len(circuit.modules))):
        module = circuit.modules[index]
        inner = [one for one in module.submodules if one in writers]
        if not inner and not any(cell in circuit.live for cell in module.cells if cell):
            continue
        writer = writers[index] = ModuleWriter(circuit, index, origins[module.name])
        lines = writer.lines([(writers[one], circuit.modules[one].name[-1]) for one in inner])
        same[index] = first.setdefault(
            tuple(_BOX.sub(lambda box: _box(same[int(box[1])]), line) for line in lines), index
        )
    names = _module_names(circuit, origins, same)
    text = [
        _BOX.sub(lambda box: names[int(box[1])], line)
        for lines, index in sorted(first.items(), key=lambda one: one[1])
        for line in (*_commented(origins[circuit.modules[index].name].comment), f"module {names[index]} (", *lines, "")
    ]
    return Written("\n".join(text), dict(_paths(writers[0])))


def _module_names(
    circuit: Circuit, origins: Mapping[tuple[str, ...], Origin], same: Mapping[int, int]
) -> dict[int, str]:
    """Return the name of each module that is written: its path, or, of what has several, the top and its class."""
    shared, names = Counter(same.values()), dict[int, str]()
    for index in sorted(shared):
        path = circuit.modules[index].name
        kind = origins[path].kind if shared[index] > 1 else ""
        name = plain("_".join([path[0], kind] if kind else path))
        while name in names.values():
            name += "_"
        names[index] = name
    return names


def _paths(writer: ModuleWriter) -> Iterator[tuple[str, str]]:
    """Yield the paths of registers and memories as Amaranth names them, with their paths in the text."""
    yield from writer.renamed.items()
    for inner, name, own in writer.instances:
        yield from ((f"{name}.{old}", f"{own}.{new}") for old, new in _paths(inner))
