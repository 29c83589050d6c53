"""How Yosys maps a core to lookup tables: near enough to count them, and to find the longest path.

A netlist is a graph of bits. A gate is known by its inputs alone, as a lookup table holds any function of them.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from heapq import heapify, heappop, heappush
from typing import Any

Bits = Sequence[int | str]  # numbers of nets, or constants as "0"
Cut = frozenset[int]

_TREES = {"$_AND_": "and", "$_OR_": "or", "$_XOR_": "xor"}  # gates whose inputs may come in any order
_SUMS, _COMPARISONS = ("$add", "$sub", "$neg"), ("$lt", "$le", "$gt", "$ge")
_SHIFTS = ("$shift", "$shiftx", "$shr", "$shl", "$sshr", "$sshl")
_NO_TABLE = ("carry", "sum", "product")
_KEPT, _TRIED = 8, 24  # cuts of a gate that are kept, and that are tried


@dataclass(frozen=True)
class Fabric:
    """Lookup tables and carry chains of a family; times in ps, from its timing model in Yosys."""

    wire: int
    pins: tuple[tuple[int, ...], ...]  # by the inputs of a table: from each to the output, the fastest first
    cells: tuple[int, ...]  # by the inputs of a table
    # from a bit into the chain, along a bit of it, from the chain to a sum, from a bit to its sum, through a multiplier
    enter: int
    step: float
    leave: int
    own: int
    product: int = 3300
    short: int = 4  # bits of sums that lookup tables make
    writes: bool = True  # lookup tables can be memories
    slice: int = 4  # bits of a word of these
    bypass: float = 0  # flip-flops for each bit of 16 words of these, to read what is being written; else of 1 word
    block: int = 128  # what a block RAM counts beside 16 bits of constants in tables
    widest: int = 36  # bits of a word of it


_LUT4 = (), (141,), (141, 275), (141, 275, 379), (141, 275, 379, 379)
_WIDE = (151, 239, 373, 477, 477), (148, 292, 380, 514, 618, 618), (148, 289, 433, 521, 655, 759, 759)
ECP5 = Fabric(300, (*_LUT4, *_WIDE), (0, 1, 1, 1, 1, 2, 4, 8), 516, 21.5, 257, 379)
_PINS = (), (316,), (316, 379), (316, 379, 400), (316, 379, 400, 449)
ICE40 = Fabric(250, _PINS, (0, 1, 1, 1, 1), 259, 126, 316, 400, short=1, writes=False, bypass=1, block=64, widest=16)
_GOWIN = (), (902,), (902, 1184), (902, 1184, 1486), (902, 1184, 1486, 1583), (680, 1116, 1371, 1638, 1638)
GOWIN = Fabric(500, _GOWIN, (0, 1, 1, 1, 1, 2), 1505, 82, 811, 1432, short=2, slice=1, bypass=1.5)


class Logic:
    """The bits of a module that `hdl.export.verilog.netlist_of` returns, and what each depends on."""

    def __init__(self, module: Mapping[str, Any], fabric: Fabric) -> None:
        self.fabric = fabric
        self.nodes: dict[int, tuple[str, tuple[int, ...]]] = {}  # kind and inputs
        self.ends: list[int] = []  # bits that flip-flops, chains, memories and outputs take
        self.flip_flops: list[tuple[int, int]] = []  # their data and their output
        self.chains: list[int] = []  # bits of each chain of carries
        self.products: list[tuple[int, int]] = []  # bits of both factors
        self.small: list[tuple[int, int]] = []  # words, or sixteens of them, and bits of memories without blocks
        self.late: set[int] = set()  # bits that a block RAM has read
        for port in module["ports"].values():
            self.ends += _nets(port["bits"]) if port["direction"] == "output" else ()
        cells = module["cells"].values()
        pins = [bits for cell in cells for bits in cell["connections"].values()]
        uses = Counter(bit for bits in [*pins, self.ends] for bit in bits)  # with the one that drives it
        sums = {(*cell["connections"]["Y"],): cell for cell in cells if cell["type"] in _SUMS}
        self._joined = {  # sums that only another sum takes: Yosys adds all at once
            bits: sums[bits]
            for y, cell in sums.items()
            for name in "AB"
            if (bits := (*cell["connections"].get(name, ()),)) in sums and len(bits) >= min(len(y), _exact(sums[bits]))
            if all(uses[bit] == 2 for bit in bits)
        }
        for cell in cells:
            self._add(cell, defaultdict(list, cell["connections"]), cell["parameters"])

    def _add(self, cell: Mapping[str, Any], pins: Mapping[str, Any], parameters: Mapping[str, str]) -> None:
        kind, (a, b, s, y) = cell["type"], (pins[name] for name in "ABSY")
        if "DFF" in kind:
            self.flip_flops.append((pins["D"][0], pins["Q"][0]))
            self.ends += _nets([*pins["D"], *pins["E"], *pins["R"]])
        elif kind.startswith("$_"):
            self.gate([*a, *b, *s], y[0], _TREES.get(kind, "gate"))
        elif kind in _COMPARISONS:
            a, b = self._terms(cell, max(len(a), len(b)))
            self._chain(a, b, y)
        elif kind in _SUMS:
            if (*y,) not in self._joined:
                exact = y[: _exact(cell)] if kind == "$neg" else y  # Yosys makes no bit twice
                self._sum([*self._terms(cell, len(exact))], exact)
                self.nodes |= {bit: ("gate", _nets(exact[-1:])) for bit in _nets(y[len(exact) :])}
        elif kind == "$mul":
            self.products.append((len(a), len(b)))
            self.nodes |= {bit: ("product", _nets([*a, *b])) for bit in _nets(y)}
            self.ends += _nets([*a, *b])
        elif kind == "$mem_v2":
            self._memory(pins, parameters, cell["attributes"].get("ram_style") == "block")
        elif kind == "$pmux":
            for at, bit in enumerate(y):
                ways = [(b[k * len(y) + at], select) for k, select in enumerate(s)]
                self._tree([*(self.gate(way) for way in ways if way[0] != "0"), a[at]], bit)
        elif kind in _SHIFTS:
            self._shift(-1 if kind in ("$shl", "$sshl") else 1, a, b, y)
        elif kind != "$scopeinfo":
            raise ValueError(f"the cells of {kind} are not known")

    def gate(self, inputs: Bits, output: int | None = None, kind: str = "gate") -> int:
        """Add a gate; return its output, a new one if none is given."""
        bit = -len(self.nodes) - 1 if output is None else output
        self.nodes[bit] = kind, _nets(inputs)
        return bit

    def _tree(self, inputs: Bits, output: int) -> None:
        left = [*_nets(inputs)]
        while len(left) > 2:
            left = [*left[2:], self.gate(left[:2], None, "or")]
        self.gate(left, output, "or")

    def _terms(self, cell: Mapping[str, Any], width: int) -> Iterator[Bits]:
        signed = cell["parameters"]["A_SIGNED"][-1] == "1"  # as B, if there is one
        for bits in (cell["connections"][name] for name in "AB" if name in cell["connections"]):
            if (inner := self._joined.get((*bits,))) is not None:
                yield from self._terms(inner, width)
            else:
                yield [*bits, *[bits[-1] if signed and bits else "0"] * width][:width]

    def _sum(self, terms: list[Bits], y: Bits) -> None:
        carries = [at for at, term in enumerate(terms) if {*term[1:]} <= {"0"}][: len(terms) - 2]
        first = [bit for at in carries[:1] for bit in _nets(terms.pop(at))]
        if len(terms) > 3:
            pair = [self.gate(()) for _ in y]
            self._chain(terms[0], terms[1], pair)
            terms = [*terms[2:], pair]
        while len(terms) > 2:
            triples = [*zip(*terms[:3], strict=True)]
            terms = [*terms[3:], [self.gate(each) for each in triples], ["0", *map(self.gate, triples[:-1])]]
        self._chain(terms[0], [*terms, ["0"] * len(y)][1], y, tuple(first))

    def _chain(self, a: Bits, b: Bits, y: Bits, carry: tuple[int, ...] = ()) -> None:
        long = len(a) > self.fabric.short
        if long:
            self.chains.append(len(a))
            self.ends += _nets([*a, *b, *carry])
        for at, pair in enumerate(zip(a, b, strict=True)):
            inputs = _nets(pair) + carry
            if len(y) == len(a):
                self.gate(inputs, int(y[at]), "sum" if long else "gate")
            carry = (self.gate(inputs, None, "carry" if long else "gate"),) if inputs else ()
        if len(y) < len(a):  # a comparison
            self.gate(carry, int(y[0]), "sum" if long else "gate")

    def _shift(self, sign: int, a: Bits, b: Bits, y: Bits) -> None:
        word = [*a, *["0"] * (len(y) - len(a))]
        for at in reversed(range(len(b))):
            other = [word[k] if 0 <= k < len(word) else "0" for k in range(sign << at, (sign << at) + len(word))]
            pairs = zip(word, other, strict=True)
            word = [low if low == high else self.gate([low, high, b[at]]) for low, high in pairs]
        for bit, source in zip(y, word, strict=False):
            self.gate([source], int(bit))

    def _memory(self, pins: Mapping[str, Any], parameters: Mapping[str, str], block: bool) -> None:
        read, address, ports = pins["RD_DATA"], pins["RD_ADDR"], int(parameters["RD_PORTS"], 2)
        words, width = int(parameters["SIZE"], 2), int(parameters["WIDTH"], 2)
        self.ends += _nets([bit for name, bits in pins.items() if name != "RD_DATA" for bit in bits])
        written, clocked = bool(pins["WR_DATA"]), "1" in parameters["RD_CLK_ENABLE"]
        blocks = self.fabric.block * ports * -(-width // self.fabric.widest)
        if not written and (not clocked or words * width <= 16 * blocks):
            size = len(address) // ports
            for at, bit in enumerate(read):
                data = self._constant(words, address[at // width * size :][:size], None if clocked else bit)
                if clocked:
                    self.flip_flops.append((data, bit))
                    self.ends.append(data)
            return
        rows, cost = words, words * width
        if self.fabric.writes:  # as Yosys weighs tables, and the choice among them
            rows = -(-words // 16)
            cost = ports * (rows * self.fabric.slice * -(-width // self.fabric.slice) + (rows - 1) * width // 2)
        if written and cost <= blocks and not block:
            self.small.append((rows, len(read)))
        else:
            self.late |= {*_nets(read)}

    def _constant(self, words: int, address: Bits, output: int | None) -> int:
        """Add a bit of a constant memory: tables of four bits of the address, and a tree of choices."""
        rows = [self.gate(address[:4]) for _ in range(-(-words // 16))]
        for select in address[4:]:
            rows = [self.gate([*rows[at : at + 2], select]) for at in range(0, len(rows), 2)]
        return self.gate(rows, output)


def _exact(cell: Mapping[str, Any]) -> int:
    """Return bits of a sum that never overflow."""
    return 1 + max(len(cell["connections"].get(name, ())) for name in "AB")


def _nets(bits: Bits) -> tuple[int, ...]:
    return tuple(dict.fromkeys(bit for bit in bits if not isinstance(bit, str)))


class Mapped:
    """Logic in lookup tables: as fast as can be where it is the longest path, small elsewhere."""

    def __init__(self, logic: Logic) -> None:
        self.logic, self.fabric = logic, logic.fabric
        self._time: dict[int, float] = defaultdict(float)
        self._cuts: dict[int, list[Cut]] = {}
        self._area: dict[int, float] = defaultdict(float)  # cells of a bit, divided by those that take it
        self._takers: dict[int, int] = defaultdict(int)
        self._order: list[int] = []
        nodes, order = logic.nodes, [*_sorted(logic)]
        for source in [*logic.ends, *(each for bit in order for each in nodes[bit][1])]:
            self._takers[source] += 1
        trees = [bit for bit in order if nodes[bit][0] in _TREES.values()]
        inner = {each for bit in trees for each in nodes[bit][1] if self._is_inner(bit, each)}
        for bit in order:
            if bit not in inner:
                if nodes[bit][0] in _TREES.values():
                    self._balance(bit)
                self._look(bit)
        self.tables = self._cover()  # the inputs of each table, by its output

    def _is_inner(self, bit: int, source: int) -> bool:
        nodes = self.logic.nodes
        return self._takers[source] == 1 and nodes.get(source, ("",))[0] == nodes[bit][0] in _TREES.values()

    def _leaves(self, bit: int) -> Iterator[int]:
        for each in self.logic.nodes[bit][1]:
            yield from self._leaves(each) if self._is_inner(bit, each) else (each,)

    def _balance(self, bit: int) -> None:
        """Make a tree of equal gates anew: what comes last passes the fewest of them."""
        left = [(self._time[each], each) for each in dict.fromkeys(self._leaves(bit))]
        heapify(left)
        while len(left) > 2:
            made = self.logic.gate([heappop(left)[1], heappop(left)[1]])
            self._takers[made] = 1
            self._look(made)
            heappush(left, (self._time[made], made))
        self.logic.gate([each for _, each in left], bit)

    def _look(self, bit: int) -> None:
        """Find the cuts of a bit, and when it is there at the earliest."""
        kind, inputs = self.logic.nodes[bit]
        self._order.append(bit)
        if kind in _NO_TABLE:
            self._time[bit] = max((self._time[each] + self._edge(kind, each) for each in inputs), default=0)
            return
        cuts: set[Cut] = {frozenset()}
        for each in inputs:
            ways = [frozenset((each,)), *self._cuts.get(each, ())]
            cuts = {joined for cut in cuts for way in ways if len(joined := cut | way) < len(self.fabric.pins)}
            if len(cuts) > _TRIED and len(inputs) > 2:
                cuts = {*sorted(cuts, key=lambda cut: (50 * self._cost(cut) + self._at(cut), sorted(cut)))[:_TRIED]}
        small = sorted(cuts, key=lambda cut: (self._cost(cut), len(cut), self._at(cut), sorted(cut)))
        fast = sorted(cuts, key=lambda cut: (self._at(cut), self._cost(cut), sorted(cut)))
        self._time[bit] = self._at(fast[0])
        self._cuts[bit] = [*dict.fromkeys([*small[: _KEPT - 2], *fast[:2]])]
        self._area[bit] = self._cost(small[0]) / max(1, self._takers[bit])

    def _cost(self, cut: Cut) -> float:
        return self.fabric.cells[len(cut)] + sum(self._area[each] for each in cut)

    def _pins(self, cut: Cut) -> Iterator[tuple[int, int]]:
        """Yield the bits of a cut with their delays: the last bit takes the fastest pin."""
        return zip(sorted(cut, key=lambda each: (-self._time[each], each)), self.fabric.pins[len(cut)], strict=True)

    def _at(self, cut: Cut) -> float:
        return max((self._time[each] + self.fabric.wire + delay for each, delay in self._pins(cut)), default=0)

    def _is_carry(self, bit: int) -> bool:
        return self.logic.nodes.get(bit, ("",))[0] == "carry"

    def _edge(self, kind: str, source: int) -> float:
        fabric = self.fabric
        if self._is_carry(source):
            return fabric.step if kind == "carry" else fabric.leave
        return {"carry": fabric.enter, "sum": fabric.own, "product": fabric.product}[kind]

    def _cover(self) -> dict[int, Cut]:
        """Return the inputs of the tables that are needed, each the smallest that is in time."""
        longest = max((self._time[bit] for bit in self.logic.ends), default=0.0)
        due: dict[int, float] = defaultdict(lambda: longest)
        needed, tables = {*self.logic.ends}, dict[int, Cut]()
        for bit in reversed(self._order):
            kind, inputs = self.logic.nodes[bit]
            if kind in _NO_TABLE:
                edges = [(each, self._edge(kind, each)) for each in inputs]
            elif bit in needed:
                tables[bit] = min(self._cuts[bit], key=lambda cut: self._rank(cut, due[bit], needed))
                edges = [(each, delay + self.fabric.wire) for each, delay in self._pins(tables[bit])]
            else:
                continue
            for each, delay in edges:
                due[each] = min(due[each], due[bit] - delay)
                needed.add(each)
        return tables

    def _rank(self, cut: Cut, due: float, needed: set[int]) -> tuple[Any, ...]:
        late = max(0, self._at(cut) - due - 1e-6)
        new = sum(self._area[each] for each in cut if each in self._cuts and each not in needed)
        return late, self.fabric.cells[len(cut)] + new, len(cut), sorted(cut)

    @cached_property
    def path(self) -> list[tuple[int, str, int, list[tuple[int, int, bool]]]]:
        """Each bit after those that it depends on: its number and kind, the inputs of its table, and its sources with
        how many bits take them and whether they are carries. The last row has all ends.
        """
        nodes, takers = self.logic.nodes, defaultdict[int, int](int)
        kept = [bit for bit in self._order if bit in self.tables or nodes[bit][0] in _NO_TABLE]
        rows = [(bit, nodes[bit][0], [*self.tables.get(bit, nodes[bit][1])]) for bit in kept]
        for source in [*self.logic.ends, *(source for *_, sources in rows for source in sources)]:
            takers[source] += 1
        rows.append((0, "end", [*dict.fromkeys(self.logic.ends)]))
        return [
            (bit, kind, len(sources) if bit in self.tables else 0, [(s, takers[s], self._is_carry(s)) for s in sources])
            for bit, kind, sources in rows
        ]

    def feeds_alone(self, bit: int) -> bool:
        """Return whether a table or a sum has no other taker than the flip-flop that this bit is the data of."""
        made = bit in self.tables or self.logic.nodes.get(bit, ("",))[0] == "sum"
        return made and self._takers[bit] == 1


def _sorted(logic: Logic) -> Iterator[int]:
    """Yield the bits that ends depend on, each after those that it depends on."""
    nodes, done = logic.nodes, set[int]()
    for end in logic.ends:
        stack = [(end, iter(nodes[end][1]))] if end in nodes and end not in done else []
        done.add(end)
        while stack:
            bit, left = stack[-1]
            for each in left:
                if each in nodes and each not in done:
                    done.add(each)
                    stack.append((each, iter(nodes[each][1])))
                    break
            else:
                stack.pop()
                yield bit
