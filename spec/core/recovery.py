"""Recovery of a core from an upset: after how many clocks its outputs are right again."""

from dataclasses import dataclass

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.tick import Tick


@dataclass(frozen=True)
class Recovery:
    """How long it takes, from any state of the flip-flops, until all outputs are right again; position aside.

    docs/concepts/verification.md defines when outputs are right. Counters that an upset has set beyond their ends
    continue until they wrap.
    """

    asked: Asked
    tick: Tick
    latency: Latency
    remembered: int | None  # clocks of right counts after which the method remembers nothing from before; None: never

    @property
    def clocks(self) -> int | None:
        """Clocks after which all is right; None: the core forgets only gradually, as a low-pass filter does, or has a
        wheel with a pattern, which must come.
        """
        asked = self.asked
        if self.remembered is None or asked.lowpass is not None or asked.encoder.teeth:
            return None
        # What counts the ticks of a silence may have to begin anew.
        silence = ((1 << asked.timing.max_ticks.bit_length()) + 1) * self.tick.longest
        return self.front + max(self.remembered + self.latency.tick_to_velocity, silence) + self.latency.tick

    @property
    def front(self) -> int:
        """Clocks after which, from any state, a window begins all counts of which are right."""
        clocks, longest = self.asked.filter_clocks, self.tick.longest
        # A line that must be known anew has to hold still once more.
        held = 1 << max(clocks - 1, 1).bit_length()
        conditioned = 2 + (held + clocks if clocks else 0)
        if blanked := self.asked.blanking_clocks:  # the time that is left, then the line as it is
            conditioned += 1 << blanked.bit_length()
        # One clock to decode. The first complete window then begins with the end of another.
        window = 1 + (1 << (longest if longest >= 16 else max(longest - 2, 0)).bit_length())
        return conditioned + 1 + window
