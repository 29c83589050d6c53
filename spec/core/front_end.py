"""The front end of a core: its lines and other inputs, and what sets the position."""

from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.sensors import EDGE, USUAL_STATE, Levels
from tachometry.spec.core.tooth_wheel import ToothWheel, parts_of
from tachometry.spec.language.port import Port

# The options that inputs of `controls` come with.
OF_CONTROLS = {"preset": "preset", "home": "index_once"}


@dataclass(frozen=True)
class Pin:
    """An input that comes with an extra.

    With `lines`, one name for each bit, it is asynchronous, and passes the synchroniser and the glitch filter. With
    `of` it is the asynchronous complement of that line. Else it is synchronous to clk.
    """

    port: Port
    lines: tuple[str, ...] = ()
    of: str = ""
    holds: int = 0  # clocks for which a complement may equal its line
    rest: int = 0  # its level where nobody drives it; of a complement the other level of its line
    act: bool = False  # on a bus a register takes its place, and no bench drives it


@dataclass(frozen=True)
class FrontEnd:
    """Inputs of a core; where its index and its modulus are."""

    asked: Asked
    longest: int  # clocks after which an update is forced
    pins: tuple[Pin, ...] = ()  # inputs of extras

    @property
    def lines(self) -> tuple[str, ...]:
        """Lines of the sensor, the index and `controls` included."""
        of_index = ("z",) if self.asked.index and not self.asked.encoder.teeth else ()  # a pattern needs none
        return (*self.asked.encoder.kind.lines, *of_index, *self.controls)

    @property
    def blanked(self) -> dict[str, int | None]:
        """Lines that are held for a time after a change, and the level on the pin that starts it; None: both do."""
        if not self.asked.blanking_clocks:
            return {}
        encoder = self.asked.encoder
        rises = encoder.kind.held(encoder.decoding).items()
        return {line: int(line not in encoder.inverted) if alone else None for line, alone in rises}

    @property
    def blanked_counts(self) -> Fraction:
        """Most counts in a clock, if each edge that starts the blanking comes as it ends."""
        edges = 1 if None not in self.blanked.values() else 2
        return Fraction(self.asked.encoder.decoding, edges * self.asked.blanking_clocks)

    @property
    def complemented(self) -> tuple[str, ...]:
        """Lines that come with their complements, which are inputs as well: `a_n` of `a`."""
        return tuple(pin.of for pin in self.pins if pin.of)

    @property
    def wheel(self) -> ToothWheel | None:
        """The wheel, if its teeth make a pattern; they are as far apart as an update may take."""
        if not (pattern := self.asked.encoder.teeth):
            return None
        parts = parts_of(pattern)
        teeth = sum(number - max(missing, 0) for number, missing in parts)
        gaps = tuple(missing for _, missing in parts if missing > 0)
        return ToothWheel(teeth, gaps, (1 << self.longest.bit_length()) - 1)

    @property
    def controls(self) -> tuple[str, ...]:
        """Inputs whose rises a program or a switch makes."""
        return ("preset",) * (self.asked.preset is not None) + ("home",) * self.index_once

    @property
    def pulsed(self) -> tuple[str, ...]:
        """Inputs that a simulation may let rise."""
        return (*self.controls, *self.sensed)

    @property
    def sensed(self) -> tuple[str, ...]:
        """Lines of these inputs that are asynchronous, each a bit of one of them."""
        return tuple(line for pin in self.pins for line in pin.lines)

    @property
    def moves_position(self) -> bool:
        """Whether something else than counts changes the position."""
        sampled = self.asked.encoder.sampled is not None  # whose first read is absolute
        return self.index_resets or self.asked.preset is not None or sampled

    @property
    def index_resets(self) -> bool:
        """Whether the index sets the position to 0."""
        return self.asked.index is not None and self.asked.index.reset

    @property
    def index_once(self) -> bool:
        """Whether the index is taken once, after input `home` rises."""
        return self.asked.index is not None and self.asked.index.once

    @property
    def index_watched(self) -> bool:
        """Whether a watch counts from index to index, each of which is taken."""
        return self.asked.index is not None and not self.asked.index.once

    @property
    def shifted_modulus(self) -> Fraction | None:
        """The modulus, if a program may shift the place within it."""
        modulus = self.asked.modulus
        return modulus if modulus and modulus.denominator == 1 and self.asked.encoder.sampled is None else None

    @property
    def index_state(self) -> Levels | None:
        """Levels of the lines in which the index is taken; None: it is where Z rises, or there is none."""
        if self.asked.index is None:
            return None
        at = self.asked.index.at or (USUAL_STATE if self.asked.encoder.sensor == "quadrature" else EDGE)
        return None if at == EDGE else tuple(int(word[-1]) for word in at.split(","))

    @property
    def index_place(self) -> int:
        """Place in the cycle of the lines where the index is expected; 0 if it is where Z rises."""
        return 0 if self.index_state is None else self.asked.encoder.kind.cycle.index(self.index_state)
