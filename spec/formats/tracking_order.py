"""Where a machine has the instructions of the tracking method: what a jump does besides, and what must wait."""

from dataclasses import replace

from tachometry.spec.formats.tracking_instruction import Code, Instruction, Jump, Left, same
from tachometry.spec.formats.tracking_units import APART, BLOCK, Start

_MOST_SELECTED = 4  # instructions: a jump that is taken costs as much
_OF_STORE = ("first", "word", "subtract", "by_sign", "keep", "store")

# Clocks from a start until the unit shifts, until it reads its table, and until another power or product may begin.
_SHIFTS = {Start.LOG: 1, Start.BY: 1, Start.OVER: 1, Start.EXP: 3, Start.TIMES: 4}
_READS = {Start.GAIN: 1, Start.EXP: 1, Start.LOG: 2}
_HOLDS = {Start.TIMES: 3, Start.EXP: 2}
ROUNDED = (Start.EXP, Start.OVER, Start.TIMES)
FACTOR = 2  # clocks from where a factor begins until a product by it
PAST = 8  # clocks after which nothing of an instruction is under way


def is_result(one: Instruction) -> bool:
    """Return whether an operation begins whose result is read."""
    return BLOCK.of(one.start) > 0


def clash(before: Instruction, one: Instruction, clocks: int) -> bool:
    """Return whether an instruction may not come so many clocks after another."""
    if clocks < APART and before.store and any(same(before.store, word) for word in one.reads):
        return True
    first, second = before.start, one.start
    if before.keep and one.first == "$places" and clocks < 2:  # an edge that the sign chooses
        return True
    if first == Start.BY and clocks < FACTOR and (second == Start.TIMES or one.how == "by"):
        return True
    if second == Start.CHANCE:
        return first in ROUNDED and clocks < BLOCK.of(first) - 2
    if not first or not second:
        return False
    busy = second in _HOLDS and clocks < _HOLDS.get(first, 1)
    together = any(at.get(first, -1) == clocks + at.get(second, PAST) for at in (_SHIFTS, _READS))
    return busy or together or (is_result(before) and BLOCK.of(first) == clocks + (BLOCK.of(second) or PAST))


def spaced(code: Code) -> Code:
    """Return a code with enough instructions between a word's change and its use."""
    made: list[Instruction] = []
    places: list[int] = []
    for one in code.instructions:
        reads, backs = one.reads, range(1, min(APART, len(made) + 1))
        near = (
            back
            for back in backs
            if any(same(made[-back].store, word) for word in reads) or (made[-back].keep and one.first == "$places")
        )
        made += [Instruction()] * (APART - next(near, APART))
        places.append(len(made))
        made.append(one)
    return Code(tuple(made), {label: places[place] for label, place in code.labels.items()})


def takes_sum(code: list[Instruction], labels: dict[str, int], place: int) -> bool:
    """Return whether the sum is taken with which a place is reached."""
    one = code[place]
    if one.jump == Jump.ALWAYS:
        return takes_sum(code, labels, labels[one.target])
    if one == Instruction(jump=one.jump, target=one.target) and one.jump in (Jump.EMPTY, Jump.ONE):
        return any(takes_sum(code, labels, at) for at in (place + 1, labels[one.target]))
    return one.jump in (Jump.NEG, Jump.POS) or (one.jump != Jump.END and one.left != Left.ZERO)


def _is_store(one: Instruction) -> bool:
    return bool(one.store) and one == Instruction(Left.ZERO, *(getattr(one, name) for name in _OF_STORE))


def doubled(code: list[Instruction], labels: dict[str, int]) -> tuple[list[Instruction], dict[str, int]]:
    """Return a code in which what is gone to often stands in the place of each `goto`, so that it is a region's part.

    It is that of several counts where it was, so no jump there is for one count; elsewhere all are.
    """
    often = {labels[name] for name in ("known", "lone", "heard", "sized", "ready", "five") if name in labels}
    entered = {labels[one.target]: one.target for one in code if one.target and labels[one.target] not in often}
    made: list[Instruction] = []
    places: list[int] = []

    def copy(one: Instruction) -> None:
        while one.jump == Jump.ALWAYS and labels[one.target] in often:
            place = labels[one.target]
            while place not in entered:
                one, place = code[place], place + 1
                to_one = one.jump == Jump.ONE and labels[one.target] in often
                one = replace(one, jump=Jump.ALWAYS) if to_one else one
                if one.jump in (Jump.ALWAYS, Jump.END):
                    break
                made.append(one)
            else:
                one = Instruction(jump=Jump.ALWAYS, target=entered[place])
        made.append(one)

    for one in code:
        places.append(len(made))
        if one.jump != Jump.ONE or labels[one.target] not in often:
            copy(one)
    return made, {label: places[place] for label, place in labels.items()}


def selected(code: list[Instruction], labels: dict[str, int]) -> tuple[list[Instruction], dict[str, int]]:
    """Return a code in which a sum is only stored, or its sign kept, on a condition, where jumps passed over no more.

    Each of these takes one instruction, and leaves the sum as it was.
    """
    code, skipped, entered = [*code], set[int](), {*labels.values()}
    for place, one in enumerate(code):
        opposite = {Jump.NEG: Jump.POS, Jump.POS: Jump.NEG}.get(one.jump)
        if opposite and one == Instruction(jump=one.jump, target=one.target):
            at = after = place + 1
            while _is_store(code[after]) and after not in entered:
                after += 1
            met = labels[one.target]  # where the jump would go on
            same_way = after == met or code[after] == code[met] == Instruction(jump=Jump.END)
            if 0 < after - at <= _MOST_SELECTED and same_way and not takes_sum(code, labels, after):
                code[at:after] = [replace(each, jump=opposite) for each in code[at:after]]
                skipped.add(place)
    made = _without(code, labels, skipped)
    return [*made.instructions], {**made.labels}


def joined(code: list[Instruction], labels: dict[str, int]) -> Code:
    """Return a code in which a jump also adds the term behind it, or the one at its target; it tests the sum before."""

    def is_term(place: int) -> bool:
        one = code[place]
        return Instruction(one.left, one.first, one.word, one.subtract, one.by_sign, one.keep) == one != Instruction()

    def takes_sign(place: int) -> bool:
        one = code[place]
        if one.by_sign or one.keep or one.jump == Jump.END:
            return one.by_sign
        ahead = [] if one.jump == Jump.ALWAYS else [place + 1]
        return any(takes_sign(following) for following in [*ahead, *([labels[one.target]] if one.target else [])])

    entered = {*labels.values()}
    labels = dict(labels)
    skipped: set[int] = set()
    for place, one in enumerate(code):
        always = one.jump == Jump.ALWAYS
        if one.target and one == Instruction(jump=one.jump, target=one.target):
            at = labels[one.target]
            term = at if always else place + 1
            free = always or not (
                term in entered or takes_sum(code, labels, at) or (code[term].keep and takes_sign(at))
            )
            stored = code[place - 1].store
            if free and is_term(term) and not any(same(stored, word) for word in code[term].reads):
                target = f"{one.target}+1" if always else one.target
                labels.setdefault(target, term + 1)
                code[place] = replace(code[term], jump=one.jump, target=target)
                skipped |= set() if always else {term}
    return _without(code, labels, skipped)


def _without(code: list[Instruction], labels: dict[str, int], skipped: set[int]) -> Code:
    """Return a code without these places, and without what nothing reaches."""
    made: list[Instruction] = []
    places: list[int] = []  # where each one is among those that are made
    entered = {labels[one.target] for one in code if one.target}
    for place, one in enumerate(code):
        places.append(len(made))
        ended = place and code[place - 1].jump in (Jump.ALWAYS, Jump.END) and place not in entered
        if place not in skipped and not ended:
            made.append(one)
    return Code(tuple(made), {label: places[place] for label, place in labels.items()})
