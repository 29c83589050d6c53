"""The datapath of Rairán's method, with injected steps."""

import numpy as np
import pytest
from support.mutant import caught, mutant
from support.rairan import DELAY, golden_updates, make_spec, random_steps, steps_of
from support.simulate import clock_by_clock

from tachometry.hdl import rairan
from tachometry.sim.golden.rairan import Model
from tachometry.spec.tachometer import BOUNDS

NAMES = ["velocity", "interval", "forced", "stalled", "n_ep1", "n_dt1"]


def check(step: np.ndarray, dt: int = 6, max_ticks: int = 9, **options: object) -> None:
    """Every update, in its clock, with every output; and every end of dt."""
    spec = make_spec(dt, max_ticks, **options)
    names = NAMES + [*BOUNDS, "bounds_valid"] * spec.bounds
    rows = [{"step_now": int(s)} for s in step] + [{"step_now": 0}] * DELAY
    seen = clock_by_clock(rairan.Datapath(spec), rows, ["velocity_valid", "last", "beyond", *names])
    got = [(clock, *(row[name] for name in names)) for clock, row in enumerate(seen) if row["velocity_valid"]]
    updates = golden_updates(spec, step)
    columns = [getattr(updates, name, updates.more.get(name)).astype(int).tolist() for name in names]
    assert got == list(zip((updates.clock + DELAY).tolist(), *columns, strict=True))
    ends, beyond = Model(spec).windows(steps_of(step), len(step))
    assert [clock for clock, row in enumerate(seen[: len(step)]) if row["last"]] == ends.tolist()
    assert [row["beyond"] for row in seen[: len(step)] if row["last"]] == beyond.astype(int).tolist()


def steps(dt: int = 6, n: int = 4000) -> np.ndarray:
    """Backwards at first, at gaps that end with dt, and some just longer than dt after short ones; then anything."""
    gaps = np.repeat([dt, max(dt // 3, 1), dt + 2, max(dt // 2, 1), 5 * dt, 4 * dt + 1, max(dt // 3, 1), dt], 7)
    regular = np.zeros(gaps.sum() + 1, dtype=np.int64)
    regular[np.cumsum(gaps)] = -1
    return np.append(regular, random_steps(np.random.default_rng(1), n, dt))


@pytest.mark.parametrize("dt", [1, 2, 3, 6, 40])
@pytest.mark.parametrize("options", [{}, {"paper_exact": True}, {"bound_decay": False}, {"bounds": True}])
def test_every_update(dt: int, options: dict) -> None:
    check(steps(dt), dt, **options)


@pytest.mark.parametrize("estimate", ["n1", "n2", "n3"])
@pytest.mark.parametrize("frac_bits", [4, 5, 9, 24])
def test_every_estimate(estimate: str, frac_bits: int) -> None:
    """With 4 fraction bits 1/32 is a tie, both ways."""
    by_turns = np.zeros(6000, dtype=np.int64)
    at = np.cumsum(np.tile([3, 20, 95, 96, 97, 100, 2, 2], 20))
    by_turns[at[at < 6000]] = np.repeat([1, -1], 80)[: np.count_nonzero(at < 6000)]
    check(by_turns, 3, 40, estimate=estimate, frac_bits=frac_bits)
    check(steps(40), 40, 40, estimate=estimate, frac_bits=frac_bits)


MUTANTS = {
    "a count at the end of dt opens nothing": ("pulse & (late | due) | turns", "pulse & late | turns"),
    "a reversal is none": ("self.step[1] ^ self.backward", "0"),
    "the first count is a reversal": ("pulse & moved & (self.step[1]", "pulse & (self.step[1]"),
    "Cep begins at 2": ("[c_more.eq(0), self.any.eq(1), self.beyond.eq(0)]", "[c_more.eq(1), self.any.eq(1)]"),
    "Cdt does not saturate": ("with m.If(~self.rest)", "with m.If(1)"),
    "rest comes a dt early": ("self.rest.eq(self.c_dt == self._spec.timing.max_ticks - 1)", "self.rest.eq(0)"),
    "never in step": ("in_step.eq(opens)", "in_step.eq(0)"),
    "falls too early": ("(waited > self.n)", "(waited >= self.n)"),
    "the high regime stays": ("(one & self.high)", "Const(0)"),
    "Ndt1 ← 1 ends the high regime": ("opens & ((self.c_dt != 1) | ~self.high)", "opens"),
    "a rounding carry is lost": ("Mux(high, ~entry[2], entry[0])", "Mux(high, 1, entry[0])"),
    "the complement without its carry": ("carry ^ backward", "carry"),
    "dt is a clock too long": ("start = cycles - 2", "start = cycles - 1"),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_mutants_are_caught(name: str) -> None:
    box = rairan.Datapath if "carry" in name else rairan.Counters
    with mutant(box, *MUTANTS[name]), caught():
        check(steps())


def test_mutant_of_the_letter_is_caught() -> None:
    with mutant(rairan.Counters, "opens.eq(pulse & late), self", "opens.eq(pulse & (late | due)), self"), caught():
        check(steps(), paper_exact=True)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("loose=self.rest, unsynced=~in_step", "loose=0, unsynced=~in_step"),
        ("loose=self.rest, unsynced=~in_step", "loose=self.rest"),
        ("set_(1, loose=~pulse)", "set_(1)"),
        ("set_(waited, forced=1, loose=1)", "set_(waited, forced=1)"),
        ("self.known.eq(known)", "self.known.eq(1)"),
    ],
)
def test_mutants_of_bounds_are_caught(right: str, wrong: str) -> None:
    with mutant(rairan.Counters, right, wrong), caught():
        check(steps(), bounds=True)


def test_mutant_of_a_tie_is_caught() -> None:
    with mutant(rairan.Datapath, "Mux(backward & (n == spec.tie), 0, entry)", "entry"), caught():
        test_every_estimate("n1", 4)
