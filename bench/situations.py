"""The table of all situations: cores as they are, and every rival with its best setting for the row.

Part of docs/measured/compare.md.
"""

import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace

from motions import OTHERS, SITUATIONS, Situation
from pages import markdown

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
        spec = core(situation, method, given)
        return core_curve(name, spec, PinTrace.of(truth.recording, spec))

    found = {}
    for name in names:
        with suppress(ValueError):  # such as a loop that is not stable
            error = error_of(curve(name), judge)
            if error is not None:
                found[name] = error
    return found


def measured(
    situations: Iterable[Situation], n_seeds: int, jobs: int, columns: Iterable[str] = (*OURS, *RIVALS)
) -> Table:
    """Return errors of all settings of the columns: by situation and by name.

    - `n_seeds`: Number of seeds, from `FIRST_SEED` on, where something is random.
    - `jobs`: Number of processes.
    """
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
    """Return the setting of a column that is the best over all situations, by the geometric mean of its errors.

    An error that is less than `_SMALL` counts as that: what is good enough in one situation makes up for no other.
    """
    everywhere = [name for name in tried(column) if all(name in by_name for by_name in table.values())]

    def logarithms(name: str) -> float:
        return sum(math.log(max(by_name[name].mean, _SMALL)) for by_name in table.values())

    return min(everywhere, key=logarithms)


def error_table(heads: Sequence[str], cells: Cells) -> str:
    """Return errors in Markdown; the least of a row is bold."""

    def shown(row: list[Cell]) -> list[str]:
        least = min(cell.mean for cell in row)
        return [f"**{cell}**" if cell.mean == least else str(cell) for cell in row]

    return markdown(["situation", *heads], [[situation, *shown(row)] for situation, row in cells.items()])


def setting_table(cells: Cells) -> str:
    """Return the situations as options of the command, and the best settings behind the names of the methods, in
    Markdown.
    """
    options = {situation.name: f"`{situation.options}`" for situation in (*SITUATIONS, *OTHERS)}

    def shown(cell: Cell) -> str:
        return f"`{text}`" if (text := cell.name.partition(":")[2]) else "as it comes"

    body = [[name, options.get(name, ""), *map(shown, row)] for name, row in cells.items()]
    return markdown(["situation", "options", *RIVALS], body, left=range(len(RIVALS) + 2))


def model_table() -> str:
    """Return the float models, in Markdown."""

    def values(name: str) -> str:
        swept = BASELINES[name].swept
        options = dict.fromkeys(option for one in swept for option in one)
        texts = {option: dict.fromkeys(" ".join(one.get(option, "") for one in swept).split()) for option in options}
        return "; ".join(f"{option}: {', '.join(of)}" for option, of in texts.items())

    heads = ["method", "what it is", "without options", "options", "tuned over"]
    body = [
        [f"`{name}`", model.title, model.usual, ", ".join(f"`{option}`" for option in model.parameters), values(name)]
        for name, model in BASELINES.items()
    ]
    return markdown(heads, body, left=range(len(heads)))


def wins(cells: Cells) -> dict[str, float]:
    """By situation the error of the first column over that of the best tuned one, as shown, where that is less."""
    shown = {name: [float(f"{cell.mean:.3g}") for cell in row] for name, row in cells.items()}
    ratio = {name: row[0] / min(row[len(OURS) :]) for name, row in shown.items()}
    return {name: over for name, over in sorted(ratio.items(), key=lambda item: -item[1]) if over * _WON > 1}


def verdict(cells: Cells) -> str:
    """Return the claim, and a table of the situations in which a tuned rival is better than tracking."""
    better, body = wins(cells), []
    for name, over in better.items():
        errors = [float(f"{cell.mean:.3g}") for cell in cells[name][len(OURS) :]]
        body.append([name, f"{over:.{0 if over >= 100 else 2}f}", RIVALS[errors.index(min(errors))]])
    text = (
        f"In {len(cells) - len(better)} of {len(cells)} situations no rival tuned for the row is better than tracking,"
    )
    text += f" which has no settings. In {len(better)} situations a rival is better; tracking is worse by this factor:"
    return f"{textwrap.fill(text, 120)}\n\n{markdown(['situation', 'factor', 'best rival'], body, left=(0, 2))}"


def parts(n_seeds: int, jobs: int) -> dict[str, object]:
    """Return the holes of the page that the tables of situations fill."""
    everything, columns = measured((*SITUATIONS, *OTHERS), n_seeds, jobs), (*OURS, *RIVALS)
    table, others = ({one.name: everything[one.name] for one in some} for some in (SITUATIONS, OTHERS))
    singles = [single(table, rival) for rival in RIVALS]
    in_all = {situation: [by_name[name] for name in (*OURS, *singles)] for situation, by_name in table.items()}

    def tables(some: Table) -> dict[str, str]:
        heads = [*(f"`{name}`" for name in OURS), *RIVALS]
        return {"errors": error_table(heads, best(some, columns)), "settings": setting_table(best(some, RIVALS))}

    return {
        "all": tables(table),
        "others": tables(others),
        "verdict": verdict(best(everything, columns)),
        "in_all": error_table([f"`{name}`" for name in (*OURS, *singles)], in_all),
        "first": FIRST_SEED,
        "last": FIRST_SEED + n_seeds - 1,
    }
