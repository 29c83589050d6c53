"""How long an upset can be seen."""

from tachometry.spec.methods.rairan import RairanTachometer
from tachometry.spec.tachometer import TachometerSpec


def recovery_clocks(spec: TachometerSpec) -> int | None:
    """Clocks after which, from any state of the flip-flops, all outputs are right again; position aside.

    Right is what docs/verification.md says. Counters that an upset has set beyond their ends go on to where they wrap.
    None: a low-pass filter forgets by and by, Table 1 of Rairán 2013 to the letter only with counts.
    """
    if spec.lowpass is not None or (isinstance(spec, RairanTachometer) and spec.paper_exact):
        return None
    conditioned = 2 + (1 << max(spec.filter_clocks - 1, 1).bit_length() if spec.filter_clocks else 0)
    # One to decode; then the first window that is whole begins with the end of another.
    window = 1 + (1 << max(spec.longest_tick - 2, 0).bit_length())
    return conditioned + 1 + window + spec.remembered_clocks + spec.tick_latency + spec.tick_to_velocity
