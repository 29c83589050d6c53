"""The machine of the tracking method: random programs of every operation, held against integers without bounds."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from support import compiled
from support.nightly import only
from support.simulate import Player, clock_by_clock
from support.tracking import CLEARING, Executed, Interpreter, Tick, hostile, ticks_of

from tachometry.hdl.methods import track_machine
from tachometry.sim.golden.methods.track import Windows
from tachometry.spec import Encoder, Speed, Timing, TrackTachometer
from tachometry.spec.formats.tracking import LEVELS
from tachometry.spec.formats.tracking_code import Choice, Condition, Do, Instruction, Level, Op, Phase, Step
from tachometry.spec.formats.tracking_program import STATES, TABLES, Program
from tachometry.spec.methods.track import FETCH_CLOCKS

ZERO = STATES  # the address of a word that is 0


@dataclass(frozen=True)
class Script(Program):
    """Any steps, with any words in the memory."""

    code: Sequence[Step] = ()
    words: Sequence[int] = ()

    @cached_property
    def steps(self) -> list[Step]:
        """The whole program."""
        return [*self.code, Do(Op.OUT, ZERO)]

    @property
    def memory(self) -> list[int]:
        """First contents of the memory."""
        return list(self.words)


def spec_of(external: bool, bandwidth: int = 200) -> TrackTachometer:
    """Return a core; words have 26 bits and more."""
    return TrackTachometer(
        encoder=Encoder(100),
        timing=Timing(1_000_000, 1200, 10),
        frac_bits=4,
        max_speed=Speed.parse("20rad/s"),
        bandwidth=Fraction(bandwidth),
        fine_bits=1,
        least_memory=Fraction(9, 10),
        external_tick=external,
        max_tick_cycles=1200 if external else None,
    )


def script(code: Sequence[Step], words: Sequence[int], spec: TrackTachometer) -> Script:
    """Return a program of some steps on a memory of some words."""
    return Script(spec.form, Fraction(1), 0, code, words)


def words(rng: np.random.Generator, width: int) -> list[int]:
    """Return random contents: words of all sizes whose sums fit; constants are not negative, and the first of them is
    0.
    """

    def word(sign: int) -> int:
        return sign * int(rng.integers(0, 1 << int(rng.integers(1, width - 3)))) - (sign < 0)

    states = [word(int(rng.choice([-1, 1]))) for _ in range(STATES)]
    return [*states, 0, *(word(1) for _ in range(TABLES - STATES - 1)), *(word(1) for _ in range(3 * LEVELS))]


def template(op: Op, rng: np.random.Generator, width: int) -> list[Step]:
    """Return some steps with an operation, and with operands that may be too large for it."""
    states, constants = (rng.integers(*ends, 4).tolist() for ends in ((0, STATES), (ZERO + 1, TABLES)))
    any_word = int(rng.choice([*states, *constants]))
    factor = [Do(Op.LOAD, constants[0]), Do(Op.TO_MQ)]
    nothing = [Do(Op.LOAD, ZERO), Do(Op.TO_MQ)]
    few = int(rng.integers(1, 8))
    some: dict[Op, list[Step]] = {
        Op.LOAD_SIGNED: [Do(Op.LOAD, states[0]), Do(Op.SIGN), Do(Op.LOAD_SIGNED, any_word)],
        Op.KEEP: [Do(Op.LOAD, any_word), Do(Op.KEEP, states[0]), Do(Op.LOAD_SIGNED, states[0])],
        Op.STORE: [Do(Op.LOAD, any_word), Do(Op.STORE, states[0]), Do(Op.ADD, states[0])],
        Op.MUL: [*factor, Do(Op.MUL, any_word, int(rng.integers(1, width + 1)))],
        Op.DIV: [*factor, Do(Op.DIV, constants[1], width + int(rng.choice([0, few]))), Do(Op.FROM_MQ)],
        Op.FRACTION: [
            *nothing,
            Do(Op.LOAD, constants[0]),
            Do(Op.FRACTION, constants[1], int(rng.integers(1, width))),
            Do(Op.FROM_MQ),
        ],
        Op.DOUBLE: [*factor, Do(Op.LOAD, states[0]), Do(Op.DOUBLE, steps=few)],
        Op.SHIFT: [Do(Op.LOAD, states[0]), Do(Op.SHIFT, steps=few)],
        Op.INPUT: [Do(Op.INPUT, int(rng.choice([*range(4), 7])))],
        Op.LEVEL: [Do(Op.LEVEL, Level(rng.choice([0, 1, 2, 2, 2, 2]))), Do(Op.LOAD, TABLES + 16 * (few % 3))],
        Op.PHASE: [Do(Op.PHASE, Phase(few % 3))],
    }
    for each in (Op.TEST, Op.TEST_AND, Op.TEST_OR):
        some[each] = [Do(Op.LOAD, states[0]), Do(Op.TEST), Do(Op.LOAD, states[1]), Do(each)]
    begin: Step = Do(Op.LOAD, int(rng.choice([*states, ZERO])))
    if op in (Op.ADD_INPUT, Op.SUB_INPUT):
        return [begin, Do(op, int(rng.integers(0, 4)))]
    return some.get(op, [begin, Do(op, any_word if op in (Op.ADD, Op.SUB, Op.LOAD) else 0)])


# All levels and one more, and back.
LEVELS_UP_AND_DOWN: list[Step] = [
    step
    for change in [Level.FIRST, *[Level.NEXT] * LEVELS, *[Level.BACK] * 5]
    for step in (Do(Op.LEVEL, change), Do(Op.LOAD, TABLES), Do(Op.TO_MQ))
]
OPERATIONS = [op for op in Op if op not in (Op.JUMP, Op.OUT, Op.WAIT)]


def random_steps(rng: np.random.Generator, held: Sequence[int], spec: TrackTachometer, n: int) -> list[Step]:
    """Return some steps in whose operands and results nothing is too large, whatever was before, with ways to choose
    from.
    """
    steps: list[Step] = []
    while len(steps) < n:
        some = template(OPERATIONS[int(rng.integers(len(OPERATIONS)))], rng, spec.form.width)
        if rng.random() < 0.2:
            ways = [random_steps(rng, held, spec, 4) if rng.random() < 0.7 else [] for _ in range(2)]
            some = [Do(Op.LOAD, int(rng.integers(STATES))), Choice(Condition(int(rng.integers(8))), *ways)]
        try:
            Interpreter(script(some, held, spec)).run(tick(spec, np.random.default_rng(0)))
        except (AssertionError, ValueError, TypeError):
            continue
        steps += some
    return steps


def tick(spec: TrackTachometer, rng: np.random.Generator) -> Tick:
    """Return random inputs; places are as odd or even as the number."""
    form = spec.form
    number = int(rng.integers(0, form.max_count + 1))
    return Tick(
        number=number,
        times=int(rng.integers(0, 1 << form.times_bits)),
        places=2 * int(rng.integers(-number, number + 1)) + number % 2,
        moved=int(rng.integers(-form.max_count, form.max_count + 1)),
        length=int(rng.integers(1, form.longest_tick + 1)),
        beyond=bool(rng.random() < 0.5),
        quiet=bool(rng.random() < 0.5),
    )


def check(program: Program, ticks: Sequence[Tick], moved_width: int, play: Player) -> list[list[Executed]]:
    """Run the program once for each tick: in every clock in which an instruction ends, `ac` and `mq` are right."""
    names = ("number", "times", "places", "moved", "length", "beyond", "quiet", "counted")
    spacing = program.clocks + FETCH_CLOCKS
    rows = []
    for one in ticks:
        begin = {"begin": 1, **{name: int(getattr(one, name)) for name in names}}
        rows += [begin, *[{"begin": 0}] * (spacing - 1)]
    rows.append({})
    shown = ["velocity", "acceleration", "p", "out", "tracks"]
    seen = play(track_machine.TrackMachine(program, moved_width=moved_width), rows, shown)
    right = Interpreter(program)
    executed = []
    for number, one in enumerate(ticks):
        executed.append(right.run(one))
        begin_clock = number * spacing
        for now, following in zip(executed[-1], executed[-1][1:], strict=False):
            row = seen[begin_clock + FETCH_CLOCKS + now.clocks]
            assert row["velocity"] == now.mq, now
            if now.ac is not None and following.instruction.op not in CLEARING:
                assert row["acceleration"] == now.ac, now
        assert executed[-1][-1].clocks == program.clocks  # both ways of every choice take equally long
        ends = [clock for clock in range(begin_clock, begin_clock + spacing) if seen[clock]["out"]]
        assert ends == [begin_clock + spacing - 1]
        row = seen[ends[0]]
        assert (row["p"], row["tracks"]) == (right.x, right.phase == Phase.TRACKS)
    return executed


def check_random(seed: int) -> set[Op]:
    """Return a random program, thrice; the operations in it."""
    rng = np.random.default_rng(seed)
    spec = spec_of(external=bool(seed % 2), bandwidth=int(rng.choice([50, 200, 500])))
    held = words(rng, spec.form.width)
    program = script([*random_steps(rng, held, spec, 60), *LEVELS_UP_AND_DOWN], held, spec)
    executed = check(program, [tick(spec, rng) for _ in range(3)], spec.widths.count, clock_by_clock)
    return {each.instruction.op for run in executed for each in run}


def test_random_programs() -> None:
    """Every operation is met."""
    met: set[Op] = set()
    for seed in range(12):
        met |= check_random(seed)
    assert met == set(Op)


def check_program(
    external: bool = True, n_ticks: int = 60, seed: int = 1, *, play: Player = compiled.clock_by_clock, **options: Any
) -> set[Instruction]:
    """Return the program itself, on hostile counts that come as soon as they may; its jumps that went only one way."""
    spec = replace(spec_of(external), **options)
    rng = np.random.default_rng(seed)
    windows = Windows.of(*hostile(spec, rng, n_ticks))
    core, ticks = Interpreter(spec.program), []
    for one in ticks_of(spec, windows, core):
        core.run(one)
        ticks.append(one)
    executed = check(spec.program, ticks, spec.widths.count, play)
    ways = {
        (now.instruction, now.clocks - before.clocks)
        for run in executed
        for before, now in pairwise(run)
        if now.instruction.op == Op.JUMP and now.instruction.steps != Condition.ALWAYS
    }
    both = Counter(jump for jump, _ in ways)
    return {jump for jump in spec.program.instructions if jump.op == Op.JUMP and jump.steps} - {
        jump for jump, n in both.items() if n == 2
    }


@pytest.mark.parametrize("options", only([{}], [{}, {"agile": False}, {"growing_memory": False}]))
def test_program(options: dict[str, Any]) -> None:
    """Every jump goes both ways, but that of an agile correction where there is none."""
    one_way = check_program(True, 150, 1, **options) & check_program(True, 150, 4, **options)
    assert {Condition(jump.steps) for jump in one_way} == ({Condition.FLAG} if "agile" in options else set())
    check_program(False, **options)
