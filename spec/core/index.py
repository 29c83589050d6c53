"""The index of an encoder: where it is taken, and what it does to the position."""

from dataclasses import dataclass

from tachometry.spec.core.sensors import USUAL_STATE, parse_state
from tachometry.spec.language.option import option


@dataclass(frozen=True)
class Index:
    """Says what a core does with the index line of its encoder, besides capturing the position."""

    reset: bool = option(False, "The index also sets the position to 0 (with --index).", name="index-reset")
    at: str | None = option(
        None,
        "Where the index is taken (with --index): in a state of the lines, such as A=1,B=1, while z is high, which is "
        "one place in both directions, or edge, where z rises, which is another place backward than forward. Outputs "
        "index_missed and index_wide tell if z comes without its state, or meets it twice.",
        metavar="[edge|A=1,B=1]",
        shown=f"{USUAL_STATE}; edge for sensors other than quadrature",
        parse=parse_state,
        name="index-at",
        tests=("edge", "A=0,B=1"),
        tacit=True,
    )
    once: bool = option(
        False,
        "The index is taken once (with --index): the first one after input home rises, or CONTROL.home is written. "
        "Output homed tells that it was.",
        name="index-once",
        tacit=True,
    )
