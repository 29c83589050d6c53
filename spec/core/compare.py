"""A compare output makes a pulse at positions, which lie equally apart, or which a program lists."""

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Self

from tachometry.spec.core.timing import whole_clocks
from tachometry.spec.language.option import ParameterError

COUNT_WIDTH = 16  # bits of the number of pulses, which wraps
MAX_CLOCKS = 1 << 24
MAX_DEPTH = 1 << 12
FORWARD, BACKWARD, BOTH = DIRECTIONS = "forward", "backward", "both"
LIST_PINS = ("compare_next", "compare_append", "compare_clear")  # inputs of a list, which registers have on a bus
_FORM = re.compile(
    rf"(?:(-?\d{{1,15}}):(\d{{1,15}}):(\d{{1,15}})|list:(\d{{1,15}})):([^:]+)(?::({'|'.join(DIRECTIONS)}))?", re.ASCII
)


@dataclass(frozen=True)
class Compare:
    """Says at which positions there are pulses, and how long they are.

    Parameters
    ----------
    start : int
        The first position.
    step : int
        Counts from a position to the next, in the direction of the pulses; with both directions, forward.
    count : int
        Number of positions; 0: no end.
    width : str
        Length of a pulse, as a time or as clocks.
    direction : str
        The pulses come while the shaft turns `forward`, `backward`, or whichever way (`both`).
    depth : int
        Positions of a list that a program writes, which stands for the first three; 0: there is none.
    """

    start: int
    step: int
    count: int
    width: str
    direction: str = FORWARD
    depth: int = 0

    @classmethod
    def parse(cls, what: str, text: str) -> Self:
        """Read START:STEP:COUNT:WIDTH, such as 100:100:50:10us, or list:DEPTH:WIDTH, such as list:64:10us.

        Behind it may stand :forward, :backward or :both; without it equally distant positions have the first of these,
        and a list has the last.
        """
        found = _FORM.fullmatch(text.strip().lower())
        if found is None:
            form = (
                "must be START:STEP:COUNT:WIDTH, such as 100:100:50:10us, or 100:100:50:10us:backward for positions "
                "that go down by STEP, or :both, or list:DEPTH:WIDTH, such as list:64:10us"
            )
            raise ParameterError(what, f"{form}, not {text!r}")
        start, step, count, depth, width, direction = found.groups()
        if re.fullmatch(r"[\d.]+", width):
            typed = re.sub(r"(:[\d.]+)(?=$|:[a-z])", r"\1us", text.strip().lower())
            raise ParameterError(what, f"must have a WIDTH with a unit: type {typed}, or clk for clocks, not {text!r}")
        if depth is not None:
            return cls(0, 0, 0, width, direction or BOTH, int(depth))
        return cls(int(start), int(step), int(count), width, direction or FORWARD)

    def __str__(self) -> str:
        places = f"list:{self.depth}" if self.depth else f"{self.start}:{self.step}:{self.count}"
        usual = BOTH if self.depth else FORWARD
        return f"{places}:{self.width}" + f":{self.direction}" * (self.direction != usual)

    @property
    def apart(self) -> int:
        """Counts from a position to the next, with their sign."""
        return -self.step if self.direction == BACKWARD else self.step

    @property
    def passed(self) -> int:
        """Positions of those in both directions that lie behind position 0, where the shaft stands after a reset."""
        before = -self.start // self.step + 1 if self.direction == BOTH and self.step else 0
        return max(0, min(before, self.count)) if self.count else before

    def ahead(self, position_width: int) -> int:
        """Return the position that is awaited first; with both directions, the next one forward."""
        half = 1 << position_width - 1
        return (self.start + self.passed * self.step + half) % (2 * half) - half

    def clocks(self, clock_hz: int) -> int:
        """Return clocks of a pulse; ParameterError if it has no whole number of them."""
        return whole_clocks("compare", self.width, clock_hz)

    def check(self, clock_hz: int, position_width: int, fastest: Fraction) -> None:
        """Check that it fits a core whose shaft has at most so many counts in a clock; ParameterError if a position, a
        number or a time is out of range, or if a pulse would last into the next.
        """
        half = 1 << position_width - 1
        clocks = self.clocks(clock_hz)
        ranges = (
            ("start", self.start, -half, half - 1),
            ("step", self.step, 1, half - 1),
            ("count", self.count, 0, (1 << COUNT_WIDTH) - 1),
        )
        for name, value, least, most in (
            *((("depth", self.depth, 2, MAX_DEPTH),) if self.depth else ranges),
            ("width in clocks", clocks, 1, MAX_CLOCKS),
        ):
            if not least <= value <= most:
                raise ParameterError("compare", f"must have a {name} from {least} to {most} here, not {value}")
        if not self.depth and fastest and fastest * clocks >= self.step:
            longest = math.ceil(self.step / fastest) - 1
            raise ParameterError(
                "compare",
                f"must have a WIDTH of at most {longest} clocks here, not {clocks}: at --max-speed the shaft is at the "
                "next position then",
            )
