"""The index of an encoder: where it is taken, and what it does to the position."""

from dataclasses import dataclass

from tachometry.spec.core.sensors import USUAL_STATE, parse_state
from tachometry.spec.language.option import option

_ONCE = """Take the index once, after input home (with --index). CONTROL.home also arms it. Output homed shows that it \
was taken."""


@dataclass(frozen=True)
class Index:
    """Says what a core does with the index line of its encoder, besides capturing the position."""

    reset: bool = option(False, "The index also sets the position to 0 (with --index).", name="index-reset")
    at: str | None = option(
        None,
        "Place of the index within the mark (with --index). A state of the lines, such as A=1,B=1, while "
        "z is high: one place in both directions. Or edge, where z rises: at one end of the mark forward, "
        "at the other backward. Outputs index_missed and index_wide report that z came without its state, "
        "or met it twice.",
        metavar="[edge|A=1,B=1]",
        shown=f"{USUAL_STATE}; edge for sensors other than quadrature",
        parse=parse_state,
        name="index-at",
        tests=("edge", "A=0,B=1"),
        tacit=True,
    )
    once: bool = option(False, _ONCE, name="index-once", tacit=True)
