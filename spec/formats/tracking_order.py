"""Where a machine has the instructions of the tracking method: what a jump does besides, and what must wait."""

from dataclasses import replace

from tachometry.spec.formats.tracking_instruction import EARLY, Code, Instruction, Jump, Left, same
from tachometry.spec.formats.tracking_units import APART, Start

_MOST_SELECTED = 4  # instructions: a jump that is taken costs as much
_OF_STORE = ("first", "word", "subtract", "by_sign", "keep", "store")


def spaced(code: Code, ports: int) -> Code:
    """Return a code with enough instructions between a word's change and its use."""
    made: list[Instruction] = []
    places: list[int] = []
    for one in code.instructions:
        reads, backs = one.reads, range(1, min(APART, len(made) + 1))
        near = (back for back in backs if any(same(made[-back].store, word) for word in reads))
        made += [Instruction()] * (APART - next(near, APART))
        while ports > 1 and (
            _clash(one, *made[:-4:-1]) or _clash(_target(code, one), Instruction(), one, *made[:-2:-1])
        ):
            made.append(Instruction())
        places.append(len(made))
        made.append(one)
    return Code(tuple(made), {label: places[place] for label, place in code.labels.items()})


def _target(code: Code, one: Instruction) -> Instruction:
    """Return the instruction to which one of the quick machine jumps early, which is two clocks later; or nothing."""
    return code.instructions[code.labels[one.target]] if one.target and one.jump in EARLY else Instruction()


def _clash(one: Instruction, *others: Instruction) -> bool:
    """Return whether an instruction is too early for the block unit, as of three before it; see `BlockUnit`."""
    before, second, third = (*others, *[Instruction()] * 3)[:3]
    if one.start == Start.BY:
        return second.start == Start.EXP or third.start == Start.TIMES
    return before.start == Start.BY and (one.start == Start.TIMES or one.how == "by")


def _takes_sum(code: list[Instruction], labels: dict[str, int], place: int) -> bool:
    """Return whether the sum is taken with which a place is reached."""
    one = code[place]
    if one.jump == Jump.ALWAYS:
        return _takes_sum(code, labels, labels[one.target])
    if one == Instruction(jump=one.jump, target=one.target) and one.jump in (Jump.EMPTY, Jump.ONE):
        return any(_takes_sum(code, labels, at) for at in (place + 1, labels[one.target]))
    return one.jump in (Jump.NEG, Jump.POS) or (one.jump != Jump.END and one.left != Left.ZERO)


def _is_store(one: Instruction) -> bool:
    return bool(one.store) and one == Instruction(Left.ZERO, *(getattr(one, name) for name in _OF_STORE))


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
            if 0 < after - at <= _MOST_SELECTED and same_way and not _takes_sum(code, labels, after):
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
                term in entered or _takes_sum(code, labels, at) or (code[term].keep and takes_sign(at))
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
