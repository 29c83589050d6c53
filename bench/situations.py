"""The table of all situations: cores as they are, and every rival with its best setting for the row.

Part of docs/measured/compare.md, in tables beside it.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace

from motions import OTHERS, SITUATIONS, Situation
from pages import Rows, markdown

from tachometry.cli.options.methods import listed_methods
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.comparing.baseline_catalogue import BASELINES, settings, steps_curve
from tachometry.sim.studies.comparing.compare import Curve, Judge, core_curve
from tachometry.sim.studies.comparing.comparison import steps_beside
from tachometry.sim.studies.comparing.tune import TUNED, core_settings, error_of
from tachometry.spec import TachometerSpec, of_texts

# Columns that are not tuned: one setting for all situations, as `tachometry compare --methods` takes it.
OURS = ("track", "s", "mt:min-time=1ms")
RIVALS = (*TUNED, *BASELINES)
CORE = {"clock": "48MHz", "tick": "20us", "max-time": "10ms", "max-speed": "400rad/s"}
OF_METHOD = {"track": {"max-time": "100ms"}}  # so that a slow reversal is no rest, which it would forget all at

_EVERY = 5  # ticks between the reads of float models, which take most of the time
_SMALL = 0.01  # rad/s; what is less counts as that in the choice of one setting for all

FIRST_SEED = 1001
_SHOWN = 1.1  # factors above this are on the page
_WON = 0.99  # of another error, and it is less; what is nearer is a matter of seeds

Errors = Mapping[str, float]  # rad/s, RMS, by the name of a method with its options


@dataclass(frozen=True)
class Cell:
    """A setting in a situation."""

    name: str
    mean: float  # rad/s: of the RMS errors with all seeds
    spread: float | None  # rad/s: standard deviation of these; None if there is one only

    @staticmethod
    def of(name: str, errors: list[float]) -> "Cell":
        """Return the row of the errors with all seeds."""
        mean = sum(errors) / len(errors)
        if len(errors) == 1:
            return Cell(name, mean, None)
        return Cell(name, mean, math.sqrt(sum((error - mean) ** 2 for error in errors) / (len(errors) - 1)))

    def __str__(self) -> str:
        return f"{self.mean:.3g}" + ("" if self.spread is None else f" ± {self.spread:.1g}")


Table = Mapping[str, Mapping[str, Cell]]  # by situation, and by the name of a method with its options
Cells = Mapping[str, list[Cell]]  # by situation, in the order of columns


def tried(column: str) -> list[str]:
    """Return all settings of a column; its name is the only one of `OURS`."""
    if column in OURS:
        return [column]
    return [name for name, _ in core_settings(column)] if column in TUNED else settings(column)


def core(situation: Situation, method: str, given: Mapping[str, str]) -> TachometerSpec:
    """Return the core of a method in a situation."""
    return of_texts(method, {"ppr": str(situation.lines), **CORE, **OF_METHOD.get(method, {}), **given})


def errors(situation: Situation, seed: int, names: Iterable[str]) -> Errors:
    """Return RMS errors (rad/s) of methods with one seed; those that are impossible are left out."""
    truth = situation.record(seed)
    steps = steps_beside(core(situation, OURS[0], {}), truth.recording)
    steps = replace(steps, reads=steps.reads[::_EVERY])
    judge = Judge(truth.true_speed, situation.start_s, truth.recording.duration)

    def curve(name: str) -> Curve:
        ((_, method, given),) = listed_methods(name, BASELINES)
        if method is None:
            return steps_curve(name, steps)
        return core_curve(name, spec := core(situation, method, given), PinTrace.of(truth.recording, spec))

    found = {}
    for name in names:
        with suppress(ValueError):  # such as a loop that is not stable
            if (error := error_of(curve(name), judge)) is not None:
                found[name] = error
    return found


def measured(
    situations: Iterable[Situation], n_seeds: int, jobs: int, columns: Iterable[str] = (*OURS, *RIVALS)
) -> Table:
    """Return errors of all settings of the columns by situation and name, with seeds from `FIRST_SEED` on."""
    names = [name for column in columns for name in tried(column)]
    tasks = [
        (situation, seed, names)
        for situation in situations
        for seed in range(FIRST_SEED, FIRST_SEED + (n_seeds if situation.random else 1))
    ]
    if jobs == 1:
        results = [errors(*task) for task in tasks]
    else:
        with ProcessPoolExecutor(jobs) as pool:
            results = list(pool.map(errors, *zip(*tasks, strict=True)))
    found: dict[str, dict[str, list[float]]] = {}
    for (situation, _, _), result in zip(tasks, results, strict=True):
        of_situation = found.setdefault(situation.name, {})
        for name, error in result.items():
            of_situation.setdefault(name, []).append(error)
    return {
        situation: {name: Cell.of(name, errors) for name, errors in by_name.items()}
        for situation, by_name in found.items()
    }


def best(table: Table, columns: Iterable[str]) -> Cells:
    """By situation a cell for each column: the setting with the least mean error there."""
    return {
        situation: [
            min((by_name[name] for name in tried(column) if name in by_name), key=lambda cell: cell.mean)
            for column in columns
        ]
        for situation, by_name in table.items()
    }


def single(table: Table, column: str) -> str:
    """Return the best setting of a column over all situations: the least geometric mean of errors above `_SMALL`."""
    everywhere = [name for name in tried(column) if all(name in by_name for by_name in table.values())]

    def logarithms(name: str) -> float:
        return sum(math.log(max(by_name[name].mean, _SMALL)) for by_name in table.values())

    return min(everywhere, key=logarithms)


def error_table(heads: Iterable[str], cells: Cells) -> Rows:
    """Return errors in rad/s: a row for each situation."""
    return [["situation", *heads], *([situation, *map(str, row)] for situation, row in cells.items())]


def setting_table(cells: Cells) -> Rows:
    """Return the situations as options of the command, and the best settings behind the names of the methods."""
    options = {situation.name: situation.options for situation in (*SITUATIONS, *OTHERS)}
    settings = {name: [cell.name.partition(":")[2] for cell in row] for name, row in cells.items()}
    return [["situation", "options", *RIVALS], *([name, options.get(name, ""), *row] for name, row in settings.items())]


def model_table() -> str:
    """Return the float models and their options, in Markdown."""
    heads = ["method", "what it is", "without options", "options"]
    body = [[f"`{name}`", one.title, one.usual, ", ".join(one.parameters)] for name, one in BASELINES.items()]
    return markdown(heads, body, left=range(len(heads)))


def wins(errors: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Return the error of the first column over that of the best tuned one, by situation, where that is less."""
    ratio = {name: row[0] / min(row[len(OURS) :]) for name, row in errors.items()}
    return {name: over for name, over in sorted(ratio.items(), key=lambda item: -item[1]) if over * _WON > 1}


def verdict(errors: Mapping[str, Sequence[float]]) -> str:
    """Return the claim, and a table of the situations in which a tuned rival is clearly better than tracking."""
    better = wins(errors)
    rival = {name: RIVALS[(tuned := [*errors[name][len(OURS) :]]).index(min(tuned))] for name in better}
    body = [
        [name, f"{over:.{0 if over >= 100 else 2}f}", rival[name]] for name, over in better.items() if over > _SHOWN
    ]
    text = f"In {len(errors) - len(better)} of {len(errors)} situations no tuned rival is better than tracking. In the "
    text += f"other\n{len(better)} tracking is worse, by more than {_SHOWN} in these:\n\n"
    return text + markdown(["situation", "factor", "best rival"], body, (0, 2))


def tables(n_seeds: int, jobs: int) -> dict[str, Rows]:
    """Return the tables of all situations, by the names of their files."""
    everything = measured((*SITUATIONS, *OTHERS), n_seeds, jobs)
    some = {one.name: everything[one.name] for one in SITUATIONS}
    names = (*OURS, *(single(some, rival) for rival in RIVALS))
    return {
        "compare": error_table((*OURS, *RIVALS), best(everything, (*OURS, *RIVALS))),
        "settings": setting_table(best(everything, RIVALS)),
        "one-setting": error_table(names, {one: [of[name] for name in names] for one, of in some.items()}),
    }
