"""Facts that set a method apart from the others."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class Facts:
    """Says how a method differs from the others; each answers all of it.

    Parameters
    ----------
    title : str
        What texts call it.
    summary : str
        What it does, for --help: it stands behind the name.
    update_by : str
        What makes its updates.
    own_ticks : bool
        Whether it ends the ticks itself, by what it counts.
    bounds : bool
        Whether its windows can have bounds.
    last_at_rest : bool
        Whether the 0 that the maximum time forces is the last update before the next count.
    rest_tenths : int
        Tenths of the maximum time after which it shows that the shaft stands, counted from the last count but one.
    awaits_count : bool
        Whether the observer of a control loop waits for a count: it takes no update that is `forced`.
    pairs_all : bool
        Whether pairwise tests give all options all of their values.
    usual : mapping of str to str
        Texts of options that have another default with this method than with all others.
    """

    title: str
    summary: str
    update_by: str
    own_ticks: bool
    bounds: bool
    last_at_rest: bool
    rest_tenths: int
    awaits_count: bool
    pairs_all: bool
    usual: Mapping[str, str] = field(default_factory=dict)
