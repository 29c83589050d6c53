"""The watch of the encoder against its rules, in seconds of few clocks."""

import numpy as np
import pytest
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.front_end import encoder_watch
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import of_texts
from tachometry.spec.core.health import Fault

WIDTH = 6
SEEN = ["health", "faults", "index_error"]
Row = dict[str, int]


def rows_of(seed: int, n_clocks: int = 600) -> list[Row]:
    """Return random inputs, in which edges are often alone, and positions near a turn apart."""
    rng = np.random.default_rng(seed)
    rows: list[Row] = []
    levels, position = {"level_a": 0, "level_b": 0}, 0
    favourite = "level_a"
    for clock in range(n_clocks):
        if rng.random() < 0.05:
            favourite = rng.choice(["level_a", "level_b"])
        for line in levels:
            levels[line] ^= int(rng.random() < (0.6 if line == favourite else 0.06))
        row = {**levels, "ready": int(clock > 4 and rng.random() < 0.98), "clear": int(rng.random() < 0.04)}
        row |= {"step": int(rng.choice([-1, 0, 0, 1, 1])), "decode_error": int(rng.random() < 0.2)}
        row["index_valid"] = int(rng.random() < 0.2 and not (rows and rows[-1]["index_valid"]))
        if row["index_valid"]:
            position += int(rng.choice([-8, 0, 8, 8]) + rng.choice([0, 0, 0, -1, 1, 3, 4, -4]))
            position = (position + 32) % 64 - 32
        rows.append({**row, "index_position": position})
    return rows


def ruled(rows: list[Row], *, second: int, edges: int, errors: int, turn: int, reset: bool) -> list[Row]:
    """Return what the rules make of the inputs."""
    shown = []
    now = dict.fromkeys(SEEN, 0)
    past = {"level_a": 0, "level_b": 0}
    line, alone, counted, backward = "", 0, 0, False
    origin: int | None = None
    origin_backward, due = False, 0
    for clock, row in enumerate(rows):
        shown.append(dict(now))
        found = set()
        changed = [name for name in past if row["ready"] and row[name] != past[name]]
        past = {name: row[name] for name in past}
        if len(changed) == 2:
            alone = 0
        elif changed:
            alone, line = (alone + 1 if changed == [line] and alone else 1), changed[0]
            if alone == edges:
                alone = 0
                found.add(Fault.B_STANDS if line == "level_a" else Fault.A_STANDS)
        if row["decode_error"]:
            counted += 1
            if counted == errors + 1:
                found.add(Fault.ILLEGAL)
        if clock % second == second - 1:
            alone = counted = 0
        error = due
        if error:
            found.add(Fault.INDEX_COUNTS)
        due = 0
        if row["index_valid"]:
            way = (row["index_position"] - (0 if reset else origin or 0) + 32) % 64 - 32
            off = (way + (turn if backward else -turn) + 32) % 64 - 32
            due = off if way and origin is not None and backward == origin_backward else 0
            origin, origin_backward = row["index_position"], backward
        if row["step"]:
            backward = row["step"] < 0
        if found:
            now["health"] = now["health"] or min(found)
            now["faults"] = min(now["faults"] + 1, 255)
        now["index_error"] = error or now["index_error"]
        if row["clear"]:
            now = dict.fromkeys(SEEN, 0)
    return shown


CASES = [(7, 3, 1, False), (50, 5, 0, True), (1, 2, 0, False), (13, 2, 3, True), (600, 4, 15, False)]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("seed", only([0], range(6)))  # 600 random clocks reach every rule
def test_every_clock_is_as_the_rules_say(seed: int, case: tuple[int, int, int, bool]) -> None:
    second, edges, errors, reset = case
    box = encoder_watch.EncoderWatch(
        second=second, edges=edges, errors=errors, counts_per_rev=8, position_width=WIDTH, index_reset=reset
    )
    rows = rows_of(seed)
    seen = clock_by_clock(box, rows, SEEN)
    for clock, wanted in enumerate(ruled(rows, second=second, edges=edges, errors=errors, turn=8, reset=reset)):
        assert seen[clock] == wanted, (seed, case, clock)


@pytest.mark.parametrize("seed", only([1], range(4)))
@pytest.mark.parametrize("decoding", only(["4"], ["4", "2", "1"]))
def test_golden_model_and_hardware_agree_over_seconds(seed: int, decoding: str) -> None:
    """A second of a clock of 1 kHz ends many times in a motion."""
    core = {"ppr": "4", "decoding": decoding, "clock": "1kHz", "tick": "4ms", "max-time": "40ms", "index": "yes"}
    spec = of_texts("m", core | {"health": "yes", "health-edges": "6", "health-errors": "1", "filter": "1"})
    found = lockstep(spec, stress(spec, seed), PySim())
    assert found.n_mismatches == 0, found.first
    assert found.actual.ticks.health[-1]
