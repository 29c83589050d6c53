"""The operations of the tracking datapath, and how steps become instructions.

A word of the memory is x. `ac` is the accumulator, `mq` holds multipliers, dividends and quotients, `sign` the sign
that `KEEP` has found, `flag` a condition. Every path through the program takes the same number of clocks: `Choice` pads
the shorter of two.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum

MAX_STEPS = 127


class Op(IntEnum):
    """Operations of the datapath."""

    LOAD = 0  # ac = x
    ADD = 1  # ac = ac + x
    SUB = 2  # ac = ac − x
    LOAD_SIGNED = 3  # ac = −x if `sign`, else x
    STORE = 4  # x = ac
    KEEP = 5  # x = ac, sign = ac < 0
    SIGN = 23  # sign = ac < 0
    DOUBLE = 24  # ac = ac << steps, for mq without its leading bit
    MUL = 6  # ac = x·mq / 2^(steps − 1), rounded, with the low bits of mq
    DIV = 7  # mq = ⌊mq·2^(steps − W) / x⌋
    FRACTION = 8  # mq = ⌊ac·2^steps / x⌋, for ac < x and mq without leading bits
    SHIFT = 9  # ac = ac >> steps
    TO_MQ = 10  # mq = ac
    FROM_MQ = 11  # ac = mq
    INPUT = 12  # ac = an input
    ADD_INPUT = 25  # ac = ac + an input
    SUB_INPUT = 26  # ac = ac − an input
    POSITIVE = 13  # ac = max(ac, 0)
    NEGATIVE = 14  # ac = min(ac, 0)
    TEST = 15  # flag = ac ≥ 0
    TEST_AND = 16  # flag = flag and ac ≥ 0
    TEST_OR = 17  # flag = flag or ac ≥ 0
    JUMP = 18  # to the address, if a condition holds
    LEVEL = 19  # changes the level of λ
    PHASE = 20  # what the recursion has seen: nothing, a count, a speed
    OUT = 21  # an update: velocity in mq, acceleration in ac, p in x
    WAIT = 22


class Input(IntEnum):
    """Lists the words that `INPUT` loads."""

    TIMES = 0  # Σ of the times from the counts of the tick to its end, clocks
    NUMBER = 1  # n, of these counts, shifted left by the bits of a mean
    PLACES = 2  # Σ of their places relative to the end of the tick, counts
    MOVED = 3  # counts of the tick, forward less backward
    LENGTH = 4  # clocks of the tick
    LENGTH_SHIFTED = 5  # the same, shifted left as `gap_shifted` is
    ZERO = 7


class Condition(IntEnum):
    """When `JUMP` jumps."""

    ALWAYS = 0
    NEGATIVE = 1  # ac < 0
    FLAG = 2
    COUNTED = 3  # the tick has counts
    BEYOND = 4  # more than the greatest speed has
    RESTS = 5  # phase is rest
    BEGUN = 6  # phase is one count
    QUIET = 7  # no count for the maximum time


class Level(IntEnum):
    """Lists the effects of `LEVEL`."""

    FIRST = 0
    BACK = 1  # STEP_BACK levels, not beyond the first
    NEXT = 2  # not beyond the last


class Phase(IntEnum):
    """Says how much the recursion knows."""

    REST = 0
    BEGUN = 1
    TRACKS = 2


@dataclass(frozen=True)
class Do:
    """An instruction: an operation, the name of a word or a number for its address field, and its clocks."""

    op: Op
    word: str | int = 0
    steps: int = 1


@dataclass(frozen=True)
class Choice:
    """Two ways, one of which is gone; both take the same time."""

    condition: Condition
    then: "Sequence[Step]"
    otherwise: "Sequence[Step]" = ()


Step = Do | Choice


@dataclass(frozen=True)
class Instruction:
    """An instruction as the datapath reads it."""

    op: Op
    address: int
    steps: int


# A jump that is taken costs two clocks more: what was fetched behind it is not used.
NOT_TAKEN, TAKEN = 1, 3
_READS = (Op.LOAD, Op.ADD, Op.SUB, Op.LOAD_SIGNED, Op.MUL, Op.DIV, Op.FRACTION, Op.OUT)
_CHANGES = (Op.STORE, Op.KEEP, Op.LEVEL)


def _spaced(steps: Sequence[Step]) -> list[Step]:
    """Return the steps, with a wait where one would read a word before it is written, or while another one is.

    A word is read two steps before its use. So none is read two steps behind a change, nor what the last step changed.
    """
    spaced: list[Step] = []

    def changes(back: int) -> Do | None:
        step = spaced[-back] if len(spaced) >= back else None
        return step if isinstance(step, Do) and step.op in _CHANGES else None

    for step in steps:
        if isinstance(step, Choice):
            if changes(1):  # what is read behind the jump
                spaced.append(Do(Op.WAIT))
        elif step.op in _READS:
            last = changes(1)
            if last and (last.op == Op.LEVEL or last.word == step.word):
                spaced += [Do(Op.WAIT)] * 2
            elif changes(2):
                spaced.append(Do(Op.WAIT))
        spaced.append(step)
    return spaced


def clocks(steps: Sequence[Step]) -> int:
    """Return clocks of some steps."""
    return sum(
        step.steps if isinstance(step, Do) else NOT_TAKEN + sum(_ways(step)[0]) + TAKEN for step in _spaced(steps)
    )


def _ways(choice: Choice) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return clocks of `otherwise` and of `then`, each with those that have to be waited behind it."""
    otherwise, then = clocks(choice.otherwise), clocks(choice.then)
    # What follows may read what `then` has written last, so there are two waits between.
    both = max(NOT_TAKEN + otherwise + TAKEN, TAKEN + then + 2)
    return (otherwise, both - NOT_TAKEN - otherwise - TAKEN), (then, both - TAKEN - then)


def assembled(steps: Sequence[Step], address: Callable[[str | int], int], begin: int = 0) -> list[Instruction]:
    """Return instructions of some steps, the first of which is at `begin`; `address` is that of a word."""
    code: list[Instruction] = []

    def wait(clocks: int) -> None:
        while clocks:
            now = min(clocks, MAX_STEPS)
            code.append(Instruction(Op.WAIT, 0, now))
            clocks -= now

    for step in _spaced(steps):
        if isinstance(step, Do):
            code.append(Instruction(step.op, address(step.word), step.steps))
            continue
        (_, wait_otherwise), (_, wait_then) = _ways(step)
        jump = len(code)
        code.append(Instruction(Op.JUMP, 0, step.condition))
        code += assembled(step.otherwise, address, begin + len(code))
        wait(wait_otherwise)
        over = len(code)
        code.append(Instruction(Op.JUMP, 0, Condition.ALWAYS))
        code[jump] = Instruction(Op.JUMP, begin + len(code), step.condition)
        code += assembled(step.then, address, begin + len(code))
        wait(1)
        wait(wait_then - 1)
        code[over] = Instruction(Op.JUMP, begin + len(code), Condition.ALWAYS)
    return code
