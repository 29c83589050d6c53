"""The papers' figures are computed anew: each module draws some, and holds them against the words of the paper.

`FIGURES` has one function for each; `tachometry figures` draws them all.
"""

from tachometry.sim.figures.rairan_algorithm import fig2, fig3
from tachometry.sim.figures.rairan_runs import fig5, fig7
from tachometry.sim.figures.result import Entry
from tachometry.sim.figures.tsuji_loops import fig13, fig14, fig15
from tachometry.sim.figures.tsuji_methods import fig06, fig07, fig08
from tachometry.sim.figures.tsuji_runs import fig05, fig09, fig12

# In the order of the papers. The seconds are about what each takes: they divide the progress bar.
FIGURES: dict[str, Entry] = {
    entry.name: entry
    for entry in (
        Entry("tsuji5", fig05, 1),
        Entry("tsuji6", fig06, 2),
        Entry("tsuji7", fig07, 2),
        Entry("tsuji8", fig08, 1),
        Entry("tsuji9", fig09, 1),
        Entry("tsuji12", fig12, 20),
        Entry("tsuji13", fig13, 4, compiled=True),
        Entry("tsuji14", fig14, 8, compiled=True),
        Entry("tsuji15", fig15, 45, compiled=True),
        Entry("rairan2", fig2, 1),
        Entry("rairan3", fig3, 1),
        Entry("rairan5", fig5, 50),
        Entry("rairan7", fig7, 5),
    )
}
