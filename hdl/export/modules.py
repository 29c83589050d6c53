"""Modules as Verilog-2001 that an engineer can review: ports, registers, memories, and comments."""

from __future__ import annotations

import inspect
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from itertools import zip_longest
from typing import Any, NamedTuple

from amaranth import Module
from amaranth.hdl import _ast, _ir
from amaranth.hdl import _nir as nir
from amaranth.lib import wiring

from tachometry.hdl.export.expressions import Body, Scope, merge, number, operand, part, plain
from tachometry.hdl.export.netlist import Circuit, lanes, runs
from tachometry.hdl.export.render import ascii_of, comment, first_sentence, port_comment, span, wrapped
from tachometry.hdl.wires.commented_memory import CommentedMemory
from tachometry.spec.language.port import Port

_COMBINATIONAL = (nir.Operator, nir.Part, nir.AssignmentList, nir.AsyncReadPort)
_LED = 1 << 16  # place among the ports of what is led through
Path = tuple[str, ...]  # of a module: names of instances, the outermost first


class Written(NamedTuple):
    """The text of a core, and the names in it of what has other names in Amaranth."""

    text: str
    names: Mapping[str, str]  # paths of signals and memories, by those that Amaranth gives


class Link(NamedTuple):
    """A port of a module."""

    name: str
    way: str  # input or output
    value: Any


class ModuleWriter(Scope):
    """Writes one module."""

    def __init__(self, circuit: Circuit, index: int, things: Mapping[Path, Any], comments: Mapping[str, str]) -> None:
        super().__init__(circuit, index)
        self.things = things
        self.comments = comments if index == 0 else {}  # of ports
        self.instances: list[tuple[ModuleWriter, str, str]] = []  # with their names in Amaranth, and their own
        links = [*self._boundary()]
        if index == 0:
            for name, (first, width) in circuit.top.ports_i.items():
                nets = nir.Value(nir.Net.from_cell(0, first + bit) for bit in range(width))
                links.append(Link(name, "input", nets))
            links += [Link(name, "output", value) for name, value in circuit.top.ports_o.items()]
        links.sort(key=lambda link: (link.way, link.name != "clk", link.name != "rst"))
        self.ports = [Link(self.unique(name), way, value) for name, way, value in links]
        self.outputs: dict[Any, str] = {}
        for port in self.ports:
            if port.way == "input":
                self.place(port.name, port.value)
            else:
                self.outputs.setdefault(port.value, port.name)
        self.driven: set[str] = set()  # outputs that are no copies of another
        self.registers: dict[str, tuple[str, str]] = {}  # attributes and first level
        self.declared: list[str] = []

    def all_of(self, *kinds: type) -> list[int]:
        return [cell for cell in self.own if isinstance(self.circuit.cells[cell], kinds)]

    def _boundary(self) -> Iterator[Link]:
        """Yield the ports that the component declares; what is led through has the name of its signal."""
        left = dict(self.circuit.flow[self.index])
        members = _members(self.things.get(self.module.name))
        found = []
        for signal, name in self.module.signal_names.items():
            place, base = members.get(signal, (_LED, name))
            fields = self.circuit.signal_fields[signal]
            for path in fields:
                if not any(longer[: len(path)] == path != longer for longer in fields):
                    whole = "_".join([base.removesuffix("__payload") if path else base, *map(str, path)])
                    found.append((place, whole, fields[path].value))
        found.sort(key=lambda one: (one[0] == _LED, -len(one[2]), "$" in one[1]))
        links = []
        for place, name, value in found:
            ways = {left.get(net, "") for net in value}
            if value and len(set(value)) == len(value) and len(ways) == 1 and "" not in ways:
                own = value in self.called and value[0].cell in self.all_of(nir.FlipFlop)
                links.append((place, value, Link(self.called[value][0] if own else name, ways.pop(), value)))
                for net in value:
                    del left[net]
        yield from (link for *_, link in sorted(links, key=lambda one: one[:2]))
        for way in ("input", "output"):
            for first, count in runs(sorted(net for net in left if left[net] == way)):
                value = nir.Value(nir.Net(net) for net in range(first, first + count))
                yield Link(self.near(value) or f"{self.module.name[-1]}_{way}", way, value)

    def _carrier(self, value: Any, made_up: str = "") -> str:
        """Name a value that this module makes: the output that it is, its signal, or what it is for."""
        if value in self.outputs and value[0] not in self.home:
            name = self.outputs[value]
            self.driven.add(name)
        else:
            name = self.unique(self.called[value][0]) if value in self.called else self.unique(made_up, True)
        self.place(name, value)
        return name

    def lines(self, instances: Iterable[tuple[ModuleWriter, str]]) -> list[str]:
        """Return the lines of the module behind its name; `instances` have their names in Amaranth."""
        for cell in self.all_of(nir.FlipFlop, nir.SyncReadPort):
            self._declare(cell)
        for writer, name in instances:
            self._add_instance(writer, name)
        self.memories = {cell: self.unique(self.circuit.cells[cell].name) for cell in self.all_of(nir.Memory)}
        choices = {cell: self.folded(cell) for cell in self.all_of(nir.FlipFlop)}
        wires = [*self._wires({*choices.values()})]
        clocked = [*map(self._read_or_write, self.all_of(nir.SyncWritePort, nir.SyncReadPort)), *self._clocked(choices)]
        copies = [port for port in self.ports if port.way == "output" and port.name not in self.driven]
        ends = [f"assign {port.name} = {self.text(port.value)};" for port in copies]
        written = {word for lines in (wires, *clocked) for line in lines for word in re.findall(r"[A-Z]\w+", line)}
        read = sorted((one for one in self.constants.items() if one[0] in written), key=lambda one: one[1])
        constants = [f"localparam {span(width)}{name} = {value};" for name, (width, value) in read]
        memories = [[*self._contents(cell)] for cell in self.memories]
        boxes = []
        for writer, _, name in self.instances:
            links = [f"    .{port.name}({self.text(port.value)})," for port in writer.ports]
            boxes.append([f"\0{writer.index}\0 {name} (", *links[:-1], links[-1][:-1], ");"])
        blocks = [[*constants, *self.declared], *memories, wires, *clocked, *boxes, ends]
        body = [f"    {line}" if line else "" for block in blocks if block for line in ("", *block)][1:]
        return [*self._port_lines(), ");", *(part for line in body for part in wrapped(line)), "endmodule"]

    def _add_instance(self, writer: ModuleWriter, name: str) -> None:
        """Name an instance, and declare what it drives."""
        for port in writer.ports:
            if port.way == "output" and port.value[0] not in self.home:
                wire = self._carrier(port.value, f"{name}_{port.name}")
                if wire not in self.driven:
                    self.declared.append(f"wire {span(len(port.value))}{wire};")
        own = plain(name)
        self.instances.append((writer, name, self.unique(f"{own}_unit" if own in self.taken else own)))

    def _wires(self, choices: set[int | None]) -> Iterator[str]:
        """Yield definitions of what is computed between registers, each before its use."""
        cells, whole = self.circuit.cells, self.circuit.whole
        left = dict.fromkeys(cell for cell in self.all_of(*_COMBINATIONAL) if cell not in choices)
        known = {cell for cell in left if whole[cell] in self.called or whole[cell] in self.outputs}
        self.inline = {cell for cell in left if cell not in known and self.is_inline(cell)}
        named = [cell for cell in left if cell not in self.inline]
        for cell in sorted(named, key=lambda cell: cell not in known):
            self._carrier(whole[cell], "" if cell in known else self.meaning(cell))

        def define(number_: int) -> Iterator[str]:
            if number_ not in left:
                return
            del left[number_]
            cell = cells[number_]
            for net in (net for value in self.circuit.inputs(cell) for net in value if net.is_cell):
                yield from define(net.cell)
            if number_ not in self.inline:
                name = self.home[whole[number_][0]][0]
                above, text = self.indexed(cell, name) if isinstance(cell, nir.Part) else ([], self.made(number_))
                start = f"assign {name}" if name in self.driven else f"wire {span(len(whole[number_]))}{name}"
                yield from (*above, f"{start} = {text};")

        for cell in named:
            yield from define(cell)

    def _declare(self, cell_number: int) -> None:
        """Name a register, and declare it here unless it is among the ports."""
        cell, whole = self.circuit.cells[cell_number], self.circuit.whole[cell_number]
        name = self._carrier(whole, "state")
        attributes, level = _attributes(self.attributes[whole]), ""
        if isinstance(cell, nir.FlipFlop):
            attributes = _attributes(cell.attributes | self.attributes[whole])
            level = f" = {number(nir.Value.from_const(cell.init, len(whole)))}"
        self.registers[name] = attributes, level
        if name not in self.driven:
            self.declared.append(f"{attributes}reg {span(len(whole))}{name}{level};")

    def _port_lines(self) -> Iterator[str]:
        for port in self.ports:
            own = self.attributes[port.value] if port.way == "input" or self.index == 0 else {}
            attributes, level = self.registers.get(port.name, ("", ""))
            kind = "reg " if port.name in self.registers else "wire"
            yield from comment(self.comments.get(port.name, ""), "    //").splitlines()
            yield from (f"    {text}".rstrip() for text in [attributes or _attributes(own)] if text)
            line = f"    {port.way:6} {kind} {span(len(port.value)):8}{port.name}{level}"
            yield line + "," * (port is not self.ports[-1])

    def _clocked(self, choices: Mapping[int, int | None]) -> Iterator[list[str]]:
        """Yield processes: of the registers with the reset, and of those without."""
        groups: dict[Any, tuple[list[str], Body]] = defaultdict(lambda: ([], []))
        for number_, choice in choices.items():
            cell, whole = self.circuit.cells[number_], self.circuit.whole[number_]
            level = nir.Value.from_const(cell.init, len(whole))
            body, reset = Body([("=", 0, cell.data)]), None
            if choice is not None:
                default = self.circuit.cells[choice].default
                body = [*[("=", 0, default)] * (default != whole), *self.tree(self.circuit.cells[choice])]
                match body[-1]:
                    case ("if", int(test), [[("=", 0, value)]]) if value == level:
                        tests = [self.condition(patterns) for patterns, _ in self.cases(test, [[]])]
                        reset, body = (test, body[:-1]) if tests == ["rst"] else (None, body)
            resets, merged = groups[self._edge(cell), reset]
            name = self.home[whole[0]][0]
            resets.append(f"        {name} <= {number(level)};")
            merge(merged, body, (name, len(whole)))
        for (edge, reset), (resets, body) in groups.items():
            if reset is None:
                yield [edge, *self.statements(body, 1), "end"]
            else:
                rest = self.statements(body, 2)
                yield [edge, "    if (rst) begin", *resets, "    end else begin", *rest, "    end", "end"]

    def _edge(self, cell: Any) -> str:
        return f"always @({cell.clk_edge}edge {self.text(nir.Value(cell.clk))}) begin"

    def _read_or_write(self, cell_number: int) -> list[str]:
        """Return the process of a port of a memory."""
        cell = self.circuit.cells[cell_number]
        word = f"{self.memories[cell.memory]}[{self.text(cell.addr)}]"
        if isinstance(cell, nir.SyncWritePort):
            return [self._edge(cell), *self._stored(cell, word), "end"]
        data, enable = self.home[self.circuit.whole[cell_number][0]][0], self.text(nir.Value(cell.en))
        lines = [_if([enable], f"{data} <= {word};")]
        for port in map(self.circuit.cells.__getitem__, cell.transparent_for):
            lines += self._stored(port, data, enable, self._binary("==", cell.addr, port.addr))
        return [self._edge(cell), *lines, "end"]

    def _stored(self, port: Any, word: str, *tests: str) -> Iterator[str]:
        """Yield the assignments of the lanes that a port writes."""
        for enable, first, last in lanes(port):
            lane = part(word, first, last - first, len(port.data))
            yield _if([*tests, self.text(enable)], f"{lane} <= {self.text(port.data[first:last])};")

    def _contents(self, cell_number: int) -> Iterator[str]:
        """Yield the declaration of a memory, and the words that it begins with."""
        memory, name = self.circuit.cells[cell_number], self.memories[cell_number]
        yield f"{_attributes(memory.attributes)}reg {span(memory.width)}{name} [0:{memory.depth - 1}];"
        if not any(memory.init):
            at = self.unique(f"{name}_at", True)
            loop = f"for ({at} = 0; {at} < {memory.depth}; {at} = {at} + 1)"
            yield from (f"integer {at};", f"initial {loop} {name}[{at}] = {memory.width}'d0;")
            return
        yield "// FPGAs load these words with the bitstream; a tool that ignores `initial` needs a ROM of them here."
        yield "initial begin"
        thing = self.things.get((*self.module.name, memory.name))
        comments = thing.comments if isinstance(thing, CommentedMemory) else ()
        for place, (word, text) in enumerate(zip_longest(memory.init, comments, fillvalue="")):
            value = f"{word & ((1 << memory.width) - 1):0{-(-memory.width // 4)}x}"
            yield f"    {name}[{place}] = {memory.width}'h{value};{text and f'  // {ascii_of(text)}'}"
        yield "end"

    def paths(self) -> Iterator[tuple[str, str]]:
        """Yield the paths of signals and memories as Amaranth names them, with their paths in the text."""
        for value, names in self.called.items():
            name, *_ = self.home.get(value[0], ("",))
            if all(self.home.get(net) == (name, at, len(value)) for at, net in enumerate(value)):
                yield from ((called, name) for called in names)
        yield from ((self.circuit.cells[cell].name, name) for cell, name in self.memories.items())
        for inner, name, own in self.instances:
            yield from ((f"{name}.{old}", f"{own}.{new}") for old, new in inner.paths())


def _if(tests: Iterable[str], statement: str) -> str:
    parts = [text for text in tests if text != "1'b1"]
    test = " & ".join(map(operand, parts) if parts[1:] else parts)
    return f"    if ({test}) {statement}" if test else f"    {statement}"


def _attributes(attributes: Mapping[str, Any]) -> str:
    """Return attributes as they stand before a declaration."""
    texts = {key: value if isinstance(value, int) else f'"{value}"' for key, value in attributes.items()}
    return "".join(f"(* {key} = {text} *) " for key, text in texts.items())


def _members(thing: Any) -> Any:
    """Return the places and names that a component has for its signals."""
    members: Iterable[tuple[str, Any]] = vars(thing).items() if thing else ()
    if isinstance(thing, wiring.Component):
        flat = thing.signature.flatten(thing)
        members = (("__".join(map(str, path)), _ast.Value.cast(member)) for path, _, member in flat)
    signals = (one for one in members if isinstance(one[1], _ast.Signal) and one[0][0] != "_")
    return _ast.SignalDict((signal, (place, name)) for place, (name, signal) in enumerate(signals))


def write(top: wiring.Component, name: str, ports: Iterable[Port] = ()) -> Written:
    """Return a component as Verilog; `ports` gives the order and the comments of the ports of the top.

    It raises Unwritten for an unknown kind of cell or an instance of a foreign module.
    """
    comments = {port.name: port_comment(port) for port in ports}
    flat = top.signature.flatten(top)
    members = {"__".join(map(str, path)): (_ast.Value.cast(value), None) for path, _, value in flat}
    ordered = {port: members[port] for port in (*comments, *members) if port in members}
    design = _ir.Fragment.get(top, None).prepare(ports=ordered, hierarchy=(name,))
    named = ((design.fragments[fragment].name, thing) for thing, fragment in design.elaboratables.items())
    things = {path: thing for path, thing in named if not isinstance(thing, Module)}  # of which components are made
    return _joined(Circuit(design), things, comments)


def _joined(circuit: Circuit, things: Mapping[Path, Any], comments: Mapping[str, str]) -> Written:
    """Return the modules as one text, equal ones once."""
    writers: dict[int, ModuleWriter] = {}
    first: dict[tuple[str, ...], int] = {}  # by its text: the module that has it
    for index in reversed(range(len(circuit.modules))):
        module = circuit.modules[index]
        inner = [one for one in module.submodules if one in writers]
        if inner or any(cell in circuit.live for cell in module.cells if cell):
            writer = writers[index] = ModuleWriter(circuit, index, things, comments)
            lines = writer.lines([(writers[one], circuit.modules[one].name[-1]) for one in inner])
            writer.index = first.setdefault(tuple(lines), index)
    same = Counter(writer.index for writer in writers.values())
    text, names = list[str](), dict[str, str]()
    for body, index in sorted(first.items(), key=lambda one: one[1]):
        path = circuit.modules[index].name
        kind = type(things.get(path))
        snake = re.sub(r"(?<!^)(?=[A-Z])", "_", kind.__name__).lower()
        short = same[index] > 1 and path in things
        name = path[0] if not path[1:] else plain(f"{path[0]}_{snake}" if short else "_".join(path))
        while name in names.values():
            name += "_"
        names[f"{index}"] = name
        doc = "" if kind.__module__.startswith(("amaranth", "builtins")) else first_sentence(inspect.getdoc(kind) or "")
        text += [*comment(doc).splitlines(), f"module {name} (", *body, ""]
    whole = re.sub("\0(.*?)\0", lambda found: names[found[1]], "\n".join(text))
    return Written(whole, dict(writers[0].paths()))
