"""Which mutants are equivalent by what a clock does alone: proven by SAT, cone by cone, in milliseconds.

The netlist is cut at its flip-flops, and at its large memories. Core and mutant are asked for what they set their
flip-flops and outputs to, and write to memories, from the same values in all flip-flops, pins and words that are read.
What differs may only be flip-flops of which the mutant has its own: these then have any value in the mutant, and what
it does to others, and to outputs, must be the same whatever that is. So nothing is ever seen.

Most gates of a mutant have the same inputs as in the core, and are the same one here; the solver is asked for the rest.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path

from proofs.mutation.cases import Case
from proofs.mutation.corresponding import corresponding
from proofs.mutation.gates import Gates, Levels, Place
from proofs.mutation.netlist import SELECTOR, WIDTH, Mutant, yosys
from proofs.mutation.opened import Opened, opened

_AIG = """\
read_rtlil cut.il
setundef -zero
opt_expr
opt_clean
techmap
opt_expr
opt_clean
aigmap
opt_clean
write_aiger -ascii -symbols cut.aag
"""
_CLOCKS = (1, 2, 4)  # over which an induction is tried
_SMALL = 5  # bits of a register of which all values are tried
_FIRST = 4  # clocks after which no flip-flop has what memories gave at power-up
Bits = dict[str, list[int]]  # literals of each port, the lowest bit first


class Cones:
    """Tells what a clock does: literals of all outputs from those of all inputs."""

    def __init__(self, aiger: str) -> None:
        lines = aiger.splitlines()
        _, inputs, _, outputs, ands = map(int, lines[0].split()[1:])
        head = 1 + inputs
        self._inputs = [int(line) for line in lines[1:head]]
        self._outputs = [int(line) for line in lines[head : head + outputs]]
        self._ands = [tuple(map(int, line.split())) for line in lines[head + outputs : head + outputs + ands]]
        names = dict(line.split(maxsplit=1) for line in lines[head + outputs + ands :] if line[0] in "io")
        self._names = [
            [_place(names[f"{kind}{n}"]) for n in range(count)] for kind, count in (("i", inputs), ("o", outputs))
        ]

    @property
    def inputs(self) -> list[Place]:
        """Port and bit of each input."""
        return self._names[0]

    def of(self, gates: Gates, given: Mapping[Place, int]) -> Bits:
        """Return what is set."""
        values = [0] * (2 + 2 * (len(self._inputs) + len(self._ands)))

        def put(literal: int, value: int) -> None:
            values[literal], values[literal ^ 1] = value, value ^ 1

        put(0, 0)
        for literal, name in zip(self._inputs, self.inputs, strict=True):
            put(literal, given[name])
        for to, one, other in self._ands:
            put(to, gates.all_of(values[one], values[other]))
        found: Bits = {}
        for (port, bit), literal in zip(self._names[1], self._outputs, strict=True):
            bits = found.setdefault(port, [])
            assert len(bits) == bit
            bits.append(values[literal])
        return found


def _selected(number: int) -> Levels:
    return {(SELECTOR, bit): number >> bit & 1 for bit in range(WIDTH)}


def _next(place: Place) -> str:
    """Return the port with what a flip-flop takes."""
    return f"d_{place[0].removeprefix('q_')}"


def _place(name: str) -> Place:
    """Return port and bit of a symbol."""
    port, _, bit = name.partition("[")
    return port, int(bit.rstrip("]") or 0)


class Cut:
    """A group of mutants, cut, and the core beside them."""

    def __init__(self, cut: Opened, cones: Cones, ports: frozenset[str]) -> None:
        self._cut, self._cones, self._ports = cut, cones, ports
        self._gates = gates = Gates()
        inner = [place for place in cones.inputs if place[0].startswith("q_")]
        outer = [place for place in cones.inputs if not place[0].startswith("q_")]
        self._outer = [{place: gates.new() for place in outer} for _ in range(_FIRST + max(_CLOCKS))]
        self._other = {place: gates.new() for place in inner}
        anything = {place: gates.new() for place in inner}
        level = {
            (f"q_{k}", bit): level for k, one in enumerate(cut.registers) for bit, level in enumerate(one.init[::-1])
        }
        begun = {place: literal if level[place] == "x" else int(level[place]) for place, literal in anything.items()}
        after = self._core(begun, len(self._outer))
        kept = corresponding(gates, anything, after[_FIRST][0], lambda inner: self._core(inner, 2)[1][0])
        self._after = {False: self._core(kept, max(_CLOCKS)), True: after}
        self._words = [list(self._known(outer)) for outer in self._outer]
        self._facts = self._registers(after[_FIRST][0])

    def _known(self, outer: Levels) -> Iterator[int]:
        """Yield that words which are read are in the memory, if that is not written."""
        for k, memory in enumerate(self._cut.memories):
            if not memory.written and memory.reads == 1 and len(memory.words) == 1 << memory.address_width:
                bits = [outer[f"word_{k}", bit] for bit in range(memory.width)]
                yield self._gates.one_of(bits, {*memory.words})

    def _registers(self, first: Levels) -> list[int]:
        """Return what registers hold: one of the words of a memory, or 0, if they are as wide as it and it follows; one
        of the values that follow, if they are small.
        """
        gates, facts = self._gates, list[int]()
        (now, _), (after, _) = self._after[False][:2]
        begun = [fact for words in self._words[:_FIRST] for fact in words]
        words = [{*memory.words, 0} for memory in self._cut.memories if not memory.written]
        widths = [memory.width for memory in self._cut.memories if not memory.written]
        held = [
            [[level[f"q_{k}", bit] for bit in range(register.width)] for level in (first, now, after)]
            for k, register in enumerate(self._cut.registers)
        ]
        wide = [(one, some) for some, width in zip(words, widths, strict=True) for one in held if len(one[0]) == width]
        wide = [(one, some) for one, some in wide if not gates.may_be(gates.one_of(one[0], some) ^ 1, begun)]
        while True:
            facts = [gates.one_of(one[1], some) for one, some in wide]
            left = [
                (one, some)
                for one, some in wide
                if not gates.may_be(gates.one_of(one[2], some) ^ 1, self._words[0] + facts)
            ]
            if len(left) == len(wide):
                break
            wide = left
        for one in held:
            if 1 < len(one[0]) <= _SMALL:
                values = {*range(1 << len(one[0]))}
                some = {value for value in values if gates.may_be(gates.one_of(one[0], {value}), begun)}
                before = -1
                while before != len(some) < len(values):
                    before = len(some)
                    for value in values - some:
                        given = [*self._words[0], *facts, gates.one_of(one[1], some)]
                        if gates.may_be(gates.one_of(one[2], {value}), given):
                            some.add(value)
                if some != values:
                    facts.append(gates.one_of(one[1], some))
        return facts

    def _core(self, inner: Levels, clocks: int) -> list[tuple[Levels, Bits]]:
        """Return of each clock what is in the flip-flops of the core, and what it sets."""
        found = []
        for outer in self._outer[:clocks]:
            bits = self._cones.of(self._gates, {**outer, **inner, **_selected(0)})
            found.append((inner, bits))
            inner = {place: bits[_next(place)][place[1]] for place in inner}
        return found

    def same(self, number: int) -> bool:
        """Tell whether a mutant is proven to be equivalent."""
        return any(self._follows(number, clocks) for clocks in _CLOCKS)

    def _follows(self, number: int, clocks: int) -> bool:
        """Tell whether that is so by induction over some clocks: in the last of any, and in all but the last of the
        first ones.
        """
        own: set[Place] = set()
        while True:
            more: set[Place] = set()
            for begins, last in ((False, clocks - 1), (True, _FIRST + clocks - 2)):
                found = self._differing(number, own, begins, last)
                if found is None:
                    return False
                more |= found
            if not more:
                return True
            own |= more

    def _differing(self, number: int, own: set[Place], begins: bool, last: int) -> set[Place] | None:
        """Return further flip-flops that the mutant may set otherwise in the last of some clocks, or, if these are the
        first ones, in any; None if more may differ than these.

        In the clocks until then all that is not its own is as in the core.
        """
        gates, given, more = self._gates, list[int](), set[Place]()
        facts = [] if begins else self._facts
        shared, core = self._after[begins][0]
        values = {place: shared[place] if begins else self._other[place] for place in own}
        for clock, (outer, (shared, core)) in enumerate(
            zip(self._outer[: last + 1], self._after[begins], strict=False)
        ):
            inner = {**outer, **shared, **values, **_selected(number)}
            found = self._cones.of(gates, inner)
            if words := self._read(core, found, outer, given):
                found = self._cones.of(gates, inner | words)
            after = {place: found[_next(place)][place[1]] for place in shared}
            values = {place: after[place] for place in own}
            facts = facts + self._words[clock]
            if not begins and clock < last:
                continue

            def wrong(literal: int, facts: list[int] = facts) -> bool:
                return gates.may_be(literal, given) and gates.may_be(literal, given + facts)

            if any(wrong(literal) for literal in self._seen(core, found)):
                return None
            other = {place: gates.differ(core[_next(place)][place[1]], after[place]) for place in shared.keys() - own}
            more |= {place for place, literal in other.items() if wrong(literal)}
        return more

    def _read(self, core: Bits, found: Bits, outer: Levels, given: list[int]) -> Levels:
        """Return words that the mutant reads where its address may be another; they are those of the core else."""
        words: Levels = {}
        for k, memory in enumerate(self._cut.memories):
            for read in range(memory.reads):
                part = slice(read * memory.address_width, (read + 1) * memory.address_width)
                apart = self._gates.unequal(core[f"address_{k}"][part], found[f"address_{k}"][part])
                if not self._gates.may_be(apart, given):
                    continue
                for bit in range(read * memory.width, (read + 1) * memory.width):
                    place = (f"word_{k}", bit)
                    words[place] = self._gates.new()
                    wrong = self._gates.differ(words[place], outer[place])
                    given.append(self._gates.all_of(wrong, apart ^ 1) ^ 1)
        return words

    def _seen(self, core: Bits, found: Bits) -> list[int]:
        """Return what must not be: that an output or something written differs."""
        gates = self._gates
        wrong = [gates.unequal(core[port], bits) for port, bits in found.items() if port in self._ports]
        for k, memory in enumerate(self._cut.memories):
            if not memory.written:
                continue
            mask, place, data = (f"{name}_{k}" for name in ("mask", "place", "data"))
            placed = gates.unequal(core[place], found[place])
            for bit in range(memory.width):
                other = gates.any_of(placed, gates.differ(core[data][bit], found[data][bit]))
                wrong += [
                    gates.differ(core[mask][bit], found[mask][bit]),
                    gates.all_of(core[mask][bit], other),
                ]
        return wrong


def alike(case: Case, flat: str, group: list[Mutant], folder: Path) -> list[bool]:
    """Tell of each mutant whether it is proven to be equivalent so."""
    if not group:
        return []
    cut = opened(flat, group, folder, "r:SIZE>0")
    (folder / "cut.il").write_text(cut.text)
    yosys(_AIG, folder)
    found = Cut(cut, Cones((folder / "cut.aag").read_text()), frozenset(port.name for port in case.pins.outputs))
    return [found.same(number) for number in range(1, len(group) + 1)]
