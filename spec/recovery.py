"""How long an upset can be seen."""

from tachometry.spec.tachometer import TachometerSpec


def recovery_clocks(spec: TachometerSpec) -> int:
    """Clocks after which, from any state of the flip-flops, all outputs are right again; position aside.

    Right is what docs/verification.md says. Counters that an upset has set beyond their ends go on to where they wrap.
    """
    conditioned = 2 + (1 << max(spec.filter_clocks - 1, 1).bit_length() if spec.filter_clocks else 0)
    # One to decode; then the first window that is whole begins with the end of another.
    window = 1 + (1 << max(spec.longest_tick - 2, 0).bit_length())
    return conditioned + 1 + window + spec.remembered_clocks + spec.tick_latency + spec.tick_to_velocity


def recovery_ticks(spec: TachometerSpec) -> int:
    """The same in ticks, the last one counted whole."""
    return -(-recovery_clocks(spec) // spec.longest_tick)
