"""Expected values of other counters, as docs/concepts/verification.md lists them, on the hardware."""

import re
from pathlib import Path

import numpy as np
import pytest

from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import of_texts

PAGE = Path(__file__).parents[3] / "docs/concepts/verification.md"
CORE = {"ppr": "8", "clock": "1MHz", "tick": "1clk", "max-time": "10clk"}
ROWS = [
    tuple(cell.strip() for cell in line.strip("|\n").split("|"))
    for line in PAGE.read_text().split("## Expected values of others")[1].splitlines()
    if re.match(r"\| (?!who)\w", line)
]


@pytest.mark.parametrize("row", ROWS, ids=[f"{row[0]}: {row[1]}" for row in ROWS])
def test_our_values(row: tuple[str, ...]) -> None:
    """Where theirs differ, the situation has a number, which says why."""
    _, situation, options, lines, theirs, ours, captured = row
    assert (theirs == ours) == (not re.search(r"\([124]\)$", situation))
    texts = dict(CORE)
    for option in re.findall(r"--(\S+(?: [^-\s]\S*)?)", options):
        name, _, value = option.partition(" ")
        texts[name] = value or "yes"
    spec = of_texts("s", texts)
    words, apart = lines.split(), 1 if "1 clock apart" in options else 10
    levels = {name: [0] for name in "abz"}
    for word in words:
        for name, level in levels.items():
            level.append(level[-1] ^ (name.upper() in word))
    clock = np.append(0, 20 + apart * np.arange(len(words)))
    pins = {name: np.array(level, dtype=np.uint8) for name, level in levels.items()}
    trace = PinTrace(clock, pins["a"], pins["b"], int(clock[-1]) + 40, pins["z"])
    found = lockstep(spec, trace, PySim())
    assert found.n_mismatches == 0
    settled = np.append(clock[2:], trace.n_clocks - 20) - 1 + spec.latency.pin_to_count + spec.latency.tick
    ticks = found.actual.ticks
    shown = ticks.position[np.searchsorted(ticks.clock, settled, side="right") - 1].tolist()
    wanted = [int(word) for word in ours.split()]
    assert shown[-len(wanted) :] == wanted
    if captured:
        assert found.actual.index.index_position[-1] == int(captured)


def test_there_is_a_row_of_each() -> None:
    assert {row[0] for row in ROWS} == {"PandABlocks qdec", "LinuxCNC encoder", "TI eQEP", "LS7366R"}
