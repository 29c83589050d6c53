"""The front end of a core: its lines and other inputs, and what the position is counted within and set by."""

from tachometry.spec.core.follows import Follows, S
from tachometry.spec.core.probe import edges_of
from tachometry.spec.core.sensors import EDGE, USUAL_STATE, Levels
from tachometry.spec.core.tooth_wheel import ToothWheel

# The options that inputs of `controls` come with.
OF_CONTROLS = {"preset": "preset", "home": "index_once"}


class FrontEnd(Follows[S]):
    """Names the inputs of a core, and says where its index and its modulus are."""

    @property
    def lines(self) -> tuple[str, ...]:
        """Lines of the sensor, the index and `controls` included."""
        of_index = ("z",) if self.spec.index and not self.spec.encoder.missing else ()  # a gap needs none
        return (*self.spec.encoder.kind.lines, *of_index, *self.controls)

    @property
    def complemented(self) -> tuple[str, ...]:
        """Lines that come with their complements, which are inputs as well: `a_n` of `a`."""
        spec = self.spec
        if spec.health is None or spec.health.complements is None:
            return ()
        return (*spec.encoder.kind.lines, *("z",) * (spec.index is not None))

    @property
    def wheel(self) -> ToothWheel | None:
        """The wheel, if teeth of it are missing; they are as far apart as an update may take."""
        if not (missing := self.spec.encoder.missing):
            return None
        longest = self.spec.times.longest
        return ToothWheel(self.spec.encoder.pulses_per_rev - missing, missing, (1 << longest.bit_length()) - 1)

    @property
    def controls(self) -> tuple[str, ...]:
        """Inputs whose rises a program or a switch makes."""
        return ("preset",) * (self.spec.preset is not None) + ("home",) * self.index_once

    @property
    def pulsed(self) -> tuple[str, ...]:
        """Inputs that a simulation may let rise."""
        return (*self.controls, *self.probes)

    @property
    def probes(self) -> tuple[str, ...]:
        """Names of the probe inputs, each a bit of `probe`."""
        return tuple(f"probe_{number}" for number in range(len(edges_of(self.spec.probe))))

    @property
    def moves_position(self) -> bool:
        """Whether something else than counts changes the position."""
        return self.index_resets or self.spec.preset is not None

    @property
    def index_resets(self) -> bool:
        """Whether the index sets the position to 0."""
        return self.spec.index is not None and self.spec.index.reset

    @property
    def index_once(self) -> bool:
        """Whether the index is taken once, after input `home` rises."""
        return self.spec.index is not None and self.spec.index.once

    @property
    def index_watched(self) -> bool:
        """Whether a watch counts from index to index, each of which is taken."""
        return self.spec.index is not None and not self.spec.index.once

    @property
    def modulus(self) -> int | None:
        """Counts within which `position_modulo` is; None: there is none."""
        if self.spec.position_modulo is None:
            return None
        of, _, parts = self.spec.position_modulo.partition("/")
        return self.spec.encoder.counts_per_rev // int(parts or 1) if of == "rev" else int(of)

    @property
    def index_state(self) -> Levels | None:
        """Levels of the lines in which the index is taken; None: it is where Z rises, or there is none."""
        if self.spec.index is None:
            return None
        at = self.spec.index.at or (USUAL_STATE if self.spec.encoder.sensor == "quadrature" else EDGE)
        return None if at == EDGE else tuple(int(word[-1]) for word in at.split(","))

    @property
    def index_place(self) -> int:
        """Place in the cycle of the lines where the index is expected; 0 if it is where Z rises."""
        return 0 if self.index_state is None else self.spec.encoder.kind.cycle.index(self.index_state)
