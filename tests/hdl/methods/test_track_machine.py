"""The machine of the tracking method, with both of its units, beside the same program without gates."""

from collections.abc import Sequence

import numpy as np
import pytest
from support import compiled
from support.nightly import nightly
from support.simulate import Player, clock_by_clock
from support.tracking import Interpreter, core, windows

from tachometry.hdl.methods import track_machine
from tachometry.sim.golden.methods.track_recursion import Recursion, log2
from tachometry.spec import TrackTachometer
from tachometry.spec.formats.tracking import RESULT_BITS, WIDTH
from tachometry.spec.formats.tracking_code import Program, assembled
from tachometry.spec.formats.tracking_instruction import Instruction
from tachometry.spec.formats.tracking_order import clash
from tachometry.spec.formats.tracking_units import BLOCK, Start

CORES = {
    "serial": core(multiplier="serial", clock="12MHz", tick="200us", max_speed="500rad/s", max_time="8ms"),
    "long": core(multiplier="serial", tick="20ms", max_speed="20rad/s"),
    "block": core(multiplier="block", external_tick="yes", max_tick_period="683us", ppr="81000"),
}
NAMES = ("number", "times", "places", "last", "moved", "kind", "down", "end", "length")


def check(program: Program, rows: Sequence[Sequence[int]], play: Player = clock_by_clock) -> int:
    """Begin a tick as soon as may be: outputs hold what they must, in their clock; how many instructions were met."""
    spacing = program.all_clocks
    inputs: list[dict[str, int]] = []
    for row in rows:
        # What the tick had comes a clock after it, as it comes from the front end.
        inputs += [{"begin": 1}, {"begin": 0, **dict(zip(NAMES, row, strict=True))}, *[{}] * (spacing - 2)]
    seen = play(track_machine.TrackMachine(program), inputs, program.outputs)
    right = Interpreter(program)
    for number, row in enumerate(rows):
        expected = right.tick(*row)
        assert seen[number * spacing + program.velocity_clocks - 1]["velocity"] == expected[0], f"tick {number}"
        for after in (program.clocks - 1, spacing - 1):
            shown = seen[number * spacing + after]
            assert tuple(shown[name] for name in program.outputs) == expected, f"tick {number}, {after} clocks later"
    return len(right.met)


def rows_of(spec: TrackTachometer, seed: int, n_ticks: int) -> list[tuple[int, ...]]:
    """Return the ticks of motions of all kinds; of those without a count, the first three in a row."""
    rows = list(windows(spec, seed, 8 * n_ticks).rows())
    counted = np.array([row[0] > 0 for row in rows])
    kept = counted | np.roll(counted, 1) | np.roll(counted, 2)
    return [row for row, keep in zip(rows, kept, strict=True) if keep][:n_ticks]


# tests/hdl/methods/test_track.py plays both units on what the front end gives.
@nightly
@pytest.mark.parametrize("name", CORES)
def test_machine(name: str) -> None:
    spec = CORES[name]
    met = check(spec.program, rows_of(spec, 1, 1000), compiled.clock_by_clock)
    assert met > 0.9 * len(spec.program.code.instructions)


class Chosen(Program):
    """A program that stores two words and a sign on a condition."""

    code = assembled(
        """
        reset: a = one; b = one
        tick: $moved - a keep; if neg goto there
        a = $moved - b; b = $times - one keep
        there: zero s+ one out velocity
        a out velocity_std; b out acceleration; a + b out position_fine; end
        """.replace(": ", ":\n").replace("a out", "c = b; " * 99 + "a out"),  # of a usual length
        ports=2,
    )


def test_what_a_condition_chooses() -> None:
    """Of two stores the second has the same condition, whatever the first one stored."""
    program, rng = CORES["block"].program, np.random.default_rng(1)
    chosen = Chosen(program.form, program.times, 0)
    assert sum(bool(one.store and one.jump) for one in chosen.code.instructions) == 2
    rows = [(1, int(rng.integers(9)), 0, 0, int(rng.integers(-9, 9)), 0, 0, 0, 1) for _ in range(12)]
    check(chosen, rows)


def results(program: Program, operations: Sequence[tuple[Instruction, int]], clocks: int) -> list[int]:
    """Return what the unit gives for instructions and operands, so many clocks apart."""
    rows: list[dict[str, int]] = []
    for one, operand in operations:
        # The block unit takes the sum in the clock after the start, but half of a product's in that of the start.
        begins = {"start": one.start, "how": program.number(one), "sum": operand}
        begins |= {"coming": operand % (1 << WIDTH // 2)} if program.times is BLOCK else {}
        rows += [begins, *[begins | {"start": Start.NONE}] * (clocks - 1)]
    seen = clock_by_clock(track_machine.TrackMachine(program).unit, rows, ["result"])
    return [row["result"] for row in seen[clocks - 1 :: clocks]]


@pytest.mark.parametrize("name", ["serial", "block"])
def test_a_reset_forgets_all_words(name: str) -> None:
    """A motion leaves nothing in them that is shown, even if the next one has a speed from its second tick on."""
    spec = CORES[name]
    fresh, other = Interpreter(spec.program), Interpreter(spec.program)
    for row in rows_of(spec, 1, 100):
        other.tick(*row)
    other.met.clear()
    rows = [row for row in rows_of(spec, 2, 100) if row[0]]
    assert [fresh.tick(*row) for row in rows] == [other.tick(*row) for row in rows]


def test_operations_are_under_way_together() -> None:
    """Of all kinds, in any order, each as soon after those before as it may be."""
    program, rng = CORES["block"].program, np.random.default_rng(1)
    machine, factor, clock = Interpreter(program), 0, 0
    machine._unit._chance = 0
    begun: list[tuple[Instruction, int]] = []
    rows: list[dict[str, int]] = [{"start": 0, "sum": 0, "coming": 0} for _ in range(2000)]
    results: dict[int, int] = {}
    for start in rng.choice([Start.LOG, Start.EXP, Start.OVER, Start.BY, Start.TIMES], 300).tolist():
        one = Instruction(start=Start(start), how={Start.OVER: "2", Start.TIMES: "mean"}.get(start, ""))
        operand = int(rng.integers(1 << 16 if start in (Start.EXP, Start.BY) else 1 << 30))
        while any(clash(other, one, clock - at) for other, at in begun[-8:]):
            clock += 1
        begun.append((one, clock))
        rows[clock] |= {"start": start, "how": program.number(one), "coming": operand % (1 << WIDTH // 2)}
        rows[clock + 1]["sum"] = operand
        if one.start == Start.BY:
            factor = operand
        else:
            results[clock + program.times.of(one.start)] = machine.result(one, operand, factor)
        clock += 1
    seen = clock_by_clock(track_machine.TrackMachine(program).unit, rows[: clock + 8], ["result"])
    assert len(results) > 200
    assert {at: seen[at]["result"] for at in results} == results


@pytest.mark.parametrize("name", CORES)
def test_gains_end_with_their_table(name: str) -> None:
    """From X = 1/4 down to 2^-13, beyond the last entry, which then stands for all."""
    program = CORES[name].program
    operations, right = [], []
    for log_x in range(-2 * 4096 - 1, -13 * 4096, -1777):
        for number in range(3):
            operations.append((Instruction(start=Start.GAIN, how=str(number)), log_x))
            state = Recursion(program.form, program.ahead)
            state.log_share = log_x
            right.append(state._gain(number))
    assert results(program, operations, 12) == right


@pytest.mark.parametrize("name", CORES)
def test_logarithms(name: str) -> None:
    """Of 0, of a power of two and what is below it, and of negative numbers."""
    values = [0, -1, 1, *(sign * ((1 << k) - less) for k in range(1, 38, 5) for less in (0, 1) for sign in (1, -1))]
    operations = [(Instruction(start=Start.LOG), value) for value in values]
    assert results(CORES[name].program, operations, 48) == [log2(value) for value in values]


@pytest.mark.parametrize("name", CORES)
def test_products(name: str) -> None:
    """Many are near a bound of theirs, to either side."""
    program, rng = CORES[name].program, np.random.default_rng(1)
    right = Recursion(program.form, program.ahead)
    right._chance = 0
    operations, products = [], []
    for how in ("half_velocity", "place", "mean", "velocity") * 16:
        factor = int(rng.integers(1 << 15, 1 << 16)) >> int(rng.integers(14))
        bound = (1 << RESULT_BITS + program.form.shifts[how]) // factor
        operand = int(rng.choice([-1, 1])) * min(int(bound * rng.uniform(0.3, 3)), (1 << WIDTH - 1) - 1)
        operations += [(Instruction(start=Start.BY), factor), (Instruction(start=Start.TIMES, how=how), operand)]
        products.append(right._product(operand, factor, how))
    assert results(program, operations, 48)[1::2] == products
    assert {-(1 << RESULT_BITS), 1 << RESULT_BITS} <= {*products}
