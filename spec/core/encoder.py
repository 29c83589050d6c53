"""The incremental encoder."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tachometry.spec.language.option import REQUIRED, Option, ParameterError, option, parse_whole

_GROUP = "Encoder"
_MOST = 1 << 24  # counts
_OF_TURN: dict[str, Any] = {"metavar": "N", "group": _GROUP, "parse": parse_whole}


def _of_counts(what: str, text: str, known: Mapping[str, Any]) -> int:
    counts, decoding = parse_whole(what, text), int(known["decoding"])
    if not decoding <= counts <= _MOST:
        raise ParameterError(what, f"must be from {decoding} to {_MOST}, not {counts}")
    if counts % decoding:
        raise ParameterError(
            what,
            f"must be a multiple of {decoding}, the counts of a line, not {counts}: for {counts} cycles, as some data "
            f"sheets have it, type --lines {counts}",
        )
    return counts // decoding


def _factor(what: str, text: str) -> int:
    factors = {form.format(factor): factor for factor in (1, 2, 4) for form in ("{}", "x{}", "{}x")}
    if (word := text.strip().lower()) not in factors:
        raise ParameterError(what, f"must be 1, 2 or 4, or x1, x2 or x4, not {text!r}")
    return factors[word]


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
        also=(
            Option("Lines of the disc, which are pulses per revolution (instead of --ppr).", name="lines", **_OF_TURN),
            Option(
                "Counts per revolution, after decoding (instead of --ppr): of 2500 lines 10000.",
                name="cpr",
                parse_at=_of_counts,
                **_OF_TURN,
            ),
        ),
    )
    decoding: int = option(
        4,
        "Counts per pulse: 4 (or x4) counts every edge, 2 both edges of A, 1 the edges of A while B is low.",
        parse=_factor,
        shown="4",
        metavar="[4|2|1]",
        group=_GROUP,
        tests=("", "2", "1"),
    )

    def __post_init__(self) -> None:
        if self.decoding not in (1, 2, 4):
            raise ParameterError("decoding", f"must be 1, 2 or 4, or x1, x2 or x4, not {self.decoding}")
        if not 1 <= self.counts_per_rev <= _MOST:
            raise ParameterError(
                "pulses_per_rev",
                f"must be from 1 to {_MOST // self.decoding} with x{self.decoding} decoding, not {self.pulses_per_rev}",
            )

    @property
    def counts_per_rev(self) -> int:
        """P, counts per revolution after decoding."""
        return self.pulses_per_rev * self.decoding
