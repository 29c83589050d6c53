"""In what order, and in which clocks, the quick machine has the instructions of the tracking method.

Its unit begins an operation in any clock, and the result comes some clocks later, to stay until the next one comes.
Nothing waits for it: here every instruction is given a clock in which what it takes is there.

A *chain* is what one sum takes: instructions in a row, with the jump that tests it. A *region* is entered at its begin
alone; jumps leave it. Within one, the chain goes first on which the most clocks depend, those to the velocity before
all others. It may pass a jump if what it changes is not used where that goes. Operations need not begin as listed: of a
chain that reads `~`, the one before it in the listing is meant.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from tachometry.spec.formats.tracking_instruction import CHOSEN, EARLY, OFFSETS, Code, Instruction, Jump, Left
from tachometry.spec.formats.tracking_order import FACTOR, PAST, ROUNDED, clash, is_result, takes_sum
from tachometry.spec.formats.tracking_units import APART, BLOCK, STAGES, Start

_PLAIN = (Start.NONE, Start.LOG, Start.EXP, Start.BY)  # what a jump may begin: its target has the place of `how`
_STALL = 4  # clocks of the longest way that a clock in which nothing is done is worth
_VELOCITY = 1000  # more than any way has


def _arrival(one: Instruction, clock: int) -> int:
    return clock + BLOCK.of(one.start)


def _word(name: str) -> str:
    return "offset" if name in OFFSETS or name in CHOSEN else name


def _read(one: Instruction) -> set[str]:
    """Return what an instruction takes, the sum and the result of the unit aside."""
    taken = {_word(word) for word in one.reads}
    by = one.start == Start.TIMES or one.how == "by"
    others = {"sign": one.by_sign or one.first == "$places", "factor": by, "chance": one.start in ROUNDED}
    return taken | {name for name, is_taken in others.items() if is_taken}


def _changed(one: Instruction) -> set[str]:
    """Return what it changes."""
    others = {"sign": one.keep, "factor": one.start == Start.BY, "chance": one.start == Start.CHANCE}
    words = {_word(one.store): one.store, "out " + one.output: one.output, "~": is_result(one)}
    return {name for name, is_changed in (words | others).items() if is_changed}


def _replaced(one: Instruction) -> set[str]:
    """Return what of that replaces all that was there."""
    return set() if one.store and one.jump else _changed(one) - {"offset"}


def _later(one: Instruction, name: str) -> int:
    """Return the clocks until what it changes may be read; more of a factor, which else begins behind all else."""
    return {"~": BLOCK.of(one.start), "factor": FACTOR + 3, "sign": 1, "chance": 1}.get(name, APART)


def to_next(one: Instruction) -> int:
    """Return the clocks from an instruction to the next one, or to where it jumps."""
    return 1 if not one.target else 2 if one.jump in EARLY else 1 + STAGES


class Listing:
    """Instructions in the order of the listing, and what is still used at each."""

    def __init__(self, code: list[Instruction], labels: dict[str, int]) -> None:
        self.code, self.labels = code, labels
        self.live = [set[str]() for _ in code]
        read = [
            {name for name in _read(one) if name != "sign" or one.by_sign} | {one.word}.intersection("~")
            for one in code
        ]
        gone = [_replaced(one) - taken for one, taken in zip(code, read, strict=True)]
        changed = True
        while changed:
            changed = False
            for place in reversed(range(len(code))):
                live = read[place].union(*(self.live[at] for at in self.following(place))) - gone[place]
                changed |= live != self.live[place]
                self.live[place] = live

    def following(self, place: int) -> Iterator[int]:
        """Yield where it may go on, after its end with the next tick."""
        one = self.code[place]
        if one.jump == Jump.END:
            yield self.labels.get("tick", 0)
        elif one.jump != Jump.ALWAYS and place + 1 < len(self.code):
            yield place + 1
        if one.target:
            yield self.labels[one.target]


@dataclass(frozen=True)
class Placed:
    """An instruction in its clock, from the begin of its region."""

    one: Instruction
    clock: int
    number: int = 0  # of the result that it begins among those of the region; 0: of none, or of one before


State = tuple[list[Placed], int]  # what has its clock, and the first clock after


class Region:
    """Instructions between a place that is jumped to and the next, or one where none goes on."""

    def __init__(self, listing: Listing, begin: int, end: int) -> None:
        self._listing, self.begin, self.end = listing, begin, end
        self._code = code = listing.code
        self._chains: list[list[int]] = []
        self._begun: dict[int, int] = {}  # at which place which result begins, by number
        self._taken: dict[int, int] = {}  # and which is read; 0: one from before the region
        self._lasting = set[int]()  # those that are read where a jump goes, or behind the end
        for place in range(begin, end):
            if place == begin or not takes_sum(code, listing.labels, place):
                self._chains.append([])
            self._chains[-1].append(place)
            if code[place].word == "~":
                self._taken[place] = len(self._begun)
            if is_result(code[place]):
                self._begun[place] = len(self._begun) + 1
            if any("~" in listing.live[at] for at in self._ways(place)):
                self._lasting.add(len(self._begun))
        self._numbers = [{self._begun[place] for place in chain if place in self._begun} for chain in self._chains]
        self._before = self._orders()
        self.entry: list[Placed] = []  # what is under way at the begin, on one way or another
        self.placed: list[Placed] = []
        self.clocks = 0
        self._weights: list[int] = []
        self.needs: dict[str, int] = {}  # clocks of the longest way from where something is read
        self.weight = 0

    @property
    def ends(self) -> bool:
        """Whether none goes on behind it."""
        return self.end == len(self._code) or self._code[self.end - 1].jump in (Jump.ALWAYS, Jump.END)

    def _ways(self, place: int) -> list[int]:
        """Return where it goes on from a place, if not within the region."""
        one = self._code[place]
        ways = [self._listing.labels[one.target]] if one.target else []
        return ways + [self.end] * (place == self.end - 1 and not self.ends)

    @property
    def ways(self) -> list[int]:
        """Where it goes on; what comes behind it first."""
        return [way for place in reversed(range(self.begin, self.end)) for way in reversed(self._ways(place))]

    def _orders(self) -> list[set[int]]:
        """Return which chains must be before each."""
        listing, code, chains = self._listing, self._code, self._chains
        changed = [set[str]().union(*(_changed(code[place]) for place in chain)) - {"~"} for chain in chains]
        read = [set[str]().union(*(_read(code[place]) for place in chain)) for chain in chains]
        kept: list[set[str] | None] = []  # what is used where a jump goes
        for chain in chains:
            targets = [listing.live[listing.labels[code[place].target]] for place in chain if code[place].target]
            kept.append(set[str]().union(*targets) if targets else None)

        def may_not_pass(chain: int, jump: int) -> bool:
            alive = kept[jump]
            if alive is None:
                return False
            lost = {"~"} if self._numbers[chain] else set()
            return bool((changed[chain] | lost) & alive) or any(name.startswith("out ") for name in changed[chain])

        sum_lasts = self.ends or takes_sum(code, listing.labels, self.end)
        before: list[set[int]] = []
        for second in range(len(chains)):
            taken = {self._taken.get(place, 0) for place in chains[second]}
            before.append(
                {
                    first
                    for first in range(second)
                    if changed[first] & (read[second] | changed[second])
                    or read[first] & changed[second]
                    or taken & self._numbers[first]
                    or (self._numbers[second] & self._lasting and self._numbers[first])
                    or (second == len(chains) - 1 and sum_lasts)
                    or (first == 0 and takes_sum(code, listing.labels, self.begin))
                    or (kept[first] is not None and kept[second] is not None)
                    or may_not_pass(first, second)
                    or may_not_pass(second, first)
                }
            )
        return before

    def weigh(self, regions: Mapping[int, "Region"]) -> None:
        """Find how many clocks depend on each chain, and from where something is read; of what follows it is known."""
        code, chains = self._code, self._chains
        following = self.end if not self.ends else self._listing.labels.get(code[self.end - 1].target, -1)
        behind = regions.get(following)
        self._weights = [0] * len(chains)
        for number in reversed(range(len(chains))):
            chain = chains[number]
            weight = len(chain) + (behind.weight if behind else 0)
            ready: dict[str, int] = {}
            for at, place in enumerate(chain):
                one = code[place]
                weight = max(weight, at + 1 + _VELOCITY * (one.output == "velocity"))
                ready |= {name: at + _later(one, name) for name in _changed(one)}
                ready |= {"rounded": at + BLOCK.of(one.start) - 2} if one.start in ROUNDED else {}
            if behind:
                weight = max([weight, *(clock + behind.needs.get(name, 0) for name, clock in ready.items())])
            for later in range(number + 1, len(chains)):
                if number in self._before[later]:
                    weight = max(weight, self._weights[later] + max(len(chain), self._distance(ready, chains[later])))
            self._weights[number] = weight
        self.weight = max(self._weights)
        self.needs = dict(behind.needs) if behind else {}
        for number in reversed(range(len(chains))):
            for at, place in reversed([*enumerate(chains[number])]):
                replaced = _replaced(code[place])
                self.needs = {name: clock for name, clock in self.needs.items() if name not in replaced}
                for name in (*_read(code[place]), code[place].word):
                    self.needs[name] = max(self.needs.get(name, 0), self._weights[number] - at)

    def _distance(self, ready: Mapping[str, int], chain: Sequence[int]) -> int:
        """Return the clocks from the begin of a chain to that of another, by what is ready when."""
        found = 0
        for at, place in enumerate(chain):
            one = self._code[place]
            names = {*_read(one), one.word, *(["rounded"] if one.start == Start.CHANCE else [])}
            found = max([found, *(ready[name] - at for name in names & {*ready})])
        return found

    def place(self) -> None:
        """Give all a clock."""
        state: State = [], 0
        left = {*range(len(self._chains))}
        while left:
            found: list[tuple[int, int, State]] = []
            for number in left:
                rest = left - {number}
                if self._before[number] & left or self._is_early(number, rest):
                    continue
                after_it = self._with(number, state)
                if after_it and self._is_read(after_it, rest):
                    idle = after_it[1] - state[1] - len(self._chains[number])
                    found.append((_STALL * idle - self._weights[number], number, after_it))
            found.sort(key=lambda one: one[:2])
            _, first, (_, clock) = found[0]
            # What fits into the clocks in which nothing would be done comes before it.
            fitting = (one for one in found if (then := self._with(first, one[2])) and then[1] <= clock)
            _, number, state = next(fitting, found[0])
            left.remove(number)
        self.placed, self.clocks = state

    def _is_early(self, number: int, left: set[int]) -> bool:
        """Return whether what reads the result of a chain, or that of such a one, has to wait for another result."""
        numbers = self._numbers[number]
        readers = [
            at for at in left if numbers and any(self._taken.get(place) in numbers for place in self._chains[at])
        ]
        awaited, open_ = set[int](), set[int]().union(*(self._before[reader] & left for reader in readers))
        while open_:
            awaited |= open_
            open_ = set[int]().union(*(self._before[at] & left for at in open_)) - awaited
        return any(self._numbers[at] for at in awaited) or any(self._is_early(at, left - {at}) for at in readers)

    def _with(self, number: int, state: State) -> State | None:
        """Return what a chain makes of a state; None: a result that it reads is gone."""
        placed, clock = [*state[0]], state[1]
        for place in self._chains[number]:
            one, before = self._code[place], placed[-1] if placed else None
            if before and before.clock == clock - 1 and self._is_with_jump(place, placed):
                joint = replace(one, jump=before.one.jump, target=before.one.target)
                placed[-1] = Placed(joint, clock - 1, self._begun.get(place, 0))
                continue
            one = self._of_sum(one, placed)
            while self._waits(one, place, clock, placed):
                clock += 1
            if self._is_lost(place, clock, placed):
                return None
            placed.append(Placed(one, clock, self._begun.get(place, 0)))
            clock += 1
        return placed, clock

    def _is_with_jump(self, place: int, placed: list[Placed]) -> bool:
        """Return whether an instruction can be done with the jump before it, which tests the sum before."""
        one, jump, clock = self._code[place], placed[-1].one, placed[-1].clock
        if not jump.target or jump.jump == Jump.ALWAYS or jump != Instruction(jump=jump.jump, target=jump.target):
            return False
        if one.jump or one.store or one.output or one.start not in _PLAIN or one == Instruction():
            return False
        at = self._listing.labels[jump.target]
        if takes_sum(self._code, self._listing.labels, at) or _changed(one) & self._listing.live[at]:
            return False
        return not self._waits(one, place, clock, placed[:-1]) and not self._is_lost(place, clock, placed[:-1])

    @staticmethod
    def _of_sum(one: Instruction, placed: list[Placed]) -> Instruction:
        """Return an instruction that takes the sum in the place of the word in which that has just been stored."""
        held = next((each.one for each in reversed(placed) if not (each.one.store and each.one.jump)), Instruction())
        word = held.store
        if not word or word != _word(word) or one.left != Left.ZERO or one.first == one.word:
            return one
        if one.first == word:
            return replace(one, left=Left.SUM, first="")
        if one.word == word and not (one.subtract or one.by_sign or one.first.startswith("$")):
            return replace(one, left=Left.SUM, first="", word=one.first)
        return one

    def _waits(self, one: Instruction, place: int, clock: int, placed: list[Placed]) -> bool:
        """Return whether an instruction is too early."""
        near = [each for each in (*self.entry, *placed[-PAST:]) if clock - each.clock < PAST]
        if any(clash(before.one, one, clock - before.clock) for before in near):
            return True
        arrivals = [(_arrival(before.one, before.clock), before.number) for before in near if is_result(before.one)]
        if any(at > clock and number == self._taken.get(place) for at, number in arrivals):
            return True
        last = self._begun.get(place) in self._lasting
        return last and any(at >= _arrival(one, clock) for at, _ in arrivals)

    def _is_lost(self, place: int, clock: int, placed: list[Placed]) -> bool:
        """Return whether another result has come since that which an instruction reads."""
        if place not in self._taken:
            return False
        number = self._taken[place]
        arrivals = [
            (_arrival(each.one, each.clock), each.number) for each in (*self.entry, *placed) if is_result(each.one)
        ]
        came = max((at for at, of in arrivals if of == number and number), default=-PAST)
        return any(came < at <= clock and of != number for at, of in arrivals)

    def _is_read(self, state: State, left: set[int]) -> bool:
        """Return whether each result can be read before the next one comes, if what reads it comes next."""
        while True:
            arrivals = {each.number: _arrival(each.one, each.clock) for each in state[0] if each.number}
            before = [_arrival(each.one, each.clock) for each in self.entry if is_result(each.one)]
            ends: list[tuple[int, int]] = []
            for number in left:
                for taken in {self._taken.get(place, -1) for place in self._chains[number]}:
                    if taken in arrivals or (taken == 0 and arrivals):
                        came = arrivals.get(taken, -PAST)
                        later = [at for at in (*arrivals.values(), *(before if taken else ())) if at > came]
                        ends += [(min(later), number)] if later else []
            if not ends:
                return True
            number = min(ends)[1]
            left = left - {number}
            held = self._before[number] & left or self._is_early(number, left)
            following = None if held else self._with(number, state)
            if not following:
                return False
            state = following


def scheduled(code: list[Instruction], labels: dict[str, int]) -> Code:
    """Return a code whose instructions have their clocks, with some that do nothing in between."""
    listing = Listing(code, labels)
    begins = {0, *(labels[name] for name in ("reset", "tick") if name in labels)}
    begins |= {labels[one.target] for one in code if one.target}
    begins |= {place + 1 for place, one in enumerate(code[:-1]) if one.jump in (Jump.ALWAYS, Jump.END)}
    ends = [*sorted(begins)[1:], len(code)]
    regions = {begin: Region(listing, begin, end) for begin, end in zip(sorted(begins), ends, strict=True)}
    done: dict[int, Region] = {}

    def visit(begin: int) -> None:
        for way in regions[begin].ways:
            if way not in done:
                visit(way)
        done[begin] = regions[begin]

    visit(0)
    for region in done.values():
        region.weigh(done)
    for region in reversed(done.values()):
        region.place()
        passed = [*region.entry, *region.placed]
        ways = [(labels[each.one.target], each.clock, to_next(each.one)) for each in region.placed if each.one.target]
        for way, clock, clocks in (*ways, *[(region.end, region.clocks - 1, 1)] * (not region.ends)):
            under_way = [
                replace(each, clock=each.clock - clock - clocks, number=0) for each in passed if each.clock <= clock
            ]
            regions[way].entry += [each for each in under_way if each.clock > -PAST]
    made: list[Instruction] = []
    places: dict[int, int] = {}
    for begin in sorted(done):
        places[begin] = len(made)
        given = {each.clock: each.one for each in done[begin].placed}
        made += [given.get(clock, Instruction()) for clock in range(done[begin].clocks)]
    return Code(tuple(made), {label: places[place] for label, place in labels.items() if place in places})
