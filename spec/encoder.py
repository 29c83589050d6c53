"""The incremental encoder."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Encoder:
    """A two-line incremental encoder and how its edges are counted.

    Parameters
    ----------
    pulses_per_rev : int
        Periods of one line in a revolution (PPR, also called lines or cycles per revolution).
    decoding : int
        Counts per period: 4 (every edge), 2 (both edges of A) or 1 (A while B is low).

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    pulses_per_rev: int
    decoding: int = 4

    def __post_init__(self) -> None:
        if self.decoding not in (1, 2, 4):
            raise ValueError(f"decoding must be 1, 2 or 4, not {self.decoding}")
        if not 1 <= self.counts_per_rev <= 1 << 24:
            raise ValueError(
                f"pulses_per_rev must be from 1 to {(1 << 24) // self.decoding} with x{self.decoding} decoding, "
                f"not {self.pulses_per_rev}"
            )

    @property
    def counts_per_rev(self) -> int:
        """P, counts per revolution after decoding."""
        return self.pulses_per_rev * self.decoding
