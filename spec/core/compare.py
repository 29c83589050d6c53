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
LIST_PINS = (
    "position_compare_next",
    "position_compare_append",
    "position_compare_clear",
)  # inputs of a list, which registers have on a bus
FINEST_BITS = 17  # fraction bits of places between counts, as they are asked for: one more than any core has
_PLACES = r"(-?\d{1,15}(?:\.\d{1,16})?):(\d{1,15}(?:\.\d{1,16})?):(\d{1,15})"
_FORM = re.compile(rf"(?:{_PLACES}|list:(\d{{1,15}})):([^:]+)(?::({'|'.join(DIRECTIONS)}))?(?::(fine))?", re.ASCII)


@dataclass(frozen=True)
class Compare:
    """Says at which positions there are pulses, and how long they are."""

    start: int  # the first position, in counts; with `fine` in 2^-17 of them, as `step` is
    step: int  # counts from a position to the next, in the direction of the pulses; with both directions, forward
    count: int  # number of positions; 0: no end
    width: str  # length of a pulse, as a time or as clocks
    direction: str = FORWARD  # the pulses come while the shaft turns `forward`, `backward`, or whichever way (`both`)
    depth: int = 0  # positions of a list that a program writes, which stands for the first three; 0: there is none
    # positions lie between the counts as well: `position_fine` is carried on to the clock of the pulse
    fine: bool = False

    @classmethod
    def parse(cls, what: str, text: str) -> Self:
        """Read START:STEP:COUNT:WIDTH, such as 100:100:50:10us, or list:DEPTH:WIDTH, such as list:64:10us.

        Behind it may stand :forward, :backward or :both; without it equally distant positions have the first of these,
        and a list has the last. Then may stand :fine.
        """
        found = _FORM.fullmatch(text.strip().lower())
        if found is None:
            form = (
                "must be START:STEP:COUNT:WIDTH, such as 100:100:50:10us, or 100:100:50:10us:backward for positions "
                "that go down by STEP, or :both, with :fine behind all that, or list:DEPTH:WIDTH, such as list:64:10us"
            )
            raise ParameterError(what, f"{form}, not {text!r}")
        start, step, count, depth, width, direction, fine = found.groups()
        if re.fullmatch(r"[\d.]+", width):
            typed = re.sub(r"(:[\d.]+)(?=$|:[a-z])", r"\1us", text.strip().lower())
            raise ParameterError(what, f"must have a WIDTH with a unit: type {typed}, or clk for clocks, not {text!r}")
        if depth is not None:
            if not 2 <= int(depth) <= MAX_DEPTH:
                raise ParameterError(what, f"must have a DEPTH from 2 to {MAX_DEPTH}, not {depth}")
            return cls(0, 0, 0, width, direction or BOTH, int(depth), fine is not None)
        places = [Fraction(place) * (1 << FINEST_BITS * (fine is not None)) for place in (start, step)]
        if not fine and any(place.denominator > 1 for place in places):
            kind = "whole counts, but with :fine at the end"
            raise ParameterError(what, f"must have START and STEP in {kind}, not {text!r}")
        # What lies between is odd, so that the core refuses it.
        first, apart = (math.floor(place) | (place.denominator > 1) for place in places)
        return cls(first, apart, int(count), width, direction or FORWARD, fine=fine is not None)

    def __str__(self) -> str:
        places = f"{self._written(self.start)}:{self._written(self.step)}:{self.count}"
        usual = BOTH if self.depth else FORWARD
        return (
            (f"list:{self.depth}" if self.depth else places)
            + f":{self.width}"
            + f":{self.direction}" * (self.direction != usual)
            + ":fine" * self.fine
        )

    def _written(self, place: int) -> str:
        """Return a place in counts."""
        if not self.fine:
            return str(place)
        whole, part = divmod(abs(place), 1 << FINEST_BITS)
        digits = f"{part * 10**FINEST_BITS >> FINEST_BITS:0{FINEST_BITS}}".rstrip("0")
        return f"{'-' * (place < 0)}{whole}{'.' * bool(digits)}{digits}"

    @property
    def apart(self) -> int:
        """Counts from a position to the next, with their sign."""
        return -self.step if self.direction == BACKWARD else self.step

    @property
    def both(self) -> bool:
        """Whether positions lie equally apart, and count in both directions."""
        return self.direction == BOTH and not self.depth

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
        return whole_clocks("position_compare", self.width, clock_hz)

    def in_lsb(self, place: int, position_fine_bits: int) -> int:
        """Return a place, or a distance, in 2^-position_fine_bits counts if it is fine, else in counts."""
        return place >> FINEST_BITS - position_fine_bits if self.fine else place

    def check(self, clock_hz: int, position_width: int, fastest: Fraction, position_fine_bits: int | None) -> None:
        """Check that it fits a core whose shaft has at most so many counts in a clock, and whose `position_fine` has so
        many fraction bits, if there is one; ParameterError if a position, a number or a time is out of range, or if a
        pulse would last into the next.
        """
        one = 1 << FINEST_BITS if self.fine else 1
        half = one << position_width - 1
        clocks = self.clocks(clock_hz)
        if self.fine:
            if self.depth or self.direction == BOTH:
                raise ParameterError(
                    "position_compare", "must not be fine with :both or a list: type 100:12.5:0:10us:fine"
                )
            if position_fine_bits is None:
                raise ParameterError(
                    "position_compare", "must not be fine with this method: position_fine is of --method track"
                )
            if (self.start | self.step) % (1 << FINEST_BITS - position_fine_bits):
                grid = f"multiples of 2^-{position_fine_bits} count, see --position-fine-bits"
                raise ParameterError("position_compare", f"must have START and STEP in {grid}")
        fit = (half - 1 - self.start) // self.step + 1 if self.both and self.step > 0 else 1 << COUNT_WIDTH
        ranges = (
            ("start", self.start, -half, half - 1),
            ("step", self.step, 1, half - 1),
            ("count", self.count, 0, min(fit, (1 << COUNT_WIDTH) - 1)),
        )
        for name, value, least, most in (
            *(() if self.depth else ranges),
            ("width in clocks", clocks, 1, MAX_CLOCKS),
        ):
            if not least <= value <= most:
                if name in ("start", "step"):
                    least, most, value = (self._written(place) for place in (least, most, value))
                raise ParameterError("position_compare", f"must have a {name} from {least} to {most} here, not {value}")
        if not self.depth and fastest and fastest * one * clocks >= self.step:
            longest = math.ceil(Fraction(self.step, one) / fastest) - 1
            raise ParameterError(
                "position_compare",
                f"must have a WIDTH of at most {longest} clocks here, not {clocks}: at --max-speed the shaft is at the "
                "next position then",
            )
