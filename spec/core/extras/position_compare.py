"""Position compare: pulses at positions, which lie equally apart, or which a program lists."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Self

from tachometry.spec.core.extras.extra import Extra
from tachometry.spec.core.front_end import Pin
from tachometry.spec.core.numbers import Numbers
from tachometry.spec.core.timing import whole_clocks
from tachometry.spec.language.field import Draft, Field, position_words
from tachometry.spec.language.option import REQUIRED, ParameterError, option
from tachometry.spec.language.port import TICK, Port, held, strobe
from tachometry.spec.language.units import plural

VALID = "position_compare_valid"  # the strobe
COUNT_WIDTH = 16  # bits of the number of pulses, which wraps
MAX_CLOCKS = 1 << 24
MAX_DEPTH = 1 << 12
FORWARD, BACKWARD, BOTH = DIRECTIONS = "forward", "backward", "both"
# Inputs of a list, which registers have on a bus.
LIST_PINS = NEXT, APPEND, CLEAR = "position_compare_next", "position_compare_append", "position_compare_clear"
FINEST_BITS = 17  # fraction bits of places between counts, as they are asked for: one more than any core has
_PLACES = r"(-?\d{1,15}(?:\.\d{1,16})?):(\d{1,15}(?:\.\d{1,16})?):(\d{1,15})"
_FORM = re.compile(rf"(?:{_PLACES}|list:(\d{{1,15}})):([^:]+)(?::({'|'.join(DIRECTIONS)}))?(?::(fine))?", re.ASCII)


@dataclass(frozen=True)
class Compare:
    """Positions at which there are pulses, and the length of these."""

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
        places = f"{self.written(self.start)}:{self.written(self.step)}:{self.count}"
        usual = BOTH if self.depth else FORWARD
        return (
            (f"list:{self.depth}" if self.depth else places)
            + f":{self.width}"
            + f":{self.direction}" * (self.direction != usual)
            + ":fine" * self.fine
        )

    def written(self, place: int) -> str:
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

    def in_lsb(self, place: int, position_fine_bits: int) -> int:
        """Return a place, or a distance, in 2^-position_fine_bits counts if it is fine, else in counts."""
        return place >> FINEST_BITS - position_fine_bits if self.fine else place


@dataclass(frozen=True, kw_only=True)
class PositionCompare(Extra):
    """Output `position_compare` has a pulse at each position that the shaft passes."""

    name = "position_compare"
    place = -1

    places: Compare = option(  # noqa: RUF009
        REQUIRED,
        "Pulses at positions, such as 100:100:50:10us. Output position_compare has pulses of WIDTH, a "
        "time or clocks, at COUNT positions (0: no end) from START on, STEP counts apart. They come while "
        "the shaft turns forward; with :backward at the end backward, with :both either way. "
        "list:DEPTH:WIDTH takes positions that a program writes, up to DEPTH ahead. With :fine at the end "
        "START and STEP may lie between counts, at places that track finds.",
        name="position-compare",
        metavar="[START:STEP:COUNT|list:DEPTH]:WIDTH",
        parse=Compare.parse,
        tests=("", "2:3:0:2clk", "1.5:2.5:0:2clk:fine", "-2:3:40:1clk:backward", "3:4:9:1clk:both", "list:3:2clk"),
        few=3,
        tacit=True,
    )

    def missing(self) -> Mapping[str, str]:
        found = {"axes": "must be left out with --axes: what compares positions is for one axis"}
        found["sampled"] = "must be left out with an encoder that is read: it needs edges"
        if self.places.depth:
            found["demo"] = "must not be a list with a demo, which has no input for it"
            found["loop"] = "must not be a list together with --loop, whose inputs are commands"
        return found

    def clocks(self, spec: Numbers) -> int:
        """Return clocks of a pulse; ParameterError if it has no whole number of them."""
        return whole_clocks(self.name, self.places.width, spec.timing.clock_hz)

    def fine_bits(self, spec: Numbers) -> int:
        """Return the fraction bits of its positions."""
        return spec.carrying.position_fine_bits if self.places.fine and spec.carrying else 0

    def check(self, spec: Numbers) -> None:
        for why in self._reasons(spec):
            raise ParameterError(self.name, why)

    def _reasons(self, spec: Numbers) -> Iterator[str]:
        """Yield reasons against it: a position, number or time out of range, or a pulse that lasts into the next."""
        places, clocks = self.places, self.clocks(spec)
        if places.fine:
            if places.depth or places.direction == BOTH:
                yield "must not be fine with :both or a list: type 100:12.5:0:10us:fine"
            if spec.carrying is None:
                yield "must not be fine with this method: position_fine is of --method track"
            if (places.start | places.step) % (1 << FINEST_BITS - (bits := self.fine_bits(spec))):
                yield f"must have START and STEP in multiples of 2^-{bits} count, see --position-fine-bits"
        one = 1 << FINEST_BITS if places.fine else 1
        half = one << spec.position_width - 1
        fit = (half - 1 - places.start) // places.step + 1 if places.both and places.step > 0 else 1 << COUNT_WIDTH
        ranges = {
            "start": (places.start, -half, half - 1),
            "step": (places.step, 1, half - 1),
            "count": (places.count, 0, min(fit, (1 << COUNT_WIDTH) - 1)),
        }
        ranges = {} if places.depth else ranges
        for name, (value, least, most) in (ranges | {"width in clocks": (clocks, 1, MAX_CLOCKS)}).items():
            shown = places.written if name in ("start", "step") else str
            if not least <= value <= most:
                yield f"must have a {name} from {shown(least)} to {shown(most)} here, not {shown(value)}"
        fastest = Fraction(0)
        if spec.max_speed is not None:
            fastest = min(spec.max_speed.counts(spec.encoder.counts_per_rev, spec.tick.seconds(1)), Fraction(1))
        if not places.depth and fastest * one * clocks >= places.step:
            longest = math.ceil(Fraction(places.step, one) / fastest) - 1
            why = f"must have a WIDTH of at most {longest} clocks here, not {clocks}"
            yield f"{why}: at --max-speed the shaft is at the next position then"
        # A tick that is too short for the method has an error of its own.
        fits = spec.carrying is None or spec.carrying.latency <= spec.times.shortest_tick
        if places.fine and not fits and spec.times.min_tick_cycles <= spec.timing.tick_cycles:
            yield "must not be fine here: it takes a longer tick or a shorter --filter"

    def pins(self, spec: Numbers) -> Iterable[Pin]:
        texts = {
            NEXT: f"Position that {APPEND} appends to the list of the position compare.",
            APPEND: "Appends it, in each clock in which it is high; if there is room in the list.",
            CLEAR: "Empties the list of the position compare.",
        }
        for name, text in texts.items() if self.places.depth else ():
            width = spec.position_width if name == NEXT else 1
            port = Port(name, "input", width, signed=width > 1, help=f"{text} Synchronous to clk.")
            yield Pin(port, act=True)

    def ports(self, spec: Numbers) -> Iterable[Port]:
        text = f"Pulse at a position, of {self.places.width}. It does not wait for a tick."
        yield held(TICK, "position_compare", help=text)
        text = "Pulses of the position compare since reset; it wraps."
        yield held(TICK, "position_compare_count", COUNT_WIDTH, help=text)
        if depth := self.places.depth:
            text = f"Positions in the list of the position compare, with the one that is awaited: {depth} are all."
            yield held(TICK, "position_compare_waiting", depth.bit_length(), help=text)
        yield strobe(VALID, "The first clock of a pulse of the position compare.")
        text, fine = "Position of the latest pulse of the position compare.", self.fine_bits(spec)
        unit = f"2^-{fine} counts" if fine else "counts"
        yield held(VALID, "position_compare_position", spec.position_width + fine, signed=True, unit=unit, help=text)

    def registers(self, spec: Numbers) -> Iterable[Draft]:
        if not self.places.depth:
            return
        help = "Position for the list of the position compare."
        yield from position_words("POSITION_COMPARE_NEXT", help, NEXT, spec.position_width)
        append = "Writing 1 appends POSITION_COMPARE_NEXT, if there is room."
        fields = (
            Field("append", 1, 0, append, writable=True, single=True, port=APPEND),
            Field("clear", 1, 1, "Writing 1 empties the list.", writable=True, single=True, port=CLEAR),
        )
        help = "Changes the list of the position compare; POSITION_COMPARE_WAITING says how long it is."
        yield "POSITION_COMPARE_LIST", help, fields, {}

    def latency(self, spec: Numbers) -> Mapping[str, int]:
        if self.places.fine:  # it is at the place itself
            return {}
        return {"pin_to_position_compare": spec.latency.pin_to_count + spec.latency.tick + 1}

    def tour(self, spec: Numbers) -> Sequence[int]:
        start, apart = (self.places.in_lsb(place, 0) for place in (self.places.start, self.places.apart))
        return () if self.places.depth else (start, start + 2 * apart)

    def row(self, spec: Numbers, run: Any) -> tuple[str, str]:
        pulses = run.tables[VALID].position_compare_position
        last = f", the last at position {pulses[-1] / (1 << self.fine_bits(spec)):.15g}" if len(pulses) else None
        return "position compare", f"{plural(len(pulses), 'pulse')}{last or self._none(spec, run.ticks.position)}"

    def _none(self, spec: Numbers, position: Any) -> str:
        """Return why there were no pulses."""
        if self.places.depth:
            return ": its list is empty here, and a program fills it"
        first = str(self.places).split(":")[0] if self.places.fine else self.places.ahead(spec.position_width)
        turning = "" if self.places.both else f" while the shaft turned {self.places.direction}"
        return f": {first} was not reached{turning}, as position was {position.min()} to {position.max()}"
