"""Recovery of a core from an upset: after how many clocks its outputs are right again."""

from tachometry.spec.core.follows import Follows, S


class Recovery(Follows[S]):
    """Says how long it takes, from any state of the flip-flops, until all outputs are right again; position aside.

    docs/concepts/verification.md defines when outputs are right. Counters that an upset has set beyond their ends
    continue until they wrap.
    """

    @property
    def clocks(self) -> int | None:
        """Clocks after which all is right; None: the core has a low-pass filter, which forgets only gradually, or a
        wheel with a gap, which must come.
        """
        spec = self.spec
        if spec.lowpass is not None or spec.front_end.wheel is not None:
            return None
        # What counts the ticks of a silence may have to begin anew.
        silence = ((1 << spec.timing.max_ticks.bit_length()) + 1) * spec.times.longest_tick
        method = self.remembered + spec.latency.tick_to_velocity
        return self.front + max(method, silence) + spec.latency.tick

    @property
    def front(self) -> int:
        """Clocks after which, from any state, a window begins all counts of which are right."""
        clocks, longest = self.spec.filter_clocks, self.spec.times.longest_tick
        # A line that must be known anew has to hold still once more.
        held = 1 << max(clocks - 1, 1).bit_length()
        conditioned = 2 + (held + clocks if clocks else 0)
        # One clock to decode. The first complete window then begins with the end of another.
        window = 1 + (1 << (longest if longest >= 16 else max(longest - 2, 0)).bit_length())
        return conditioned + 1 + window

    @property
    def remembered(self) -> int:
        """Clocks of right counts after which the method remembers nothing from before."""
        raise NotImplementedError
