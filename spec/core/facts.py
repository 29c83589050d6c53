"""Facts that set a method apart from the others."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from tachometry.spec.language.port import TICK


@dataclass(frozen=True, kw_only=True)
class Facts:
    """Says how a method differs from the others; here is what most answer."""

    title: str  # what texts call it
    summary: str  # what it does, for --help: it stands behind the name
    update_by: str  # what makes its updates
    interval: str  # what the output of this name is
    forced: str = "No count caused this update: the maximum time passed, or the velocity decayed."
    takes_reads: bool = False  # whether it takes positions that are read once a tick
    own_ticks: bool = False  # whether it ends the ticks itself, by what it counts
    bounds: bool = True  # whether its windows can have bounds
    last_at_rest: bool = False  # whether the 0 that the maximum time forces is the last update before the next count
    # tenths of the maximum time after which it shows that the shaft stands, counted from the last count but one
    rest_tenths: int = 17
    # whether the observer of a control loop waits for a count: it takes no update that is `forced`
    awaits_count: bool = False
    # strobe with which `standstill` changes: TICK after empty ticks, UPDATE if the datapath measures silence in clocks
    rests_with: str = TICK
    pairs_all: bool = False  # whether pairwise tests give all options all of their values
    # texts of options that have another default with this method than with all others
    usual: Mapping[str, str] = field(default_factory=dict)
