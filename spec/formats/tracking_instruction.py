"""An instruction of the tracking machine, as `tracking_code` makes it of a line of the listing."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from tachometry.spec.formats.tracking_units import Start


class Left(IntEnum):
    """Lists the left operands of the adder."""

    ZERO = 0
    LEAST = 1  # min(sum, 0): the sum if that is negative
    MOST = 2  # max(sum, 0): the sum if not
    SUM = 3


class Jump(IntEnum):
    """When an instruction jumps or, if it stores the sum, when it does: then it leaves the sum as it was."""

    NEVER = 0
    ALWAYS = 1
    NEG = 2  # sum < 0
    POS = 3
    EMPTY = 4  # no count
    ONE = 5
    END = 6


EARLY = (Jump.ALWAYS, Jump.EMPTY, Jump.ONE)  # no sum decides, so the quick machine jumps two clocks earlier

OFFSETS = tuple(f"o{number}" for number in range(8))  # the last four for eighths of a period
CHOSEN = ("o@last", "o@up", "o@down", "o@m1", "o@m2", "o@m3")  # an offset that the tick chooses


@dataclass(frozen=True)
class Instruction:
    """An instruction."""

    left: Left = Left.SUM
    first: str = ""  # a word, or $ and an input, in the place of a left operand of zero
    word: str = ""  # the right operand; ~: the result of the unit
    # whether the operand is subtracted, or added with the sign that was kept; whether the sign of the sum is kept
    subtract: bool = False
    by_sign: bool = False
    keep: bool = False
    store: str = ""  # word that takes the sum; empty: none
    start: Start = Start.NONE
    how: str = ""  # name of a shift, or number of a table of gains
    output: str = ""
    jump: Jump = Jump.NEVER
    target: str = ""

    @property
    def reads(self) -> tuple[str, ...]:
        """The words that it reads."""
        return tuple(word for word in (self.first, self.word) if word and word[0] not in "$~")

    @property
    def text(self) -> str:
        """The instruction as a comment: its sum, what it begins and gives out, and where the program goes on."""
        left = {Left.ZERO: self.first, Left.LEAST: "min(sum, 0)", Left.MOST: "max(sum, 0)", Left.SUM: "sum"}[self.left]
        right = f"{'s' * self.by_sign}{'+-'[self.subtract]} {self.word}" if self.word else ""
        total = f"{left} {right}".strip().removeprefix("+ ") or "0"
        parts = [f"{self.store} = {total}" if self.store else total, "keep" * self.keep]
        parts += [f"begin {self.start.name.lower()} {self.how}".rstrip()] if self.start else []
        parts += [f"out {self.output}"] if self.output else []
        test = {Jump.NEVER: "", Jump.ALWAYS: "", Jump.END: "end"}.get(self.jump, f"if {self.jump.name.lower()}")
        parts.append(f"{test} goto {self.target}".strip() if self.target else test)
        return "; ".join(part for part in parts if part)


@dataclass(frozen=True, eq=False)
class Code:
    """Instructions, and the places of the labels among them."""

    instructions: tuple[Instruction, ...]
    labels: Mapping[str, int]


def same(stored: str, read: str) -> bool:
    """Return whether two names may be of one word."""
    return stored == read or ("o@" in stored + read and {stored, read} <= {*OFFSETS, *CHOSEN})
