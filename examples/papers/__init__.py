"""The papers' figures are computed anew: each module draws some, and compares them with the words of the paper."""

from collections.abc import Callable

from papers import rairan_algorithm, rairan_runs, tsuji_loops, tsuji_methods, tsuji_runs
from papers.lab import Lab
from papers.result import Result

# In the order of the papers.
FIGURES: dict[str, Callable[[Lab], Result]] = {
    "tsuji5": tsuji_runs.fig05,
    "tsuji6": tsuji_methods.fig06,
    "tsuji7": tsuji_methods.fig07,
    "tsuji8": tsuji_methods.fig08,
    "tsuji9": tsuji_runs.fig09,
    "tsuji12": tsuji_runs.fig12,
    "tsuji13": tsuji_loops.fig13,
    "tsuji14": tsuji_loops.fig14,
    "tsuji15": tsuji_loops.fig15,
    "rairan2": rairan_algorithm.fig2,
    "rairan3": rairan_algorithm.fig3,
    "rairan5": rairan_runs.fig5,
    "rairan7": rairan_runs.fig7,
}
LOOPS = ("tsuji13", "tsuji14", "tsuji15")  # which need a C++ compiler
