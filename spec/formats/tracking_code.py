"""How the listing of the tracking method becomes instructions of a machine, and how many clocks these take.

The machine has one adder with an accumulator, the *sum*; a memory of words; and a unit that takes products,
logarithms, powers and shifts, and whose result is read as `~`. An instruction takes a clock. In the small machine it
waits while the unit works and it needs it. A word is read before its use, so none is read right behind its change. A
jump tests the sum that was before it, and meanwhile adds a term as others do; it stores nothing. The quick machine
reads two words at a time, so it takes the first two terms of a line at once. It stores a sum on a condition where a
jump would pass over that, and waits for nothing, see `tracking_schedule`.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property

from tachometry.spec.formats.settling import SETTLING, SHARED
from tachometry.spec.formats.tracking import Tracking
from tachometry.spec.formats.tracking_instruction import CHOSEN, OFFSETS, Code, Instruction, Jump, Left
from tachometry.spec.formats.tracking_listing import LISTING
from tachometry.spec.formats.tracking_order import doubled, joined, selected, spaced
from tachometry.spec.formats.tracking_schedule import scheduled, to_next
from tachometry.spec.formats.tracking_units import STAGES, Start, Times

SMOOTH = ("velocity_smooth", "smooth_delay")
SMOOTH_DELAY_BITS = 32
INPUTS = ("number", "counts", "places", "times", "last", "moved", "length")
# Each by its number; standstill: not if it is negative; the last two only of a program with `smooth`.
OUTPUTS = ("", "velocity", "position_fine", "velocity_std", "acceleration", "standstill", *SMOOTH)
ADDRESS_BITS = 7
FIRST_CHOSEN = (1 << ADDRESS_BITS) - 8  # address of what the tick chooses
FIRST_OFFSET = FIRST_CHOSEN - (1 << ADDRESS_BITS - 1)  # another bit, so that few cells choose
FIRST_INPUT = FIRST_CHOSEN - 8  # of inputs: the words there are 0
_LEFTS = {"lo+": Left.LEAST, "hi+": Left.MOST}


_STARTS = ("log", "exp", "by", "chance")


def _change(word: str, rest: Iterator[str]) -> dict[str, object]:
    """Return what a word, with those that follow it, changes in the instruction before."""
    if word in _STARTS:
        return {"start": Start[word.upper()]}
    if word == "keep":
        return {"keep": True}
    if word == "out":
        return {"output": next(rest)}
    return {"start": Start.TIMES if word == "product" else Start[word.upper()], "how": next(rest)}


def _chain(words: list[str]) -> list[Instruction]:
    """Return the instructions of a line of the listing."""
    done: list[Instruction] = []
    store = words[0] if words[1:2] == ["="] else ""
    rest = iter(words[2:] if store else words)
    fresh = False  # the sum is 0 as yet

    def add(left: Left, word: str, sign: str) -> None:
        nonlocal fresh
        left = Left.ZERO if fresh else left
        fresh = False
        first, word = (word, "") if word[0] == "$" else ("", word * (word != "zero"))
        done.append(Instruction(left, first, word, "-" in sign, "s" in sign))

    def last(**changes: object) -> None:
        if not done:
            done.append(Instruction())
        done[-1] = replace(done[-1], **changes)  # type: ignore[arg-type]

    for number, word in enumerate(rest):
        if word in ("+", "-", "s+", "s-"):
            add(Left.SUM, next(rest), word)
        elif word in _LEFTS:
            add(_LEFTS[word], next(rest), "+")
        elif word in ("min", "max"):
            limit, left = next(rest), Left.LEAST if word == "min" else Left.MOST
            if limit != "zero":
                add(Left.SUM, limit, "-")
            add(left, limit, "+")
        elif word in ("keep", "over", "gain", "product", "out") or (word in _STARTS and number):
            last(**_change(word, rest))
        elif word in ("zero", "sum"):
            fresh = word == "zero"
        else:
            add(Left.ZERO, word, "+")
    if fresh:
        add(Left.ZERO, "zero", "+")
    if store:
        last(store=store)
    return done


def _paired(chain: list[Instruction]) -> list[Instruction]:
    """Return a line whose first two terms are added at once, if one of them is a word or an input as it is."""
    one, other = (*chain, Instruction(Left.ZERO))[:2]
    if one == Instruction(Left.ZERO, one.first, one.word, one.subtract, one.by_sign) and other.left == Left.SUM:
        for plain, right in ((one, other), (other, one)):
            first = plain.first or plain.word
            if not (first in ("", "~", *CHOSEN) or plain.subtract or plain.by_sign or right.first):
                both = replace(other, first=first, word=right.word, subtract=right.subtract, by_sign=right.by_sign)
                return [replace(both, left=Left.ZERO), *chain[2:]]
    return chain


@cache
def assembled(listing: str = LISTING + SETTLING, ports: int = 1, **kind: bool) -> Code:
    """Return the instructions of a listing, with some that do nothing where a word would be read too early.

    The one that reads a word is `APART` instructions behind one that stores it, or more. Each reads `ports` words.
    """
    code: list[Instruction] = []
    labels: dict[str, int] = {}
    wanted = dict.fromkeys(("smooth", "reads", "map", "period", "waits", "settles"), False)
    wanted |= {"block": ports > 1, "serial": ports == 1, **kind}
    within, wanted["edges"], wanted["plain"] = True, not wanted["reads"], not wanted["map"]
    wanted["kinds"] = wanted["edges"] or wanted["period"]
    for line in re.sub("#.*", "", listing).replace(";", "\n").splitlines():
        words = [SHARED.get(word, word) for word in line.split()]
        while words and words[0] in wanted:
            if words[1] == "{":
                within = wanted[words[0]]
            words = words[1:] if wanted[words[0]] else []
        within |= words == ["}"]
        if words in (["{"], ["}"], []) or not within:
            continue
        if words[0].endswith(":"):
            labels[words[0][:-1]] = len(code)
        elif words[0] == "if":
            code.append(Instruction(jump=Jump[words[1].upper()], target=words[3]))
        elif words[0] == "goto":
            code.append(Instruction(jump=Jump.ALWAYS, target=words[1]))
        elif words == ["end"]:
            code.append(Instruction(jump=Jump.END))
        else:
            chain = _chain(words)
            code += _paired(chain) if ports > 1 else chain
    if ports > 1:
        return scheduled(*doubled(*selected(code, labels)))
    return spaced(joined(code, labels))


@cache
def _longest(times: Times, output: str = "", **kind: bool) -> int:
    """Return the clocks of the longest way to an output or, without one, to the last instruction."""
    return max(_longest_of(counts, times, output, kind) for counts in range(3))


def _longest_of(counts: int, times: Times, output: str, kind: Mapping[str, bool]) -> int:
    """Return them for no count, one, or several; nothing else of how ways exclude each other is known."""
    known = {Jump.ALWAYS: True, Jump.END: True, Jump.EMPTY: counts == 0, Jump.ONE: counts == 1}
    made = assembled(ports=times.ports, **kind)
    code, labels = made.instructions, made.labels
    entry: dict[int, tuple[int, int]] = {labels["tick"]: (0, 0)}  # clock, and when the unit has finished
    longest, open_ = 0, {labels["tick"]}
    while open_:
        place = min(open_)  # ways that join go on together
        open_.remove(place)
        clock, free = entry[place]
        one = code[place]
        begun = times.of(one.start) if times.ports == 1 else 0
        clock = max(clock, free) if begun or one.word == "~" else clock
        if begun:
            free = clock + begun
        clock += 1
        if one.output == output if output else one.jump == Jump.END:
            longest = max(longest, clock)
            continue
        following = [] if known.get(one.jump) else [(place + 1, clock)]
        if one.target and known.get(one.jump, True):
            following.append((labels[one.target], clock - 1 + (to_next(one) if times.ports > 1 else 1 + STAGES)))
        for after, at in following:
            before = entry.get(after, (-1, -1))
            now = max(before[0], at), max(before[1], free)
            if now != before:
                entry[after] = now
                open_.add(after)
    return longest


@dataclass(frozen=True)
class Program:
    """The program of a tracking recursion on a machine, its words, and its clocks."""

    form: Tracking
    times: Times  # of the unit
    # clocks from an edge to the port, less those of the program: the velocity is that of the clock in which it is shown
    delay: int
    smooth: bool = False  # whether it also has the outputs `SMOOTH`
    settles: bool = False  # whether a place that waits for a count goes to the middle of it

    @cached_property
    def code(self) -> Code:
        """The instructions."""
        return assembled(ports=self.times.ports, **self._kind)

    @property
    def _kind(self) -> dict[str, bool]:
        form, mapped = self.form, self.form.displacement is not None
        kind = {"smooth": self.smooth, "reads": form.sampled, "map": mapped, "period": form.period_bits > 0}
        return kind | {"waits": form.waits, "settles": self.settles}

    @property
    def outputs(self) -> tuple[str, ...]:
        """The names of its outputs."""
        return tuple(name for name in OUTPUTS[1:] if self.smooth or name not in SMOOTH)

    @property
    def ahead(self) -> int:
        """Clocks by which the shown velocity is ahead of the tick."""
        return self.delay + self.velocity_clocks

    @cached_property
    def velocity_clocks(self) -> int:
        """Clocks from the tick until the velocity is there, which the quick machine shows before the rest."""
        if self.times.ports == 1:
            return self.clocks
        beside = [_longest(self.times, name, **self._kind) for name in ("standstill", *SMOOTH) if name in self.outputs]
        return max(_longest(self.times, "velocity", **self._kind) - 1, *beside) + self.times.fetch_clocks

    @cached_property
    def clocks(self) -> int:
        """Clocks from the tick until the last output holds, by the longest way."""
        last = max(_longest(self.times, name, **self._kind) for name in self.outputs)
        return last + self.times.fetch_clocks

    @cached_property
    def all_clocks(self) -> int:
        """Clocks from a tick until the next may come."""
        return _longest(self.times, **self._kind) + self.times.fetch_clocks - 2 * (self.times.ports > 1)

    @cached_property
    def constants(self) -> dict[str, int]:
        """Constants by name."""
        return {**self.form.constants, "ahead": self.ahead << self.form.time_bits}

    @cached_property
    def words(self) -> dict[str, int]:
        """First contents of all words by name: what changes, constants; before those from half on the offsets."""
        used = [name for one in self.code.instructions for name in (*one.reads, one.store)]
        names = dict.fromkeys(name for name in used if name and name not in CHOSEN)
        chosen = (*OFFSETS[: 1 << self.form.kind_bits], "zero")  # which is in the place of no offset
        others = [name for name in names if name not in self.constants and name not in chosen]
        others += [name for name in self.constants if name in names and name not in chosen]
        assert len(others) + len(chosen) <= FIRST_INPUT
        return {name: self.constants.get(name, 0) for name in (*others[:FIRST_OFFSET], *chosen, *others[FIRST_OFFSET:])}

    @cached_property
    def addresses(self) -> dict[str, int]:
        """Addresses of words, and of what the tick chooses among the offsets."""
        chosen = {name: FIRST_CHOSEN + number for number, name in enumerate(CHOSEN)}
        return {name: number for number, name in enumerate(self.words)} | chosen | {"": 0}

    @cached_property
    def shifts(self) -> tuple[tuple[Start, int], ...]:
        """The operations of the unit that shift, and by how much, by number."""
        return tuple(sorted({found for one in self.code.instructions if (found := self._shift(one))}))

    def _shift(self, one: Instruction) -> tuple[Start, int] | None:
        if one.start in (Start.NONE, Start.CHANCE, Start.GAIN) or one.how == "by":
            return None
        return one.start, self.form.shifts[one.how] if one.start == Start.TIMES else int(one.how or 0)

    def number(self, one: Instruction) -> int:
        """Return the number of the shift or of the table of an instruction; what `by` says has the last one."""
        if one.start == Start.GAIN:
            return int(one.how)
        shift = self._shift(one)
        return BY_FACTOR if one.how == "by" else self.shifts.index(shift) if shift else 0


HOW_BITS = 4
BY_FACTOR = (1 << HOW_BITS) - 1
