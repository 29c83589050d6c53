"""The incremental encoder."""

from dataclasses import dataclass

from tachometry.spec.language.option import REQUIRED, ParameterError, option, parse_whole

_GROUP = "Encoder"


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
    ParameterError
        If a parameter is out of range.
    """

    pulses_per_rev: int = option(
        REQUIRED,
        "Pulses per revolution: periods of line A (or B) in one turn, as in the encoder's data sheet.",
        name="ppr",
        metavar="N",
        group=_GROUP,
        parse=parse_whole,
    )
    decoding: int = option(
        4,
        "Counts per pulse: 4 counts every edge, 2 both edges of A, 1 the edges of A while B is low.",
        metavar="[4|2|1]",
        group=_GROUP,
        tests=("", "2", "1"),
    )

    def __post_init__(self) -> None:
        if self.decoding not in (1, 2, 4):
            raise ParameterError("decoding", f"must be 1, 2 or 4, not {self.decoding}")
        if not 1 <= self.counts_per_rev <= 1 << 24:
            raise ParameterError(
                "pulses_per_rev",
                f"must be from 1 to {(1 << 24) // self.decoding} with x{self.decoding} decoding, "
                f"not {self.pulses_per_rev}",
            )

    @property
    def counts_per_rev(self) -> int:
        """P, counts per revolution after decoding."""
        return self.pulses_per_rev * self.decoding
