"""A compare output makes a pulse at positions that lie equally apart."""

import re
from dataclasses import dataclass
from typing import Self

from tachometry.spec.core.timing import whole_clocks
from tachometry.spec.language.option import ParameterError

COUNT_WIDTH = 16  # bits of the number of pulses, which wraps
MAX_CLOCKS = 1 << 24
_FORM = re.compile(r"(-?\d{1,15}):(\d{1,15}):(\d{1,15}):([^:]+)(?::(forward|backward))?", re.ASCII)


@dataclass(frozen=True)
class Compare:
    """Says at which positions there are pulses, and how long they are.

    Parameters
    ----------
    start : int
        The first position.
    step : int
        Counts from a position to the next, in the direction of the pulses.
    count : int
        Number of pulses; 0: no end.
    width : str
        Length of a pulse, as a time or as clocks.
    backward : bool
        The pulses come while the shaft turns backward, and not forward.
    """

    start: int
    step: int
    count: int
    width: str
    backward: bool = False

    @classmethod
    def parse(cls, what: str, text: str) -> Self:
        """Read START:STEP:COUNT:WIDTH, such as 100:100:50:10us, with :forward or :backward behind it, or neither."""
        found = _FORM.fullmatch(text.strip().lower())
        if found is None:
            form = (
                "must be START:STEP:COUNT:WIDTH, such as 100:100:50:10us, or 100:100:50:10us:backward for positions "
                "that go down by STEP"
            )
            raise ParameterError(what, f"{form}, not {text!r}")
        start, step, count, width, direction = found.groups()
        if re.fullmatch(r"[\d.]+", width):
            typed = text.strip().lower().replace(f":{count}:{width}", f":{count}:{width}us")
            raise ParameterError(what, f"must have a WIDTH with a unit: type {typed}, or clk for clocks, not {text!r}")
        return cls(int(start), int(step), int(count), width, direction == "backward")

    def __str__(self) -> str:
        return f"{self.start}:{self.step}:{self.count}:{self.width}{':backward' * self.backward}"

    @property
    def apart(self) -> int:
        """Counts from a position to the next, with their sign."""
        return -self.step if self.backward else self.step

    def clocks(self, clock_hz: int) -> int:
        """Return clocks of a pulse; ParameterError if it has no whole number of them."""
        return whole_clocks("compare", self.width, clock_hz)

    def check(self, clock_hz: int, position_width: int) -> None:
        """Check that it fits a core; ParameterError if a position, a number or a time is out of range."""
        half = 1 << position_width - 1
        clocks = self.clocks(clock_hz)
        for name, value, least, most in (
            ("start", self.start, -half, half - 1),
            ("step", self.step, 1, half - 1),
            ("count", self.count, 0, (1 << COUNT_WIDTH) - 1),
            ("width in clocks", clocks, 1, MAX_CLOCKS),
        ):
            if not least <= value <= most:
                raise ParameterError("compare", f"must have a {name} from {least} to {most} here, not {value}")
